"""Plates with a lamp that moves, as part of a page: HTML with packed heights."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from relief.ground.arrays import FloatArray
from relief.relief import Relief
from relief.relief_shading import averaged
from retouch.pages.plate_viewer.appearance import STUDIO, Appearance
from retouch.pages.templates import as_json, html
from retouch.pages.viewer.packing import STEPS, packed

MOST_SAMPLES = 256
"""Samples along the longer side of a plate in a page: 80 to 130 kB for each plate."""
SPOT_SAMPLES = 128
"""The same where a page may have hundreds of plates: 20 to 30 kB for each."""
STEPS_A_PITCH = 400
"""Steps of a height over the distance between samples: one changes a slope by 0.0025."""


def plate_figure(title: str, reliefs: Mapping[str, Relief], appearance: Appearance = STUDIO) -> Markup:
    """A figure that shows one plate, or two plates under one lamp with an edge between them.

    Args:
        title: heading of the figure; text of any kind.
        reliefs: one, or the one left of the edge and the one right of it, on plates of one size; by a name of
            a word or two, such as "before".
        appearance: of the matte surface and its light.

    Returns:
        HTML for a page that `render_page` makes with `plates=True`, which stays hidden where the browser has
        no WebGL 2.

    Raises:
        ValueError: the plates differ in size.
    """
    shown, names = list(reliefs.values()), list(reliefs)
    data = packed_plates(shown)
    return html(
        "plate_figure.html.j2",
        title=title,
        names=names,
        lamps=appearance.lamps,
        note=f"{samples_note(shown[0], data)} {appearance.note}",
        data=as_json(data | appearance.options() | {"names": names}),
    )


def plate_spot(picture: str, label: str, relief: Relief) -> Markup:
    """A picture that a button turns into a plate under a lamp that moves; one of a page at a time.

    Args:
        picture: address of the picture.
        label: what is shown, for those who do not see it; text of any kind.
        relief: of the plate.
    """
    data = packed_plates([relief], SPOT_SAMPLES) | STUDIO.options()
    return html("plate_spot.html.j2", picture=picture, label=label, data=as_json(data))


def packed_plates(reliefs: Sequence[Relief], most: int = MOST_SAMPLES) -> dict[str, Any]:
    """One or two plates of one size for `plate_figures.js`, their heights averaged down to `most` samples.

    Raises:
        ValueError: the plates differ in size.
    """
    first = reliefs[0]
    if any(relief.surface.size_mm != first.surface.size_mm for relief in reliefs):
        raise ValueError("plates of different sizes")
    side = min(most, *(max(relief.heights.shape) for relief in reliefs))
    fields = [averaged(relief.heights, side) for relief in reliefs]
    rows, cols = fields[0].shape
    return {
        **{"rows": rows, "cols": cols, "size_mm": first.width_mm, "repeats": list(first.repeats)},
        "heights": [_packed(field, first.width_mm / cols) for field in fields],
    }


def _packed(field: FloatArray, pitch_mm: float) -> dict[str, Any]:
    """Heights (rows, cols), mm, as whole steps above the lowest, and the size of a step, mm.

    The steps are kept as differences along the rows, of which `packed` takes those down the columns: zlib
    shrinks them to little.
    """
    low = float(field.min())
    step = max(float(np.ptp(field)) / STEPS, pitch_mm / STEPS_A_PITCH)
    steps = np.rint((field - low) / step).astype(np.uint16)
    along = np.diff(steps, axis=1, prepend=np.zeros_like(steps[:, :1]))
    return {"low": low, "step": step, "data": packed(along)["data"]}


def samples_note(relief: Relief, data: dict[str, Any]) -> str:
    """A sentence on how many samples of a relief its packed plates show."""
    rows, cols = relief.heights.shape
    shown = f"{data['cols']} × {data['rows']}"
    return f"Heights at {shown} samples{'' if rows == data['rows'] else f', averaged from {cols} × {rows}'}."
