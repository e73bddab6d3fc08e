"""Fuzzy skin: the settings of a slicer by which the sides of a part feel as wanted."""
