"""The verbs: request, answer, files and report of each; one verb in a file."""
