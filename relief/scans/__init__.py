"""Scans of prints: readers, registration to the design, lost detail; a coupon that measures printers."""
