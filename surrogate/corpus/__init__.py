"""Textures to learn from: recipes, photographs, optimised textures, their splits and their manifest."""
