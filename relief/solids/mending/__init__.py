"""Mending of bodies that files bring, and the round holes of bodies."""
