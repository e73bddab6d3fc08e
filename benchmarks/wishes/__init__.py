"""Changes that newcomers wish for, as patches: how many files and hunks each takes."""
