"""Plates with a lamp that moves, as part of a page: HTML with packed heights, style and script."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from relief.common.formatting import plain
from relief.relief import Relief
from relief.shading import averaged
from retouch.pages.plate_viewer.appearance import STUDIO, Appearance
from retouch.pages.viewer.packing import STEPS, packed

MOST_SAMPLES = 256
"""Samples along the longer side of a plate in a page: 80 to 130 kB for each plate."""
STEPS_A_PITCH = 1000
"""Steps of a height over the distance between samples: one changes a slope by 0.001."""
SCRIPTS = ("plate_light.js", "plate_viewer.js")
"""Files of the component `PlateView`, in their order; what embeds it needs no other."""

FIGURE = Markup("""\
<figure class="plate-figure" data-label="{label}" hidden>
<div class="plate-stage"><div class="plate-view" role="group" aria-label="{label}"></div>{tags}</div>
<div class="plate-tools">{groups}
<label>Lamp around <input type="range" class="azimuth" min="0" max="359" step="1"> <output></output></label>
<label>Lamp above the plate <input type="range" class="elevation" min="5" max="90" step="1"> <output></output></label>
<p class="aside">Drag to move the lamp: it stands under the pointer, straight above in the middle, at the horizon on the \
rim. With shift, or with Tilt, dragging turns the plate. Keys: arrows for the lamp, shift and arrows to tilt, \
{swap}0 to start anew.</p>
<p class="aside">{note}</p></div>
<script type="application/json">{data}</script>
</figure>""")
TAGS = Markup('<span class="tag">{}</span><span class="tag">{}</span>')
GROUP = Markup('<span class="group" role="group" aria-label="{}">{}</span>')
BUTTON = Markup('<button type="button"{}>{}</button>')


@dataclass(frozen=True)
class NamedRelief:
    """A relief as a figure shows it.

    Attributes:
        name: in a word or two, such as "before".
        relief: on its plate.
    """

    name: str
    relief: Relief


def plate_figure(
    label: str, first: NamedRelief, second: NamedRelief | None = None, appearance: Appearance = STUDIO
) -> Markup:
    """A figure that shows one plate, or two plates under one lamp with an edge between them.

    Args:
        label: what is shown, for those who do not see it; text of any kind.
        first: left of the edge.
        second: right of the edge, on a plate of the same size.
        appearance: of the matte surface and its light.

    Returns:
        HTML for a page that `render_page` makes with `plates=True`, which stays hidden where the browser has
        no WebGL 2.

    Raises:
        ValueError: the plates differ in size.
    """
    shown = [first] if second is None else [first, second]
    data = packed_plates([each.relief for each in shown]) | appearance.options()
    groups = [_lamps(appearance), _modes()]
    if second is not None:
        groups.append(_swaps(first.name, second.name))
    return FIGURE.format(
        label=plain(label),
        tags=Markup() if second is None else TAGS.format(first.name, second.name),
        groups=Markup().join(groups),
        swap="" if second is None else "B for the other plate, ",
        note=f"{_samples(first.relief, data)} {appearance.note}",
        data=as_json(data | {"names": [each.name for each in shown]}),
    )


def packed_plates(reliefs: Sequence[Relief], most: int = MOST_SAMPLES) -> dict[str, Any]:
    """Heights of one or two plates of one size, averaged down to `most` samples, for `plate_figures.js`.

    Heights are in whole steps above their lowest, with the size of the step in mm.

    Raises:
        ValueError: the plates differ in size.
    """
    if len({relief.surface.size_mm for relief in reliefs}) > 1:
        raise ValueError("plates of different sizes")
    side = min(most, *(max(relief.heights.shape) for relief in reliefs))
    fields = [averaged(relief.heights, side) for relief in reliefs]
    width_mm, (rows, cols) = reliefs[0].width_mm, fields[0].shape
    low, high = min(float(field.min()) for field in fields), max(float(field.max()) for field in fields)
    step = max((high - low) / STEPS, width_mm / cols / STEPS_A_PITCH)
    return {
        **{"rows": rows, "cols": cols, "size_mm": width_mm, "low": low, "step": step},
        "repeats": list(reliefs[0].repeats),
        "heights": [_packed_field(np.rint((field - low) / step).astype(np.uint16)) for field in fields],
    }


def as_json(data: Any) -> Markup:
    """JSON for a script element, which no text in it can end."""
    return Markup(json.dumps(data, separators=(",", ":")).replace("<", r"\u003c"))


@cache
def asset(name: str) -> str:
    """The text of a script or of `plate_viewer.css`."""
    return files("retouch.pages.plate_viewer").joinpath(name).read_text(encoding="utf-8")


def component() -> str:
    """The script that defines `PlateView`, for other pages than those of `render_page`."""
    return "\n".join(asset(name) for name in SCRIPTS)


def _packed_field(steps: NDArray[np.uint16]) -> str:
    """A field (rows, cols) as differences along its rows, then down its columns, which zlib shrinks to little."""
    along = np.diff(steps, axis=1, prepend=np.zeros_like(steps[:, :1]))
    return str(packed(along)["data"])


def _samples(relief: Relief, data: dict[str, Any]) -> str:
    """How many samples are shown, and of how many."""
    rows, cols = relief.heights.shape
    shown = f"{data['cols']} × {data['rows']}"
    return f"Heights at {shown} samples{'' if rows == data['rows'] else f', averaged from {cols} × {rows}'}."


def _lamps(appearance: Appearance) -> Markup:
    return GROUP.format(
        "Lamps of the pictures",
        Markup().join(
            BUTTON.format(Markup(' data-lamp="{}"').format(place), lamp.name)
            for place, lamp in enumerate(appearance.lamps)
        ),
    )


def _modes() -> Markup:
    modes = [("Lamp", "lamp", "true"), ("Tilt", "tilt", "false")]
    buttons = [
        BUTTON.format(Markup(' data-mode="{}" aria-pressed="{}"').format(mode, pressed), name)
        for name, mode, pressed in modes
    ]
    reset = BUTTON.format(Markup(' class="reset"'), "Reset")
    return GROUP.format("What dragging moves", Markup().join(buttons)) + GROUP.format("View", reset)


def _swaps(first: str, second: str) -> Markup:
    ways = [(first, 100), ("Both", 50), (second, 0)]
    buttons = [
        BUTTON.format(
            Markup(' data-swipe="{}" aria-pressed="{}"').format(percent, str(percent == 50).lower()), name
        )
        for name, percent in ways
    ]
    return GROUP.format("Shown", Markup().join(buttons))
