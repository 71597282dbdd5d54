"""Emission of a source with one or several molecules, as a radio telescope sees it."""
