"""The elastic layer: skin as an operator on waves, with one modulus or layers of several."""
