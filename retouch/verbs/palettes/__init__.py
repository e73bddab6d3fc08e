"""Palettes: fills for tactile maps, braille graphics and controls."""
