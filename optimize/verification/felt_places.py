"""Roughness of a result against the original's over the places of the finger, for result.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from relief.common.arrays import Array, Index
from relief.places import centres_mm
from relief.surface import Surface
from tactile.jnd import ROUGHNESS_JND
from tactile.measures import TouchMeasures
from tactile.quantities import FLAT_SHARE, ROUGHNESS

MOST_BETWEEN = 64
"""Most places between the steered ones that are pressed; of more, as many are taken evenly."""


@dataclass(frozen=True)
class FeltPlaces:
    """Original and result at some places, by one model of touch.

    Attributes:
        places: (k, 2) as in `relief.places`.
        before, after: touch of original and result.
        goals: (k,) goals by the names of their quantities; none for a quantity without a target.
    """

    places: Index
    before: TouchMeasures
    after: TouchMeasures
    goals: Mapping[str, Array] = field(default_factory=dict)

    @property
    def off(self) -> Array:
        """(k,) just-noticeable differences of the result from its goals; none without a goal of roughness."""
        goals = self.goals.get(ROUGHNESS.name, np.zeros(0))
        return jnd_at(self.after.values[ROUGHNESS.name][: len(goals)], goals)

    @property
    def jnd(self) -> Array:
        """(k,) just-noticeable differences; NaN at places that are flat."""
        return jnd_at(self.after.values[ROUGHNESS.name], self.before.values[ROUGHNESS.name])


def jnd_at(values: Array, reference: Array) -> Array:
    """(k,) just-noticeable differences; NaN where the reference is flat."""
    least = FLAT_SHARE * reference.mean() if reference.size else 0.0
    felt = (reference > least) & (values > 0.0)
    ratio = np.divide(values, reference, out=np.full(len(values), np.nan), where=felt)
    return np.asarray(np.log(ratio) / np.log(ROUGHNESS_JND))


def place_spread(before: TouchMeasures, after: TouchMeasures) -> dict[str, Any] | None:
    """Count, mean, least and largest JND over places; None for one place, or for other numbers of places."""
    one, other = (touch.values[ROUGHNESS.name] for touch in (before, after))
    return _spread(jnd_at(other, one)) if 1 < len(one) == len(other) else None


def sampled(places: Index) -> Index:
    """At most `MOST_BETWEEN` of the places, evenly taken."""
    if len(places) <= MOST_BETWEEN:
        return places
    return places[np.linspace(0, len(places) - 1, MOST_BETWEEN).round().astype(np.int64)]


def place_numbers(surface: Surface, steered: FeltPlaces, between: FeltPlaces | None) -> dict[str, Any]:
    """The section `touch.places` of result.json.

    Args:
        surface: of the relief.
        steered: places of the descent.
        between: places between them; None if there are none.

    Returns:
        Count, mean, least and largest JND over all places, and the largest distance of a place from its goal
        of roughness, JND. Of the steered places, and of those between them: the same four numbers, and for
        each place its centre (mm from the first row's and first column's edge), its values and its goals.
    """
    sides = {"steered": steered} | ({} if between is None else {"between": between})
    off = np.abs(np.concatenate([side.off for side in sides.values()]))
    return {
        **_spread(np.concatenate([side.jnd for side in sides.values()])),
        "farthest_from_target_jnd": float(np.nanmax(off)) if np.isfinite(off).any() else None,
        **{name: {**_spread(side.jnd), **_listed(surface, side)} for name, side in sides.items()},
    }


def _spread(jnd: Array) -> dict[str, Any]:
    felt = jnd[np.isfinite(jnd)]
    numbers: Mapping[str, Any] = {"jnd_mean": np.mean, "jnd_min": np.min, "jnd_max": np.max}
    return {
        "count": len(jnd),
        **{name: float(of(felt)) if felt.size else None for name, of in numbers.items()},
    }


def _listed(surface: Surface, side: FeltPlaces) -> dict[str, Any]:
    """Centre, values and goals of every place."""
    numbers = (("initial", side.before.values), ("verified", side.after.values), ("target", side.goals))
    values = {f"{when}_{name}": each.tolist() for when, of in numbers for name, each in of.items()}
    return {"centres_mm": centres_mm(surface, side.places).tolist(), **values}
