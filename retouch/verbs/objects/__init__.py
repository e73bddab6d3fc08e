"""Verbs about objects: wrapping, and the preview of it."""
