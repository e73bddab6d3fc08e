"""Roughness of a result against the original's over the places of the finger."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from optimize.verification.verification import Places, PlaceValues, Spread
from relief.ground.arrays import Array, Index
from relief.places import centres_mm
from relief.surface import Surface
from tactile.jnd import jnd_unless_smooth, jnds_apart
from tactile.measures import TouchMeasures
from tactile.quantities import ROUGHNESS

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
        return jnds_apart(self.after.values[ROUGHNESS.name][: len(goals)], goals)

    @property
    def mean_jnd(self) -> float | None:
        """Just-noticeable differences between the means over the places; None if one relief is smooth."""
        return jnd_unless_smooth(*(each.means[ROUGHNESS.name] for each in (self.after, self.before)))

    @property
    def jnd(self) -> Array:
        """(k,) just-noticeable differences; NaN at places that are smooth."""
        return jnds_apart(self.after.values[ROUGHNESS.name], self.before.values[ROUGHNESS.name])


def place_spread(before: TouchMeasures, after: TouchMeasures) -> Spread | None:
    """Just-noticeable differences over places; None for one place, or for other numbers of places."""
    one, other = (touch.values[ROUGHNESS.name] for touch in (before, after))
    return _spread(jnds_apart(other, one)) if 1 < len(one) == len(other) else None


def sampled(places: Index) -> Index:
    """At most `MOST_BETWEEN` of the places, evenly taken."""
    if len(places) <= MOST_BETWEEN:
        return places
    return places[np.linspace(0, len(places) - 1, MOST_BETWEEN).round().astype(np.int64)]


def place_numbers(surface: Surface, steered: FeltPlaces, between: FeltPlaces | None) -> Places:
    """Feel over a surface.

    Args:
        surface: of the relief.
        steered: places of the descent.
        between: places between them; None if there are none.
    """
    sides = [steered] if between is None else [steered, between]
    off = np.abs(np.concatenate([side.off for side in sides]))
    places = Places(
        **_spread(np.concatenate([side.jnd for side in sides])).as_json(),
        farthest_from_target_jnd=float(np.nanmax(off)) if np.isfinite(off).any() else None,
        steered=_values(surface, steered),
    )
    return places if between is None else places.model_copy(update={"between": _values(surface, between)})


def _spread(jnd: Array) -> Spread:
    felt = jnd[np.isfinite(jnd)]
    mean, least, most = map(float, (felt.mean(), felt.min(), felt.max())) if felt.size else (None,) * 3
    return Spread(count=len(jnd), jnd_mean=mean, jnd_min=least, jnd_max=most)


def _values(surface: Surface, side: FeltPlaces) -> PlaceValues:
    """Centre, values and goals of every place."""
    initial, verified, target = (
        {name: tuple(each.tolist()) for name, each in values.items()}
        for values in (side.before.values, side.after.values, side.goals)
    )
    centres = tuple((down, right) for down, right in centres_mm(surface, side.places).tolist())
    return PlaceValues(
        **_spread(side.jnd).as_json(), centres_mm=centres, initial=initial, verified=verified, target=target
    )
