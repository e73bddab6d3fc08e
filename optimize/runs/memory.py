"""Memory that a run takes, estimated before any work begins."""

import os
from pathlib import Path

from optimize.descent.gauss_newton.windows import CORE, MARGIN, MOST_AT_ONCE
from relief.ground.errors import InputError
from relief.patches import STEERING_SAMPLES as PATCH_SAMPLES

MEMORY_GIB, SAMPLE_GIB, FURTHER_SAMPLE_GIB = 0.5, 1.5e-5, 5e-6
"""Peak memory, GiB: of any run, for each height sample, and for each beyond those that are solved at once.
Runs take 0.63 to 1.04 of these estimates, the fast look less than the exact one."""
PLACE_BYTES = 8
"""Bytes for each height sample at each place of the finger: the response to its force, and a copy."""
WINDOW = (CORE + PATCH_SAMPLES + 2 * MARGIN) ** 2
"""Height samples of a window; on surfaces that are solved by windows each place takes no more than these."""

COARSER_SIDES = (2048, 1024, 512, 256, 128)
"""Samples a side of the coarser textures of which the first that fits into memory is recommended."""


def needed_gib(samples: int, places: int) -> float:
    """About the peak memory of a run, GiB.

    Args:
        samples: height samples of the relief.
        places: of the finger.
    """
    of_place = samples if samples <= MOST_AT_ONCE else min(samples, WINDOW)
    several = PLACE_BYTES * places * of_place if places > 1 else 0
    at_once = min(samples, MOST_AT_ONCE)
    surface = at_once * SAMPLE_GIB + (samples - at_once) * FURTHER_SAMPLE_GIB
    return MEMORY_GIB + surface + several / 2**30


def machine_gib() -> float:
    """Memory of this machine, GiB."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30


def check_memory_of(texture: Path, shape: tuple[int, int], places: int) -> None:
    """Raise InputError if a relief of (rows, cols) samples takes more memory than there is."""
    needed, there = needed_gib(shape[0] * shape[1], places), machine_gib()
    if needed > there:
        touched = f" touched at {places} places" if places > 1 else ""
        fitting = [side for side in COARSER_SIDES if needed_gib(side**2, places) <= there]
        remedy = "a coarser texture or a wider touch.spacing_mm takes less"
        if fitting:
            remedy = f"retouch prepare --samples {fitting[0]} makes a texture that fits"
        raise InputError(
            f"{texture}: {shape[1]} x {shape[0]} samples{touched} take about {needed:.0f} GiB of memory, "
            f"this machine has {there:.0f}; {remedy}"
        )
