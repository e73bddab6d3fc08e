"""Scans of prints: read, registered to their design, and what the printer lost; a coupon for printers."""
