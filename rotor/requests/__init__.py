"""Declared fields of requests, and how command lines, scenes and Python calls fill them."""
