"""Estimates of a run before it begins: seconds, memory, and how far a texture can go."""
