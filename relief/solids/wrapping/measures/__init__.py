"""Measures of a wrapping."""
