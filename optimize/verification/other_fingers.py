"""How a change feels to other fingers: softer and stiffer skin, shallower and deeper receptors."""

import logging
from statistics import fmean, pstdev
from typing import Any

import numpy as np

import tactile
from relief.common.arrays import Array
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import places
from relief.surface import Surface
from tactile.fingers import fingers, roughness_by_finger
from tactile.skin import Skin

_log = logging.getLogger(__name__)

SMOOTH = 1e-6
"""Largest roughness that is rounding error; ratios to such a roughness mean nothing."""
MOST_PLACES = 4
"""Most places that the fingers press on."""


def felt_by_fingers(
    before: Array, after: Array, surfaces: tuple[Surface, Surface], skin: Skin
) -> dict[str, Any] | None:
    """The entry `fingers` of result.json and of a comparison.

    Args:
        before, after: (rows, cols) heights of both reliefs, mm.
        surfaces: of both.
        skin: the finger that the set is about.

    Returns:
        `count` of fingers, and of `places`; `jnd_mean`, `jnd_min`, `jnd_max` and `jnd_std`, None where a
        relief is smooth to one of the fingers; `each`, for each finger its `name`, `young_modulus_mpa`,
        `depth_mm`, the means over the places `initial_roughness` and `roughness`, and the `jnd` between both
        means, None if one is smooth. None if the contact of a finger does not converge.
    """
    felt, counts = [], []
    for heights, surface in zip((before, after), surfaces, strict=True):
        patches = _in_the_middle(surface)
        try:
            felt.append(
                roughness_by_finger(patches.within_reach(heights), skin, patches.size_mm).mean(axis=1)
            )
        except tactile.ContactError as error:
            # Another finger's contact is no reason to lose the result of a run.
            _log.info("no table of other fingers: %s", error)
            return None
        counts.append(patches.count)
    each = []
    for finger, first, then in zip(fingers(skin), *felt, strict=True):
        smooth = min(first, then) < SMOOTH
        each.append(
            {
                "name": finger.name,
                "young_modulus_mpa": finger.skin.young_modulus_mpa,
                "depth_mm": finger.skin.depth_mm,
                "initial_roughness": float(first),
                "roughness": float(then),
                "jnd": None if smooth else tactile.jnd_apart(float(then), float(first)),
            }
        )
    jnds = [one["jnd"] for one in each]
    spread = (None,) * 4 if None in jnds else (fmean(jnds), min(jnds), max(jnds), pstdev(jnds))
    names = ("jnd_mean", "jnd_min", "jnd_max", "jnd_std")
    return {"count": len(each), "places": min(counts), **dict(zip(names, spread, strict=True)), "each": each}


def _in_the_middle(surface: Surface) -> Patches:
    """Patches at the few places of a surface that are nearest to its middle."""
    at = places(surface)
    apart = np.square(at - at.mean(axis=0)).sum(axis=1)
    nearest = np.sort(np.argsort(apart, kind="stable")[:MOST_PLACES])
    return Patches(surface, at[nearest], STEERING_SAMPLES)
