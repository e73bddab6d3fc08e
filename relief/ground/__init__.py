"""What every room builds on: arrays, errors, files, progress, and numbers as text."""
