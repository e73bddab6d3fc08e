"""Lights: kinds, one row of a table each, and their quadrature by parallel lights."""
