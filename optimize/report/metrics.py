"""Metrics of picture change: mean, root mean square, DSSIM and FLIP, with their noise."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from optimize.report.colour_maps import srgb
from optimize.report.picture_change import change
from visual.noise import Batches

Array = NDArray[np.floating[Any]]

VIEWING_PIXELS_PER_DEGREE = 67.0
"""Pixels a degree of the visual field for FLIP: its default, a 0.7 m wide 4K monitor 0.7 m away."""


def mean_change(before: Array, after: Array) -> float:
    """Mean absolute difference of arrays of one shape, in their unit."""
    return float(np.abs(after - before).mean())


def rms_change(before: Array, after: Array) -> float:
    """Root mean square difference of arrays of one shape, in their unit."""
    return float(np.sqrt(np.square(after - before).mean()))


def dssim(before: Array, after: Array, white: float) -> float:
    """Structural dissimilarity (1 - SSIM) / 2 of two pictures as displayed (Wang et al. 2004), in [0, 1].

    Args:
        before, after: (rows, cols) linear radiance.
        white: radiance shown as full white.
    """
    from skimage.metrics import structural_similarity

    one, other = srgb(before, white), srgb(after, white)
    return float(0.5 * (1.0 - structural_similarity(one, other, data_range=1.0)))


def flip(before: Array, after: Array, white: float) -> float:
    """Mean FLIP difference of two pictures as displayed (Andersson et al. 2020), in [0, 1].

    Args:
        before, after: (rows, cols) linear radiance.
        white: radiance shown as full white.
    """
    import flip_evaluator

    images = [np.repeat(srgb(p, white)[:, :, None], 3, axis=2).astype(np.float32) for p in (before, after)]
    _, mean, _ = flip_evaluator.evaluate(
        *images, "LDR", inputsRGB=True, applyMagma=False, parameters={"ppd": VIEWING_PIXELS_PER_DEGREE}
    )
    return float(mean)


def look(before: Batches, after: Batches, white: float) -> dict[str, Any]:
    """The change of pictures and its uncertainty: the picture part of `look` in result.json.

    Args:
        before, after: of the same conditions, with common random numbers batch by batch.
        white: radiance shown as full white.
    """
    pairs = list(zip(before.mean, after.mean, strict=True))
    mean = float(before.mean.mean())
    whole = change(before, after)
    each = [change(before.condition(n), after.condition(n)) for n in range(len(pairs))]
    return {
        "pixel_change_percent": [100.0 * one.mean / white for one in each],
        "rms_change_percent": [100.0 * one.rms / white for one in each],
        "mean_change_percent_of_mean": 100.0 * whole.mean / mean,
        "rms_change_percent_of_mean": 100.0 * whole.rms / mean,
        "dssim": [dssim(b, a, white) for b, a in pairs],
        "flip": [flip(b, a, white) for b, a in pairs],
        "samples": before.samples,
        "noise": {
            "certainty": whole.certainty.name.lower(),
            "message": whole.certainty.value,
            "batches": len(before.pictures),
            "standard_error_percent": [100.0 * float(error) for error in after.relative_error],
            "change_percent_of_mean": whole.percent_of(mean),
            "change_percent_of_white": whole.percent_of(white),
            "conditions_percent_of_white": [one.percent_of(white) for one in each],
        },
    }
