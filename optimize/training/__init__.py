"""Data sets and nets are made here, by touch and sight."""
