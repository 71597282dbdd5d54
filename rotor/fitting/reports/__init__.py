"""What a fit reports: notes, parameters with errors, tables for publication."""
