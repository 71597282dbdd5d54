"""Declarations: what is known of each field of a request, and how texts, scenes and Python values become one."""
