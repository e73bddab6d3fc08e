"""Solids: bodies from files of other programs, mended, meshed, wrapped and written for printers."""
