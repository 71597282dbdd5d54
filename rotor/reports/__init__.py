"""Results as text: facts with their names, tables for people, JSON for programs."""
