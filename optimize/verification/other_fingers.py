"""How a change feels to other fingers: softer and stiffer skin, other receptors, and a measured one."""

import logging
from statistics import fmean, pstdev

import numpy as np
import torch

import tactile
from optimize.settings.skins import load_skin
from optimize.verification.verification import FingerChange, Fingers, Measured
from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.ground.threads import one_torch_thread
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
MEASURED, MOST_MEASURED = "measured", 8
"""Name of the skin of the measured finger, and most places that it presses on."""


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
        patches = in_the_middle(relief.surface, skin)
        try:
            felt.append(
                roughness_by_finger(patches.within_reach(relief.heights), skin, patches.size_mm).mean(axis=1)
            )
        except (tactile.ContactError, InputError) as error:
            # Another finger's contact is no reason to lose the result of a run.
            _log.info("no table of other fingers: %s", error)
            return None
        counts.append(patches.count)
    each = tuple(
        FingerChange(
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
    if each[0].jnd is None:
        # What is smooth to the finger itself was judged by nobody, whatever V it has for others.
        each = tuple(one.model_copy(update={"jnd": None}) for one in each)
    return Fingers(
        count=len(each),
        places=min(counts),
        jnd_mean=fmean(jnds) if all_felt else None,
        jnd_min=min(jnds) if all_felt else None,
        jnd_max=max(jnds) if all_felt else None,
        jnd_std=pstdev(jnds) if all_felt else None,
        each=each,
    )


def felt_by_measured(before: Relief, after: Relief, at: Index, smooth: bool = False) -> Measured | None:
    """Roughness of both reliefs to the measured finger, by finite elements.

    The layer alone would be 0.2 to 0.3 just-noticeable differences off; the elements come with Retouch.

    Args:
        before, after: the reliefs, of one surface.
        at: (k, 2) places where a finger presses; some of them, spread evenly, are pressed.
        smooth: whether a relief is smooth to the finger that counts, so that nobody judged it.

    Returns:
        None if a contact does not converge, or pairs of receptors do not fit on the plate.
    """
    skin = load_skin(MEASURED)
    spread = np.linspace(0, len(at) - 1, min(len(at), MOST_MEASURED)).round().astype(int)
    patches = Patches(before.surface, at[spread], STEERING_SAMPLES, skin.patch_mm)
    try:
        with stage("pressing with a measured finger"):
            model = tactile.touch_model(skin, patches.samples, patches.size_mm, model="fem")
            each = [_roughness(model, patches.within_reach(relief.heights)) for relief in (before, after)]
    except (tactile.ContactError, InputError) as error:
        # Another finger's contact is no reason to lose the result of a run.
        _log.info("nothing to a measured finger: %s", error)
        return None
    jnds = [jnd_unless_smooth(then, first) for first, then in zip(*each, strict=True)]
    known = [jnd for jnd in jnds if jnd is not None]
    ends = {"jnd_min": min(known), "jnd_max": max(known)} if len(known) == len(jnds) and not smooth else {}
    first, then = (fmean(of_relief) for of_relief in each)
    return Measured(
        skin=MEASURED,
        force_n=skin.force_n,
        count=len(spread),
        initial_roughness=first,
        roughness=then,
        jnd_mean=jnd_unless_smooth(then, first) if ends else None,
        **ends,
    )


@one_torch_thread()
def _roughness(model: tactile.TouchModel, fields: Array) -> list[float]:
    """V of patches (k, n, n), mm."""
    touch = model.press(torch.as_tensor(fields))
    return [float(value) for value in tactile.roughness(touch, quadrature="thinned")]


def in_the_middle(surface: Surface, skin: Skin) -> Patches:
    """Patches at the few places of a surface that are nearest to its middle."""
    at = places(surface)
    apart = np.square(at - at.mean(axis=0)).sum(axis=1)
    nearest = np.sort(np.argsort(apart, kind="stable")[:MOST_PLACES])
    return Patches(surface, at[nearest], STEERING_SAMPLES, skin.patch_mm)
