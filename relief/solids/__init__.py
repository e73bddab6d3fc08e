"""Solids: bodies of files, mended and meshed, wrapped in reliefs, and written for printers."""
