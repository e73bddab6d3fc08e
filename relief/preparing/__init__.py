"""Preparing: from somebody's picture to a height map that is square, grey and, if asked for, periodic."""
