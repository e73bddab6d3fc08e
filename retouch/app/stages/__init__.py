"""Stages of the page, in the order of the work."""
