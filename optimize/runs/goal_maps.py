"""Goals that vary over a surface: maps, regions, and roughness along an axis, and what they ask at a place.

A finger feels what lies under all of its patch, and roughness is a mean over pairs of receptors anywhere on
the patch. So the goal at a place is the mean of the map over the patch there: steps of a map become ramps as
wide as the patch, which is as sharp as a feel can change. A region counts by its shares, whose mean under a
finger is the part of the way from the original's value to the goal, in the quantity itself. A patch that is
half white and half black therefore asks for what an even grey of 0.5 asks for.
"""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optimize.descent.targets import Targets
from optimize.runs.goal_bounds import nearest_goals
from optimize.settings.touch import Region, Touch, Varied
from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError, naming
from relief.ground.limits import PATCH_SIDE_MM
from relief.maps import load_map, means_under
from relief.places import centres_mm, patch_shape, places
from relief.surface import Surface
from tactile.quantities import QUANTITIES, GoalKey, Quantity, Values

_log = logging.getLogger(__name__)

WHITE = 0.5
"""Value of a mask above which a point lies in the region, unless the region is graded."""
GREY_STEP = 1.0 / 255.0
"""Step of 8-bit grey: by so much may the share of each graded region be rounded up at a point."""
ROUNDING = 1e-9
"""Rounding error of a sum of shares."""
FELT_SHARE = 0.5
"""A warning names the mixture that is felt where no finger has at least this share of its patch in a
region. Of a graded region it is a part of the greatest share of its mask."""


@dataclass(frozen=True, eq=False)
class GoalPart:
    """A part of the surface and its goal.

    Attributes:
        key: of the goal.
        shares: (rows, cols) of the way from the original's value to the goal: 1 in the part and 0 outside, or
            between the two where the part is graded.
        number: for the key, or (rows, cols) numbers.
    """

    key: GoalKey
    shares: Array
    number: Array | float


@dataclass(frozen=True, eq=False)
class GoalMap:
    """The goal of a quantity over a surface; outside of all parts, the original's own value.

    Attributes:
        name: of the key of `[touch]` that states the goal.
    """

    name: str
    quantity: Quantity
    surface: Surface
    parts: tuple[GoalPart, ...]

    def goals(self, at: Index, original: Array) -> Array:
        """(k,) goals at places (k, 2), by the original's own values (k,) there."""
        goals = original.copy()
        for part in self.parts:
            share = means_under(part.shares, self.surface, at)
            numbers = means_under(part.shares * part.number, self.surface, at)
            numbers = numbers / np.where(share > 0.0, share, 1.0)
            wanted = [part.key.goal(*each) for each in zip(numbers, original, strict=True)]
            goals += share * (np.array(wanted) - original)
        return goals

    def words(self, spacing_mm: float) -> str:
        """The goals over the lattice of places, as `retouch optimize --dry-run` prints them."""
        at = places(self.surface, spacing_mm)
        if self.name == "region":
            parts = "one region" if len(self.parts) == 1 else f"{len(self.parts)} regions"
            return f"{self.quantity.label} in {parts}, {len(at)} places in all"
        goals = self.goals(at, np.zeros(len(at)))
        ends = f"{self.quantity.text(goals.min())} to {self.quantity.text(goals.max())}"
        return f"{self.quantity.label} {ends} over {len(at)} places"

    def check(self, at: Index, original: Array) -> None:
        """Raise InputError for a goal out of reach of its place; the line names the nearest in reach."""
        goals = self.goals(at, original)
        side_mm = patch_shape(self.surface)[0] * self.surface.pitch_mm
        nearest = nearest_goals(self.quantity, goals, original, side_mm)
        if (far := np.flatnonzero(nearest != goals)).size:
            one, text = far[0], self.quantity.text
            down, right = centres_mm(self.surface, at)[one]
            raise InputError(
                f"touch.{self.name}: {right:.4g} mm from the left and {down:.4g} mm from the top, "
                f"{self.quantity.label} {text(goals[one])} is out of reach of the original's "
                f"{text(original[one])}; the nearest is {text(nearest[one])}"
            )


@dataclass(frozen=True, eq=False)
class RunGoals:
    """What a run is to reach anywhere on its surface.

    Attributes:
        targets: with the goals at the steered places.
        original: the original's own values there.
        maps: of the goals that vary over the surface.
    """

    targets: Targets
    original: Values
    maps: tuple[GoalMap, ...] = ()

    def at(self, points: Index, original: Values) -> dict[str, Array]:
        """(k,) goals of each targeted quantity at any places (k, 2), by the original's own values there."""
        maps = {varied.quantity.name: varied for varied in self.maps}
        goals = {}
        for target in self.targets.each:
            name = target.quantity.name
            if name in maps:
                goals[name] = maps[name].goals(points, original[name])
            else:
                # A number asks for the same factor on the original's value everywhere.
                own = self.original[name].mean()
                same = np.full(len(points), target.mean_goal)
                goals[name] = original[name] * (target.mean_goal / own) if own > 0.0 else same
        return goals


def goal_maps(touch: Touch, surface: Surface, at: Index) -> tuple[GoalMap, ...]:
    """The goals of `[touch]` that vary over the surface; their files are read and checked.

    Args:
        touch: the section of the run.
        surface: to be touched.
        at: (k, 2) places where fingers land.

    Raises:
        InputError: a file is damaged or has other proportions than the surface, a region is empty, overlaps
            another or has shares beyond 0 and 1, or the surface has no length for a gradient.
    """
    maps = []
    for varied in touch.varied():
        if varied.file is not None:
            values = _mapped(varied, varied.file, surface)
            maps.append(_of_everywhere(varied.quantity, varied.keys.file, surface, values))
        if varied.first is not None and varied.last is not None:
            with naming(f"touch.{varied.keys.first}"):
                values = _along(touch.axis or "x", varied.first, varied.last, surface)
            maps.append(_of_everywhere(varied.quantity, varied.keys.first, surface, values))
    return (*maps, *_regions(touch, surface, at))


def _of_everywhere(quantity: Quantity, name: str, surface: Surface, values: Array) -> GoalMap:
    return GoalMap(name, quantity, surface, (GoalPart(quantity.goals[0], np.ones(surface.shape), values),))


def _mapped(varied: Varied, file: Path, surface: Surface) -> Array:
    """(rows, cols) values of a map. Raises InputError."""
    keys, ends = varied.keys, varied.ends
    with naming(f"touch.{keys.file}"):
        values, grey = load_map(file, surface)
    if grey:
        if ends is None:
            raise InputError(f"touch.{keys.ends}: missing; a picture needs that of black and of white")
        black, white = ends
        return black + (white - black) * values
    if ends is not None:
        raise InputError(f"touch.{keys.ends}: is for pictures; {file} holds {varied.quantity.label}")
    if values.min() <= 0.0:
        raise InputError(f"touch.{keys.file}: {file}: {values.min():g} is not above 0")
    return values


def _along(axis: str, first: float, last: float, surface: Surface) -> Array:
    """(rows, cols) values in proportion to the way along an axis; `first` and `last` are patches' means.

    Raises:
        InputError: there is only one place along the axis, or the axis repeats.
    """
    along = 0 if axis == "y" else 1
    length = surface.shape[along] - patch_shape(surface)[along]
    if surface.repeats[along]:
        raise InputError(f"along {axis}, the surface repeats, which leaves no ends")
    if length == 0:
        raise InputError(
            f"along {axis}, the surface is {surface.size_mm[along]:g} mm long; "
            f"a finger of {PATCH_SIDE_MM:g} mm has no way to go"
        )
    centres = np.arange(surface.shape[along]) + 0.5 - 0.5 * patch_shape(surface)[along]
    line = first + (last - first) * (centres / length)
    return np.broadcast_to(line[:, None] if along == 0 else line, surface.shape)


def _regions(touch: Touch, surface: Surface, at: Index) -> tuple[GoalMap, ...]:
    """One goal map for each quantity that regions state. Raises InputError."""
    if not touch.region:
        return ()
    covered = _CoveredSurface(surface.shape)
    shares = []
    for number, region in enumerate(touch.region):
        with naming(f"touch.region.{number}.mask"):
            shares.append(_shares(region, surface))
            covered.add(number, region, shares[-1])
        _warn_of_mixture(number, region, shares[-1], means_under(shares[-1], surface, at))
    # Shares whose sum exceeds 1 by rounding alone: a goal lies between those of its regions, not beyond them.
    whole = np.maximum(covered.total, 1.0)
    parts: dict[str, list[GoalPart]] = {}
    for region, each in zip(touch.region, shares, strict=True):
        for quantity, key, value in region.goals():
            parts.setdefault(quantity.name, []).append(GoalPart(key, each / whole, value))
    return tuple(GoalMap("region", QUANTITIES[name], surface, tuple(each)) for name, each in parts.items())


def _shares(region: Region, surface: Surface) -> Array:
    """(rows, cols) shares of a region: 0 or 1, or those of its mask if it is graded. Raises InputError."""
    values, _ = load_map(region.mask, surface)
    if region.graded and (values.min() < 0.0 or values.max() > 1.0):
        raise InputError(
            f"{region.mask}: values {values.min():g} to {values.max():g}; those of a graded region "
            "are shares from 0 to 1"
        )
    shares = values if region.graded else (values > WHITE).astype(np.float64)
    if not shares.any():
        light = "brighter than black" if region.graded else "white"
        raise InputError(f"{region.mask}: the region is empty; a mask is {light} in its region")
    return shares


class _CoveredSurface:
    """What the regions so far take of a surface.

    Attributes:
        total: (rows, cols) sum of their shares.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.total = np.zeros(shape)
        self._greatest = np.zeros(shape)
        self._owner = np.full(shape, -1)
        """Number of the region with the greatest share."""
        self._rounded = np.zeros(shape, dtype=np.int64)
        """Number of regions whose share is grey, and may be rounded; black and white are exact."""

    def add(self, number: int, region: Region, shares: Array) -> None:
        """Take a region in. Raises InputError if there is no room beside another."""
        total, rounded = self.total + shares, self._rounded + ((shares > 0.0) & (shares < 1.0))
        over = (shares > 0.0) & (total > 1.0 + GREY_STEP * rounded + ROUNDING)
        if over.any():
            other, percent = self._owner[over].max(), 100.0 * np.count_nonzero(over) / over.size
            why = f", where shares sum to {total[over].max():.3g}" if rounded[over].any() else ""
            raise InputError(f"{region.mask}: overlaps region {other} on {percent:.2g} % of the surface{why}")
        self.total, self._rounded = total, rounded
        self._owner[shares > self._greatest] = number
        self._greatest = np.maximum(self._greatest, shares)


def _warn_of_mixture(number: int, region: Region, shares: Array, felt: Array) -> None:
    """Log a warning if no finger feels much of a region.

    Args:
        number: of the region.
        region: in `[touch]`.
        shares: (rows, cols) of the region.
        felt: (k,) their means under the fingers.
    """
    most, greatest = float(felt.max()), float(shares.max())
    # In the greatest share, which is 1 unless the region is graded: an even grey is felt as it is painted,
    # however dark. A dab smaller than a finger is not, however bright.
    if most >= FELT_SHARE * greatest:
        return
    share = f"{100.0 * most:.0f} % of what lies under a finger of {PATCH_SIDE_MM:g} mm"
    if region.graded:
        share = f"{100.0 * most:.3g} % of the way to its goal under a finger of {PATCH_SIDE_MM:g} mm, "
        share += f"where the mask has up to {100.0 * greatest:.3g} %"
    _log.warning("touch.region.%d: at most %s; it feels a mixture", number, share)
