"""Figures of the feel over a surface: at each place of the finger, what was wanted and what was reached."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from optimize.verification import verification
from relief.ground.arrays import Array
from relief.ground.formatting import number
from relief.relief import Relief
from retouch.pages import colour_maps, svg
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
SHADE_SIDE = 512
"""Longest side of the shaded relief under the discs, pixels."""


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

    @property
    def off(self) -> Array | None:
        """(n,) just-noticeable differences from the target, NaN at smooth places."""
        return None if self.goal is None else jnds_apart(self.reached, self.goal)


def read_places(measured: verification.Places) -> PlaceArrays:
    """Roughness at all places of a verification."""
    sides, name = measured.sides, ROUGHNESS.name
    centres, original, reached = (
        np.concatenate([np.array(values) for values in each])
        for each in (
            [side.centres_mm for side in sides],
            [side.initial[name] for side in sides],
            [side.verified[name] for side in sides],
        )
    )
    goals = [np.array(side.target[name]) for side in sides if name in side.target]
    return PlaceArrays(
        centres,
        np.repeat([True, False][: len(sides)], [len(side.centres_mm) for side in sides]),
        original,
        reached,
        np.concatenate(goals) if len(goals) == len(sides) else None,
    )


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
        maps: of the values at the places.
        strip: whether the surface is one.
        repeats: whether it is a tile.
        varied: whether the targets vary over it.
        line: the roughness along a strip; None of other surfaces.
        relief: the shaded relief below the discs.
        steered, between: number of places of the descent, and between them.
        change, off: change from the original, and distance from the target; None where unknown.
    """

    maps: list[Markup]
    strip: bool
    repeats: bool
    varied: bool
    line: Markup | None
    relief: Markup
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
    places = read_places(measured)
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
        maps=maps,
        strip=board.strip,
        repeats=len(board.shifts) > 1,
        varied=measured.varied,
        line=_line(places),
        relief=board.relief(result),
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
        width, height: of the surface, mm.
        shifts: (s, 2) mm by which a disc is drawn again where the surface repeats.
        radii: of a disc down and to the right, mm; along a strip, discs are stretched across it.
    """

    places: PlaceArrays
    width: float
    height: float
    shifts: Array
    radii: svg.Range

    @classmethod
    def of(cls, result: Relief, places: PlaceArrays) -> "_Board":
        surface = result.surface
        height, width = surface.size_mm
        down, right = (
            (-size, 0.0, size) if repeats else (0.0,)
            for repeats, size in zip(surface.repeats, surface.size_mm, strict=True)
        )
        shifts = np.array([(y, x) for y in down for x in right])
        around = (places.centres[:, None, None] + shifts - places.centres[:, None]).reshape(-1, 2)
        distances = np.hypot(*around.T)
        radius = 0.46 * float(distances[distances > 1e-9].min())
        line = _along(places)
        across = max(radius, ACROSS * min(width, height))
        radii = (across if line == 1 else radius, across if line == 0 else radius)
        return cls(places, width, height, shifts, radii)

    @property
    def strip(self) -> bool:
        """Whether the surface is much longer than wide."""
        return max(self.width, self.height) > LONG * min(self.width, self.height)

    def signed(self, name: str, values: Array, legend: str) -> Markup:
        """A map of JND of either sign."""
        finite = values[np.isfinite(values)]
        limit = max(float(np.abs(finite).max(initial=0.0)), LEAST_LIMIT_JND)
        limit = svg.round_up(limit) if limit > LEAST_LIMIT_JND else limit
        axis = svg.signed_axis(limit)
        texts = [_signed(value) for value in values]
        return self._figure(name, values, axis, colour_maps.PURPLE_ORANGE, texts, legend)

    def map(self, name: str, values: Array, ends: svg.Range, legend: str) -> Markup:
        """A map of positive values."""
        axis = svg.nice_axis(*ends, 4, tight=True)
        return self._figure(name, values, axis, colour_maps.VIRIDIS, [number(v, 2) for v in values], legend)

    def _figure(
        self,
        name: str,
        values: Array,
        axis: svg.ChartAxis,
        table: colour_maps.Table,
        texts: list[str],
        legend: str,
    ) -> Markup:
        tall, wide = self.radii
        numbered = 2.0 * min(self.radii) > ROOM * self.width
        down, right = self.margin
        discs = []
        for centre, steered, value, text in zip(
            self.places.centres, self.places.steered, values, texts, strict=True
        ):
            index = np.clip(axis.percent(value) / 100.0, 0.0, 1.0) * 255.0 if np.isfinite(value) else None
            colour = colour_maps.NO_CONTACT if index is None else tuple(table[round(index)].tolist())
            ink = "#000" if np.dot(colour, (0.299, 0.587, 0.114)) > 140.0 else "#fff"
            for y, x in centre + self.shifts:
                if not (-down < y < self.height + down and -right < x < self.width + right):
                    continue
                discs.append(
                    Markup(
                        '<ellipse class="{}" cx="{:.3f}" cy="{:.3f}" rx="{:.3f}" ry="{:.3f}" fill="rgb{}"/>'
                    ).format("steered" if steered else "between", x, y, wide, tall, colour)
                )
                if numbered and index is not None:
                    discs.append(
                        Markup('<text x="{:.3f}" y="{:.3f}" font-size="{:.3f}" fill="{}">{}</text>').format(
                            x, y, 0.56 * tall, ink, text
                        )
                    )
        period = Markup('<rect width="{:.4f}" height="{:.4f}"/>').format(self.width, self.height)
        return Markup(
            '<figure class="places"><figcaption class="name">{0}</figcaption>'
            '<svg viewBox="{1:.4f} {2:.4f} {3:.4f} {4:.4f}" role="img" aria-label="{0}">{5}{6}</svg>'
            '<div class="legend">{7}</div></figure>'
        ).format(
            name,
            -right,
            -down,
            self.width + 2.0 * right,
            self.height + 2.0 * down,
            self._relief() + (period if len(self.shifts) > 1 else ""),
            Markup("").join(discs),
            svg.colour_bar(table, axis, legend),
        )

    def relief(self, result: Relief) -> Markup:
        """The shaded relief as a definition for the maps."""
        shade = colour_maps.hillshade(result.heights, self.width)
        return Markup(
            '<image id="places-relief" width="{:.4f}" height="{:.4f}" preserveAspectRatio="none" href="{}"/>'
        ).format(self.width, self.height, colour_maps.picture_uri(shade, 1.4, SHADE_SIDE))

    @property
    def margin(self) -> svg.Range:
        """Rows and columns of mm beyond the period that show how a surface goes on, 0 where it ends."""
        reach = np.abs(self.shifts).max(axis=0)
        return tuple((1.15 * np.array(self.radii) * (reach > 0.0)).tolist())

    def _relief(self) -> Markup:
        """The shaded relief, which the page defines once, at each shift."""
        return Markup("").join(
            Markup('<use href="#places-relief" x="{:.4f}" y="{:.4f}"/>').format(x, y) for y, x in self.shifts
        )


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
