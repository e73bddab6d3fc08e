"""Solids: bodies from files of other programs, mended and meshed, wrapped in reliefs, and written for printers."""
