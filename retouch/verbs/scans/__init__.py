"""Scans of prints beside their designs, and printers measured by a coupon."""
