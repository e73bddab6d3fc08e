"""Sentences about a wrapped body: where the relief is whole or lowered, and what stays of the file."""

from collections.abc import Iterable

import numpy as np

from relief.solids.wrapping.masks import FALLOFF_DEGREES
from relief.solids.wrapping.measures import WHOLE, Lowering, narrower
from relief.solids.wrapping.options import LEAST_FALLOFF_MM
from relief.solids.wrapping.wrapped_body import Wrapped

LEAST_OFF = 0.005
"""Share of the textured area from which it is told that lengths are off."""
LITTLE = 0.1
"""Share of the textured area with the whole relief below which a remedy is told."""
FUSES_MM = 0.1
"""Width of a gap, mm, below which printers join its walls."""
LEAST_FAR_MM = 1e-3
"""Distance from the file from which it is told, mm: less is the rounding of files and the held edges."""


def wrapped_sentences(wrapped: Wrapped) -> list[str]:
    """What is to be known of a wrapped body beside its size, for a person."""
    lines = [f"{note[0].upper()}{note[1:]}." for note in wrapped.notes]
    if wrapped.off_size >= LEAST_OFF:
        lines.append(
            f"On {100 * wrapped.off_size:.0f} % of the textured area lengths in the texture are off by more "
            f"than 10 %, by up to {100 * wrapped.stretch:.0f} %."
        )
    lines += [_narrow(wrapped)] if wrapped.presence.whole_mm2 < LITTLE * wrapped.area_mm2 else []
    lines += [_lowered(wrapped.lowering)] if wrapped.lowering.part > 0.0 else []
    if (smooth := wrapped.base.smooth).kept:
        edges = "an edge" if smooth.kept == 1 else f"{smooth.kept:,} edges"
        lines.append(
            f"Keeps {edges} between flat facets: a round surface through their corners "
            f"would be up to {smooth.kept_mm:.2g} mm off them (--facets smooth lays the texture on it)."
        )
    if (far_mm := wrapped.base.mesh.farthest_mm) >= LEAST_FAR_MM:
        how = "is within {} µm of the exact one" if smooth.exact.all() else "is smoothed, by {} µm at most"
        far = how.format(f"{1000.0 * far_mm:.0f}")
        lines.append(f"Under the texture the surface {far}; all else is as in the file.")
    if wrapped.gap is not None:
        width, at = wrapped.gap
        fuses = ", which prints as one: leave that place out (--mask) or take a lower relief (--relief-mm)"
        lines.append(
            f"The narrowest gap left between facing walls is {width:.2g} mm, near ({_place(at)}) mm"
            f"{fuses if width < FUSES_MM else ''}."
        )
    return lines


def _place(at: Iterable[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in at)


def _narrow(wrapped: Wrapped) -> str:
    """That a mask leaves little of the relief, and what leaves more."""
    largest, falloff_mm = wrapped.presence.largest, wrapped.base.file.settings.falloff_mm
    if largest >= WHOLE:
        line = f"The whole relief lies on {wrapped.presence.whole_mm2:.2g} mm² alone"
        falloff = 0.5 * falloff_mm
    else:
        share = f"{100.0 * largest:.2g} %"
        line = f"The mask leaves {share} of the relief at most, and the whole relief nowhere"
        falloff = narrower(largest, falloff_mm)
    shorter = float(f"{max(LEAST_FALLOFF_MM, np.floor(100.0 * falloff) / 100.0):.2g}")
    return (
        f"{line}: textures end over {falloff_mm:g} mm inside of a mask, or {FALLOFF_DEGREES:g} degrees where "
        f"it compares angles. A narrower end (--falloff-mm {shorter:g}) or the ends of the ramp in the mask, "
        "as in z>2..3 or angle>92..93, leave more."
    )


def _lowered(lowering: Lowering) -> str:
    """On what part of the texture the relief is lowered, how far and where."""
    line = (
        f"On {100 * lowering.part:.1f} % of the textured area the relief is lowered, to "
        f"{lowering.median_factor:.2f} of its height in the median and {lowering.lowest_factor:.2f} at "
        "least, where the object bends too tightly "
        "or is too thin"
    )
    if lowering.places:
        largest = lowering.places[0]
        line += (
            f"; the largest such place, {largest.area_mm2:.3g} mm², is around ({_place(largest.at_mm)}) mm"
        )
    return line + "."
