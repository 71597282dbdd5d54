"""Constants of unknown molecules from a spectrum: peaks, families of lines, search, evidence, refinement, further species."""
