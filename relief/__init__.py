"""Height maps: their files and limits, the grid of the plate, export, input errors and the cache."""
