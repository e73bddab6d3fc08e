"""Height maps: files and limits, the grid of the plate, where fingers land, input errors and the cache."""
