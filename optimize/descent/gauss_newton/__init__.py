"""Gauss-Newton, the default method: its equations, their solution, and what a step may do."""
