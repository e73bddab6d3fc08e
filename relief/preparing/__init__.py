"""Preparing: height maps of any picture, square, grey and, if asked for, periodic."""
