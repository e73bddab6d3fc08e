"""Lights of every kind as sets of parallel lights."""
