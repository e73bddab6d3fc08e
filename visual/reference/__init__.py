"""Converged pictures that learned models are trained on and judged by."""
