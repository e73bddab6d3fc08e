"""Reliefs: height maps and their files, grids of plates, contact locations, printers and prints."""
