"""Parts of all commands: options, files, reports."""
