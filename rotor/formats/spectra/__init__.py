"""Files of observed spectra: text, FITS images and cubes, tables of single dishes."""
