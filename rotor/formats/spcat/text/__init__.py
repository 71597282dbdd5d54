"""Text of SPFIT's and SPCAT's files: reading and writing, without interpretation of codes."""
