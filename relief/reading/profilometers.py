"""Measured surfaces: files of profilometers and microscopes, as SurfaceTopography reads them."""

from pathlib import Path

from relief.reading.samples import Check, Samples


def read_measured(path: Path, check: Check) -> Samples | None:
    """Read a measured surface with its size and its unit; None for a file that says neither."""
    return None
