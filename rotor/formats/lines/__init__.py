"""Lists of lines as files: assigned lines, HITRAN's records, ExoMol's lists, and lists larger than memory."""
