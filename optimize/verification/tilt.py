"""Tilt: whether the tilt of what was measured changes how rough a relief feels."""

import logging
import math
from dataclasses import replace

import numpy as np

from relief.corrections import levelled, plane
from relief.heightmap import LEAST_FELT_MM
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from tactile.jnd import ROUGHNESS_JND
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

_log = logging.getLogger(__name__)

CHANGE = 1.0 - ROUGHNESS_JND**-0.25
"""Least change of roughness that is reported, over the larger roughness: 0.25 just-noticeable differences.
Without the planes of the bundled textures, which are level, the change is 0.07 differences at most."""
PLANE = 0.25
"""Bound of the roughness of a plane, in its rise under the patch over the thickness of the skin: 0.12 to 0.24
of all bundled fingers, less where a finger touches a part of the plane only."""
SAMPLES = 128
"""Most samples along a side of the patches that are pressed."""
LOCATIONS = 6
"""Most contact locations that are pressed."""


def warn_of_tilt(relief: Relief, skin: Skin, roughness: float) -> None:
    """Log a warning if a relief is tilted so much that `--level` changes its roughness by 0.25 JND or more.

    The change is that of model "quick" at a few contact locations, on samples averaged to at most `SAMPLES` a
    patch. Nothing is pressed where the slope is too small for the change.

    Args:
        relief: as measured; an axis on which it repeats has no tilt.
        skin: of the finger.
        roughness: of the relief, mean over its contact locations, by any model.
    """
    surface, (rows, cols) = relief.surface, relief.heights.shape
    down, right, _ = plane(relief.heights, relief.repeats)
    slope = math.hypot(down, right) / relief.pitch_mm
    patches = Patches(surface, places(surface), side_mm=skin.patch_mm)
    rise_mm = slope * patches.size_mm
    if rise_mm < LEAST_FELT_MM or PLANE * rise_mm / skin.thickness_mm < CHANGE * roughness:
        return
    tilted = _averaged(relief, math.ceil(patches.samples / SAMPLES))
    level = replace(tilted, heights=levelled(tilted.heights, relief.repeats))
    at = places(tilted.surface)
    at = at[np.unique(np.linspace(0, len(at) - 1, LOCATIONS).astype(int))]
    felt = [
        measure_touch(one, skin, "quick", quantities=(ROUGHNESS,), at=at).means[ROUGHNESS.name]
        for one in (tilted, level)
    ]
    if abs(felt[0] - felt[1]) >= CHANGE * max(felt):
        across, along = round(abs(right) * cols, 6), round(abs(down) * rows, 6)
        tilt = f"{math.degrees(math.atan(slope)):.2g}° ({across:.2g} mm over the width, {along:.2g} mm over"
        ratio = f"{felt[1] / felt[0]:.2g} times as rough"
        line = "%s: is tilted by %s the height); level, it is %s; --level takes the tilt out"
        _log.warning(line, relief.name, tilt, ratio)


def _averaged(relief: Relief, step: int) -> Relief:
    """A plate with the mean of each square of `step` samples a side; the last few samples are left out."""
    rows, cols = (side // step for side in relief.heights.shape)
    squares = relief.heights[: rows * step, : cols * step].reshape(rows, step, cols, step)
    return Relief(squares.mean(axis=(1, 3)), cols * step * relief.pitch_mm, name=relief.name)
