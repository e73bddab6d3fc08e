"""How a change feels to other fingers: softer and stiffer skin, shallower and deeper receptors."""

import logging
from statistics import fmean, pstdev

import numpy as np

import tactile
from optimize.verification.verification import Finger, Fingers
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import places
from relief.relief import Relief
from relief.surface import Surface
from tactile.fingers import fingers, roughness_by_finger
from tactile.jnd import jnd_unless_smooth
from tactile.skin import Skin

_log = logging.getLogger(__name__)

MOST_PLACES = 4
"""Most places that the fingers press on."""


def felt_by_fingers(before: Relief, after: Relief, skin: Skin) -> Fingers | None:
    """Roughness of both reliefs to each of a set of fingers.

    Args:
        before, after: the reliefs.
        skin: the finger that the set is about.

    Returns:
        Means over a few places; None if the contact of a finger does not converge.
    """
    felt, counts = [], []
    for relief in (before, after):
        patches = _in_the_middle(relief.surface, skin)
        try:
            felt.append(
                roughness_by_finger(patches.within_reach(relief.heights), skin, patches.size_mm).mean(axis=1)
            )
        except tactile.ContactError as error:
            # Another finger's contact is no reason to lose the result of a run.
            _log.info("no table of other fingers: %s", error)
            return None
        counts.append(patches.count)
    each = tuple(
        Finger(
            name=finger.name,
            young_modulus_mpa=finger.skin.young_modulus_mpa,
            depth_mm=finger.skin.depth_mm,
            initial_roughness=float(first),
            roughness=float(then),
            jnd=jnd_unless_smooth(float(then), float(first)),
        )
        for finger, first, then in zip(fingers(skin), *felt, strict=True)
    )
    jnds = [one.jnd for one in each if one.jnd is not None]
    all_felt = len(jnds) == len(each)
    return Fingers(
        count=len(each),
        places=min(counts),
        jnd_mean=fmean(jnds) if all_felt else None,
        jnd_min=min(jnds) if all_felt else None,
        jnd_max=max(jnds) if all_felt else None,
        jnd_std=pstdev(jnds) if all_felt else None,
        each=each,
    )


def _in_the_middle(surface: Surface, skin: Skin) -> Patches:
    """Patches at the few places of a surface that are nearest to its middle."""
    at = places(surface)
    apart = np.square(at - at.mean(axis=0)).sum(axis=1)
    nearest = np.sort(np.argsort(apart, kind="stable")[:MOST_PLACES])
    return Patches(surface, at[nearest], STEERING_SAMPLES, skin.patch_mm)
