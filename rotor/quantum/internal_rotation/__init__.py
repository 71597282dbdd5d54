"""Tops that turn inside a molecule: terms by name, torsional functions of each K, blocks, labels, lines."""
