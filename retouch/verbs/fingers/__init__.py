"""Fingers of one's own: skin of any shape, meshed by tetrahedra, beside the round finger fitted to it."""
