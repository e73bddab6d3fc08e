"""The ground of all packages: arrays, errors, files, progress, and numbers as text."""
