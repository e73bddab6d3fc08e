"""Plates with a lamp that moves, as part of a page: HTML with packed heights, style and script."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup

from relief.ground.arrays import FloatArray
from relief.ground.formatting import plain
from relief.relief import Relief
from relief.relief_shading import averaged
from retouch.pages.plate_viewer import SCRIPTS
from retouch.pages.plate_viewer.appearance import STUDIO, Appearance
from retouch.pages.viewer.packing import STEPS, packed

MOST_SAMPLES = 256
"""Samples along the longer side of a plate in a page: 80 to 130 kB for each plate."""
SPOT_SAMPLES = 128
"""The same where a page may have hundreds of plates: 20 to 30 kB for each."""
STEPS_A_PITCH = 400
"""Steps of a height over the distance between samples: one changes a slope by 0.0025."""

FIGURE = Markup("""\
<figure class="plate-figure" hidden>
<figcaption class="name">{title}</figcaption>
<div class="plate-stage"><div class="plate-view" role="group" aria-label="{label}"></div>{tags}</div>
<div class="plate-tools">
{groups}
<label><span>Lamp, around</span>
<input type="range" class="azimuth" min="0" max="359"><output></output></label>
<label><span>Lamp, above the plate</span>
<input type="range" class="elevation" min="5" max="90"><output></output></label>
<div><span></span><button type="button" class="reset">Reset</button></div>
<p class="aside">Drag to move the lamp: it stands under the pointer, straight above in the middle,
at the horizon on the rim. With shift, dragging tilts the plate. Keys: arrows for the lamp,
shift and arrows to tilt, {swap}0 to start anew.</p>
<p class="aside note">{note}</p></div>
<script type="application/json">{data}</script>
</figure>""")
SPOT = Markup("""\
<div class="plate-spot"><img src="{picture}" alt="{label}">
<div class="plate-view" role="group" aria-label="{label}" hidden></div>
<button type="button" class="plate-open" aria-pressed="false" hidden>Move the lamp</button>
<script type="application/json">{data}</script></div>""")
TAGS = Markup('<span class="tag">{}</span><span class="tag">{}</span>')
GROUP = Markup('<div><span>{0}</span><span class="group" role="group" aria-label="{0}">{1}</span></div>\n')
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
    title: str, first: NamedRelief, second: NamedRelief | None = None, appearance: Appearance = STUDIO
) -> Markup:
    """A figure that shows one plate, or two plates under one lamp with an edge between them.

    Args:
        title: heading of the figure; text of any kind.
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
    names = [each.name for each in shown]
    data = packed_plates([each.relief for each in shown])
    note = f"{samples_note(first.relief, data)} {appearance.note}"
    return _figure(title, names, appearance, note, as_json(data | appearance.options() | {"names": names}))


def _figure(title: str, names: Sequence[str], appearance: Appearance, note: str, data: Markup) -> Markup:
    two = len(names) == 2
    groups = [_lamps(appearance), _modes(), *([_swaps(*names)] if two else [])]
    return FIGURE.format(
        title=plain(title),
        label=plain(" and ".join(names)) + ", a plate under a lamp",
        tags=TAGS.format(*names) if two else Markup(),
        groups=Markup().join(groups),
        swap="B for the other plate, " if two else "",
        note=note,
        data=data,
    )


def plate_spot(picture: str, label: str, relief: Relief) -> Markup:
    """A picture that a button turns into a plate under a lamp that moves; one of a page at a time.

    Args:
        picture: address of the picture.
        label: what is shown, for those who do not see it; text of any kind.
        relief: of the plate.
    """
    data = packed_plates([relief], SPOT_SAMPLES) | STUDIO.options()
    return SPOT.format(picture=picture, label=plain(label), data=as_json(data))


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


def figure_template(first: str, second: str) -> Markup:
    """A figure of two plates without their heights, for scripts that fill it: `PlateFigures.start`."""
    return Markup('<template id="plate-figure">{}</template>').format(
        _figure("Under a lamp that moves", [first, second], STUDIO, "", Markup("null"))
    )


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


def _lamps(appearance: Appearance) -> Markup:
    return GROUP.format(
        "Lamp, as in the pictures",
        Markup().join(
            BUTTON.format(Markup(' data-lamp="{}"').format(place), lamp.name)
            for place, lamp in enumerate(appearance.lamps)
        ),
    )


def _modes() -> Markup:
    modes = [("the lamp", "lamp", "true"), ("the plate", "tilt", "false")]
    buttons = [
        BUTTON.format(Markup(' data-mode="{}" aria-pressed="{}"').format(mode, pressed), name)
        for name, mode, pressed in modes
    ]
    return GROUP.format("Dragging moves", Markup().join(buttons))


def _swaps(first: str, second: str) -> Markup:
    ways = [(first, 100), ("both", 50), (second, 0)]
    buttons = [
        BUTTON.format(
            Markup(' data-swipe="{}" aria-pressed="{}"').format(percent, str(percent == 50).lower()), name
        )
        for name, percent in ways
    ]
    return GROUP.format("Shown", Markup().join(buttons))
