"""How heights feel, and what a run would take."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import retouch
from mitsuba_scenes import DEFAULT_SCENE, find_texture
from optimize.settings.fast_models import FAST_MODELS
from relief.ground.arrays import Index
from relief.ground.errors import InputError
from relief.places import places
from relief.relief import Relief
from retouch.app.computing.warnings_kept import kept_warnings, warning_lines
from retouch.app.values.document import FeelChoice
from retouch.app.values.findings import CONTACT, Lines
from tactile.quantities import QUANTITIES, Quantity, Values

if TYPE_CHECKING:
    from tactile.model import ModelName
    from tactile.skin import Skin

MODEL: "ModelName" = "quick"
"""Model of touch of the numbers that follow the hand: within 1 % of the exact one (docs/howto/surrogates.md),
and on 16 places of 128 x 128 samples in 0.8 s in place of 2.3 s."""
QUICK = tuple(replace(one, value=one.step_value or one.value) for one in QUANTITIES.values())
"""The quantities as steps of a descent take them: V by the thinned sum, within 0.02 % of the full one in a
quarter of its time at one place."""
MEASURED = (*QUICK, Quantity(CONTACT, CONTACT, "", "", 2, lambda touch: touch.contact_fraction))
"""What is measured at each place."""


def felt(relief: Relief, skin: str, at: Index) -> Values:
    """What a finger feels at places (k, 2) of a relief: (k,) of each quantity by name, and of `CONTACT`.

    Only these numbers go through the pipe: the `TouchMeasures` that they come from hold maps of the skin,
    many MB for a large tile, and the class loads torch, for 4 s.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    return touch(relief, retouch.load_skin(skin), at).values


def texture_roughness(name: str, skin: str) -> float:
    """Roughness of a texture that comes with Retouch, at one place."""
    relief = Relief.read(find_texture(name))
    return float(touch(relief, retouch.load_skin(skin), middle(relief)).means["roughness"])


def forecast(heights: str, feel: FeelChoice, out: str) -> Lines:
    """What `retouch optimize --dry-run` reports of a run: a word and a sentence each, and its warnings.

    Raises:
        InputError: what is wrong, in a line.
    """
    with kept_warnings() as warnings:
        shared = FAST_MODELS if feel.fast else ()
        run = retouch.run_from_scene(DEFAULT_SCENE, heights, feel.overrides(), shared=shared)
        run.check_texture()
        lines = tuple(retouch.forecast(run, out).lines())
    return lines + warning_lines(warnings)


def middle(relief: Relief) -> Index:
    """(1, 2) the place nearest to the middle of the relief."""
    each = places(relief.surface)
    return each[len(each) // 2][None]


def touch(relief: Relief, skin: "Skin", at: Index | None) -> Any:
    """What a finger feels at places (k, 2) of a relief, by the model of the numbers that follow the hand.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    from tactile.measures import measure_touch

    if not np.isfinite(relief.heights).all():
        raise InputError("heights: not every value is finite")
    return measure_touch(relief, skin, MODEL, quantities=MEASURED, at=at)
