"""Numbers and page of a palette: fills as verified, how far apart they are, and how often they are named."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optimize.run_directory.key import REPORT
from relief.ground.arrays import Array
from relief.relief import Relief
from retouch.laboratory.palettes.making import Fill, least_apart
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.page import shade, spot
from retouch.pages.plate_viewer.figure import SPOT_SAMPLES
from retouch.pages.rendering import render_page
from tactile.jnd import ROUGHNESS_JND, tries_of_100
from tactile.quantities import LIMIT_PERCENT

DIRECTED = 0.3
"""Least share of a direction (0: all alike, 1: parallel ridges) at which a fill has one."""


@dataclass(frozen=True)
class FillNumbers:
    """A fill in numbers.

    Attributes:
        label: name of the texture, and number of the fill from the smoothest on.
        level: JND from the texture as found, as optimised for.
        roughness: V to each finger; what is smooth counts as the least that people have judged.
        jnd: from the smoothest fill, to each finger.
        picture_change_percent_of_white: from the texture as found.
        spacing_mm: wavelength that holds most of the heights' variance.
        direction_degrees: of its ridges, from the x axis towards the y axis; None if they have none.
        named_percent: how often the fill is named rightly at most, when felt alone by the first finger.
        folder, tile: run directory and tile, within the folder of the palette.
    """

    label: str
    level: float
    roughness: Sequence[float]
    jnd: Sequence[float]
    picture_change_percent_of_white: float
    spacing_mm: float
    direction_degrees: float | None
    named_percent: float
    folder: str
    tile: str


@dataclass(frozen=True)
class PaletteNumbers:
    """The content of `palette.json`.

    Attributes:
        apart: JND that were asked for between any two fills.
        fingers: their names; the first is the one that was given.
        fills: from the smoothest to the roughest.
        jnd, least_jnd: (fills, fills) JND between two fills to the first finger, and to the finger that feels
            least of it; None on the diagonal.
        named: (fills, fills) probability that the fill of the row is taken for that of the column, by the first
            finger.
        named_percent: how often each finger names fills rightly at most, mean over the fills.
        print: files to print, within the folder of the palette.
    """

    apart: float
    fingers: Sequence[str]
    fills: Sequence[FillNumbers]
    jnd: Sequence[Sequence[float | None]]
    least_jnd: Sequence[Sequence[float | None]]
    named: Sequence[Sequence[float]]
    named_percent: Sequence[float]
    print: Sequence[str]

    @property
    def least(self) -> float:
        """JND between the two fills that are least apart, to the finger that feels least of it."""
        return min(jnd for row in self.least_jnd for jnd in row if jnd is not None)

    @property
    def short(self) -> str | None:
        """In one line, which two fills are less apart than asked for; None if none are."""
        if self.least >= self.apart:
            return None
        row, column = np.argwhere(np.array(self.least_jnd) == self.least)[0]
        pair = f"{self.fills[row].label} and {self.fills[column].label}"
        return f"{pair} are {self.least:.2f} JND apart to one finger, not {self.apart:g}: ask for fewer fills"


def numbers_of(request: Palette, fills: Sequence[Fill], out: Path, files: Sequence[Path]) -> PaletteNumbers:
    """A palette in numbers.

    Args:
        request: the palette.
        fills: from the smoothest to the roughest.
        out: folder of the palette.
        files: to print.
    """
    felt = np.array([fill.after for fill in fills])
    by_finger = [prediction.named(finger.tolist()) for finger in felt.T]
    named = by_finger[0]
    numbers = []
    for number, fill in enumerate(fills):
        spacing_mm, direction = spacing(fill.tile)
        numbers.append(
            FillNumbers(
                label=labels(fills)[number],
                level=fill.level,
                roughness=(ROUGHNESS_JND ** felt[number]).tolist(),
                jnd=(felt[number] - felt[0]).tolist(),
                picture_change_percent_of_white=fill.result.look.change_percent_of_white,
                spacing_mm=spacing_mm,
                direction_degrees=direction,
                named_percent=100.0 * named[number, number],
                folder=fill.folder.relative_to(out).as_posix(),
                tile=f"tiles/{labels(fills)[number].replace(' ', '-')}.png",
            )
        )
    fingers = fills[0].result.touch.fingers
    assert fingers is not None
    return PaletteNumbers(
        apart=request.apart,
        fingers=[finger.name for finger in fingers.each[: felt.shape[1]]],
        fills=numbers,
        jnd=_pairs(abs(felt[:, None, 0] - felt[None, :, 0])),
        least_jnd=_pairs(least_apart(fills)),
        named=named.tolist(),
        named_percent=[100.0 * float(np.diagonal(each).mean()) for each in by_finger],
        print=[file.relative_to(out).as_posix() for file in files],
    )


def labels(fills: Sequence[Fill]) -> list[str]:
    """Names of fills from the smoothest to the roughest."""
    return [f"{fill.name} {number}" for number, fill in enumerate(fills, start=1)]


def _pairs(matrix: Array) -> list[list[float | None]]:
    return [[None if i == j else float(jnd) for j, jnd in enumerate(row)] for i, row in enumerate(matrix)]


def spacing(tile: Relief) -> tuple[float, float | None]:
    """Wavelength with most of the variance of a tile, mm, and direction of its ridges, degrees, or None."""
    power = np.abs(np.fft.fft2(tile.heights - tile.heights.mean())) ** 2
    rows, columns = (np.fft.fftfreq(samples, tile.surface.pitch_mm) for samples in power.shape)
    waves = columns - 1j * rows[:, None]
    rings = np.bincount(np.rint(abs(waves) * tile.width_mm).astype(int).ravel(), power.ravel())
    # Twice the angle, because waves have no sense.
    mean = (power * np.exp(2j * np.angle(waves))).sum() / power.sum()
    direction = (np.degrees(np.angle(mean)) / 2.0 + 90.0) % 180.0
    return tile.width_mm / float(rings.argmax()), float(direction) if abs(mean) > DIRECTED else None


def page(numbers: PaletteNumbers, request: Palette, out: Path) -> bytes:
    """The page."""
    side = request.print.plate_mm
    return render_page(
        "palette.html.j2",
        scripts=("pairs.js",),
        plates=True,
        pair={"title": f"Palette: {', '.join(request.names)}"},
        content=numbers,
        fills=[{**vars(fill), "spot": spot(out / fill.folder, fill.label, side)} for fill in numbers.fills],
        report=REPORT,
        printer=request.printer,
        share=shade,
        far=lambda jnd: shade(0.2 * jnd),
        told=tries_of_100(max(numbers.least, 0.0)),
        limit=LIMIT_PERCENT,
        spot_samples=SPOT_SAMPLES,
    )
