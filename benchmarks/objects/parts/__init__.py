"""Parts as CAD kernels, modelling programs and scanners make them, and how they come out wrapped."""
