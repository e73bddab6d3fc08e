"""Repair of meshes of files, and the round holes of bodies."""
