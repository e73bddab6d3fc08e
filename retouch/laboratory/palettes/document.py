"""Numbers and page of a palette: fills as verified, how far apart they are, and how often they are named."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from optimize.run_directory.key import REPORT
from relief.relief import Relief
from retouch.laboratory.palettes.making import Fill, least_apart
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.page import shade, spot
from retouch.pages.plate_viewer.figure import SPOT_SAMPLES
from retouch.pages.rendering import render_page
from tactile.fingers import VARIATIONS
from tactile.jnd import ROUGHNESS_JND, tries_of_100
from tactile.quantities import LIMIT_PERCENT

DIRECTED = 0.3
"""Least share of a direction (0: all alike, 1: parallel ridges) at which a fill has one."""


def content_of(request: Palette, fills: Sequence[Fill], out: Path, files: Sequence[Path]) -> dict[str, Any]:
    """The content of `palette.json`.

    Args:
        request: the palette.
        fills: from the smoothest to the roughest.
        out: folder of the palette.
        files: to print.

    Returns:
        `apart` as asked for and `least`, JND; `fingers`, of whom the first is the given one; `fills` with V
        and JND from the first fill to each finger, and how often the first finger `named` each rightly;
        `jnd` and `least_jnd` (fills, fills) between two fills to the first finger and to that which feels
        least of it, 0 on the diagonal; `named` (fills, fills), how often the fill of the row is taken for
        that of the column, and `named_percent`, how often each finger names fills rightly; `short`, None
        or a line about the pair that is less apart than asked for; and the files to `print`.
    """
    labels, apart = labels_of(request, fills), least_apart(fills)
    felt = np.array([fill.after for fill in fills])
    named = [prediction.named(finger.tolist()) for finger in felt.T]
    named_percent = 100.0 * np.diagonal(named, axis1=1, axis2=2)
    least, short = float(apart.min()), None
    if least < request.apart:
        pair = " and ".join(labels[at] for at in np.unravel_index(apart.argmin(), apart.shape))
        short = f"{pair} are {least:.2f} JND apart to one finger, not {request.apart:g}: ask for fewer fills"
    shown = [
        {
            "label": label,
            "level": fill.level,
            "roughness": (ROUGHNESS_JND**fill.after).tolist(),
            "jnd": (fill.after - felt[0]).tolist(),
            "picture_change_percent_of_white": fill.run.verification.look.change_percent_of_white,
            **spacing(fill.run.result),
            "named_percent": percent,
            "folder": fill.run.folder.relative_to(out).as_posix(),
            "tile": f"tiles/{label.replace(' ', '-')}.png",
        }
        for label, fill, percent in zip(labels, fills, named_percent[0].tolist(), strict=True)
    ]
    return {
        "apart": request.apart,
        "least": least,
        "short": short,
        "fingers": [name for name, *_ in VARIATIONS[: felt.shape[1]]],
        "fills": shown,
        "jnd": abs(felt[:, None, 0] - felt[None, :, 0]).tolist(),
        "least_jnd": np.where(np.isinf(apart), 0.0, apart).tolist(),
        "named": named[0].tolist(),
        "named_percent": named_percent.mean(axis=1).tolist(),
        "print": [file.relative_to(out).as_posix() for file in files],
    }


def labels_of(request: Palette, fills: Sequence[Fill]) -> list[str]:
    """Names of fills from the smoothest to the roughest."""
    return [f"{request.names[fill.texture]} {number}" for number, fill in enumerate(fills, start=1)]


def spacing(tile: Relief) -> dict[str, float | None]:
    """Spacing and direction of a tile, which pages show and distances in JND do not count.

    Returns:
        `spacing_mm`, the geometric mean of the wavelengths, weighted by the variance of the heights that each
        holds, and `direction_degrees` of the ridges, from the x axis towards the y axis, None if they have
        none.
    """
    power = np.abs(np.fft.fft2(tile.heights - tile.heights.mean())) ** 2
    rows, columns = (np.fft.fftfreq(samples, tile.surface.pitch_mm) for samples in power.shape)
    waves = columns - 1j * rows[:, None]
    # Twice the angle, because waves have no sense.
    mean = (power * np.exp(2j * np.angle(waves))).sum() / power.sum()
    degrees = float((np.degrees(np.angle(mean)) / 2.0 + 90.0) % 180.0)
    direction = degrees if abs(mean) > DIRECTED else None
    # No wave is longer than the tile.
    logs = np.log(np.maximum(abs(waves), 1.0 / max(tile.surface.size_mm)))
    spacing_mm = math.exp(-float((power * logs).sum() / power.sum()))
    return {"spacing_mm": spacing_mm, "direction_degrees": direction}


def page(content: dict[str, Any], request: Palette, out: Path) -> bytes:
    """The page of the content of `palette.json`."""
    side = request.print.plate_mm
    return render_page(
        "palette.html.j2",
        scripts=("pairs.js",),
        plates=True,
        pair={"title": f"Palette: {', '.join(request.names)}"},
        content=content,
        spots=[spot(out / fill["folder"], fill["label"], side) for fill in content["fills"]],
        report=REPORT,
        printer=request.printer,
        share=shade,
        far=lambda jnd: shade(0.2 * jnd),
        right_of_100=tries_of_100(max(content["least"], 0.0)),
        limit=LIMIT_PERCENT,
        spot_samples=SPOT_SAMPLES,
    )
