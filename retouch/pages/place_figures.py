"""Figures of the feel over a surface: at each place of the finger, what was wanted and what was reached."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from optimize.verification import verification
from relief.ground.arrays import Array
from relief.ground.formatting import number
from relief.relief import Relief
from retouch.pages import colour_maps, svg
from retouch.pages.rendering import Context
from retouch.pages.templates import html
from tactile.jnd import jnds_apart
from tactile.quantities import ROUGHNESS

LEAST_LIMIT_JND = 0.25
"""Least end of the scale of distances from the target, just-noticeable differences: what is met."""
ROOM = 0.1
"""Least diameter of a disc in units of the width of its map for the disc to bear a number."""
LONG = 2.5
"""Ratio of the sides from which a surface counts as a strip, whose maps lie below one another."""
ACROSS = 0.3
"""Half length of the discs across a strip, in units of its shorter side."""


@dataclass(frozen=True)
class PlaceArrays:
    """Roughness at n places.

    Attributes:
        centres: (n, 2) mm from the top and from the left.
        steered: (n,) whether the descent steered the place.
        original, reached: (n,) roughness.
        goal: (n,) roughness; None if roughness had no target.
    """

    centres: Array
    steered: NDArray[np.bool_]
    original: Array
    reached: Array
    goal: Array | None

    @classmethod
    def of(cls, measured: verification.Places) -> "PlaceArrays":
        """Roughness at all places of a verification."""
        sides, name = measured.sides, ROUGHNESS.name
        counts = [len(side.centres_mm) for side in sides]

        def gathered(each: Iterable[Sequence[Any]]) -> Array:
            return np.concatenate([np.array(values) for values in each])

        return cls(
            gathered(side.centres_mm for side in sides),
            np.repeat([True, False][: len(sides)], counts),
            gathered(side.initial[name] for side in sides),
            gathered(side.verified[name] for side in sides),
            gathered(side.target[name] for side in sides)
            if all(name in one.target for one in sides)
            else None,
        )

    @property
    def off(self) -> Array | None:
        """(n,) just-noticeable differences from the target, NaN at smooth places."""
        return None if self.goal is None else jnds_apart(self.reached, self.goal)


@dataclass(frozen=True)
class Extremes:
    """Least, mean and largest difference over the places, and the middle of the place that has the largest.

    Attributes:
        least, mean, largest: just-noticeable differences as text.
        right, down: mm from the left and the top, as text.
    """

    least: str
    mean: str
    largest: str
    right: str
    down: str


@dataclass(frozen=True)
class PlaceFigures:
    """Maps of the feel over a surface, and their words.

    Attributes:
        maps: of the values at the places, over the shaded relief.
        strip: whether the surface is one.
        repeats: whether it is a tile.
        varied: whether the targets vary over it.
        line: the roughness along a strip; None of other surfaces.
        steered, between: number of places of the descent, and between them.
        change, off: change from the original, and distance from the target; None where unknown.
    """

    maps: Markup
    strip: bool
    repeats: bool
    varied: bool
    line: Markup | None
    steered: int
    between: int
    change: Extremes | None
    off: Extremes | None


def place_figures(measured: verification.Places | None, result: Relief) -> PlaceFigures | None:
    """Maps of the feel over the surface and their words; None if there is one place in all.

    Args:
        measured: the feel at the places of a verification.
        result: the relief that was pressed.
    """
    if measured is None or measured.count < 2:
        return None
    places = PlaceArrays.of(measured)
    board = _Board.of(result, places)
    change, off = jnds_apart(places.reached, places.original), places.off
    maps = []
    if not measured.varied and np.isfinite(change).any():
        maps.append(
            board.signed("Change from the original", change, "JND from the original; orange: rougher")
        )
    elif measured.varied:
        assert places.goal is not None
        ends = _ends(places.original, places.goal, places.reached)
        each = (("Original", places.original), ("Target", places.goal), ("Reached", places.reached))
        maps += [board.map(name, values, ends, "roughness") for name, values in each]
    if off is not None and np.isfinite(off).any():
        maps.append(board.signed("Distance from the target", off, "JND from the target; orange: rougher"))
    return PlaceFigures(
        maps=board.drawn(maps, result),
        strip=max(board.size) > LONG * min(board.size),
        repeats=len(board.shifts) > 1,
        varied=measured.varied,
        line=_line(places),
        steered=int(places.steered.sum()),
        between=int((~places.steered).sum()),
        change=_extremes(places, change),
        off=None if off is None else _extremes(places, np.abs(off)),
    )


@dataclass(frozen=True)
class _Board:
    """Drawing of values as discs over the shaded relief.

    Attributes:
        places: of the discs.
        size: height and width of the surface, mm.
        shifts: (s, 2) mm by which a disc is drawn again where the surface repeats.
        radii: of a disc down and to the right, mm; along a strip, discs are stretched across it.
    """

    places: PlaceArrays
    size: svg.Range
    shifts: Array
    radii: svg.Range

    @classmethod
    def of(cls, result: Relief, places: PlaceArrays) -> "_Board":
        surface = result.surface
        down, right = (
            (-size, 0.0, size) if repeats else (0.0,)
            for repeats, size in zip(surface.repeats, surface.size_mm, strict=True)
        )
        shifts = np.array([(y, x) for y in down for x in right])
        around = (places.centres[:, None, None] + shifts - places.centres[:, None]).reshape(-1, 2)
        distances = np.hypot(*around.T)
        radius = 0.46 * float(distances[distances > 1e-9].min())
        line = _along(places)
        across = max(radius, ACROSS * min(surface.size_mm))
        radii = (across if line == 1 else radius, across if line == 0 else radius)
        return cls(places, surface.size_mm, shifts, radii)

    def signed(self, name: str, values: Array, legend: str) -> Context:
        """A map of JND of either sign."""
        finite = values[np.isfinite(values)]
        limit = max(float(np.abs(finite).max(initial=0.0)), LEAST_LIMIT_JND)
        limit = svg.round_up(limit) if limit > LEAST_LIMIT_JND else limit
        texts = [_signed(value) for value in values]
        return self._map(name, values, svg.signed_axis(limit), colour_maps.PURPLE_ORANGE, texts, legend)

    def map(self, name: str, values: Array, ends: svg.Range, legend: str) -> Context:
        """A map of positive values."""
        axis = svg.nice_axis(*ends, 4, tight=True)
        return self._map(name, values, axis, colour_maps.VIRIDIS, [number(v, 2) for v in values], legend)

    def _map(
        self,
        name: str,
        values: Array,
        axis: svg.ChartAxis,
        table: colour_maps.Table,
        texts: list[str],
        legend: str,
    ) -> Context:
        places, discs = self.places, []
        numbered = 2.0 * min(self.radii) > ROOM * self.size[1]
        for centre, steered, value, text in zip(places.centres, places.steered, values, texts, strict=True):
            colour, known = colour_maps.NO_VALUE, bool(np.isfinite(value))
            if known:
                colour = tuple(table[round(np.clip(axis.percent(value) / 100.0, 0.0, 1.0) * 255.0)].tolist())
            ink = "#000" if np.dot(colour, (0.299, 0.587, 0.114)) > 140.0 else "#fff"
            disc = {
                "steered": steered,
                "colour": colour,
                "ink": ink,
                "text": text if numbered and known else "",
            }
            at = centre + self.shifts
            seen = ((at > -self.margin) & (at < np.array(self.size) + self.margin)).all(axis=1)
            discs += [disc | {"y": y, "x": x} for y, x in at[seen]]
        return {"name": name, "discs": discs, "bar": svg.colour_bar(table, axis, legend)}

    def drawn(self, maps: list[Context], result: Relief) -> Markup:
        """Maps over the shaded relief, with a margin that shows how a surface goes on where it repeats."""
        down, right = self.margin
        height, width = self.size
        return html(
            "place_maps.html.j2",
            maps=maps,
            relief=colour_maps.shade_uri(result.heights, width),
            height=height,
            width=width,
            view=(-right, -down, width + 2.0 * right, height + 2.0 * down),
            shifts=self.shifts,
            tall=self.radii[0],
            wide=self.radii[1],
        )

    @property
    def margin(self) -> Array:
        """Rows and columns of mm beyond the period that show how a surface goes on, 0 where it ends."""
        return 1.15 * np.array(self.radii) * (np.abs(self.shifts).max(axis=0) > 0.0)


def _along(places: PlaceArrays) -> int | None:
    """The axis along which all places lie in one line, 0 down and 1 to the right; None if they do not."""
    spread = np.ptp(places.centres, axis=0)
    return int(np.argmax(spread)) if spread.min() < 1e-6 else None


def _line(places: PlaceArrays) -> Markup | None:
    """Roughness along a surface whose places lie in one line; None for other surfaces."""
    along = _along(places)
    if along is None:
        return None
    order = np.argsort(places.centres[:, along])
    x = places.centres[order, along].tolist()
    lines = [(places.original, "before"), (places.goal, "second"), (places.reached, "after")]
    return svg.line_chart(
        "Roughness along the surface",
        [svg.Series("", x, values[order].tolist(), style) for values, style in lines if values is not None],
        f"finger's middle, mm from the {('top', 'left')[along]}",
    )


def _signed(jnd: float) -> str:
    return f"{round(jnd, 2) + 0.0:+.2f}".replace("-", "\N{MINUS SIGN}")


def _ends(*values: Array) -> svg.Range:
    """The least and the largest of all values."""
    return min(float(each.min()) for each in values), max(float(each.max()) for each in values)


def _extremes(places: PlaceArrays, jnd: Array) -> Extremes | None:
    """Least, mean and largest difference, and where it is largest; None where all places are smooth."""
    if not np.isfinite(jnd).any():
        return None
    down, right = places.centres[int(np.nanargmax(jnd))]
    return Extremes(
        least=_signed(float(np.nanmin(jnd))),
        mean=_signed(float(np.nanmean(jnd))),
        largest=_signed(float(np.nanmax(jnd))),
        right=f"{right:.3g}",
        down=f"{down:.3g}",
    )
