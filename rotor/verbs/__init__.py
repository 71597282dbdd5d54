"""The verbs: what each of them asks, computes, writes and shows; one verb a file."""
