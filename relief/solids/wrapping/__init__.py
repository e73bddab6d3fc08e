"""Wrapping: a tile laid over a body, so that it has the same size in mm everywhere."""
