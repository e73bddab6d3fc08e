"""The thing that changes: height maps and their files, the grid of the plate, export, errors, the cache."""
