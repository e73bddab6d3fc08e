"""Palettes: fills that every finger of a range tells apart by roughness."""
