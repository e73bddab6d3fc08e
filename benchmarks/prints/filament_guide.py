"""How prints of filament feel by profile: the figures and the picture of docs/howto/filament.md.

python -m benchmarks.prints.filament_guide [NAME ...] [--again]     # writes docs/images/filament.png as well

A box of 30 x 30 x 14.4 mm, whole layers of all profiles, beside one side of which a slope of 45 degrees lies,
is sliced by each profile, with `prusa-slicer` of the path, and felt on up to 48 places.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from benchmarks.prints.filament import profile, sliced
from benchmarks.shared.chart_style import GRID, frame, pyplot, style, write
from benchmarks.shared.common import parts_of, rows_parser, table
from optimize.verification.solids.bead_feel import feel_of_beads
from relief.solids.filament.beads import Beads, Role
from relief.solids.filament.gcode_reader import read_gcode
from relief.solids.files.mesh import read_mesh
from tactile.jnd import SMOOTH_BELOW
from tactile.skin import Skin

RESULT = "filament_guide"
PART, PLACES = "wedge", 48
PLAIN = {0.25: (0.08, 0.12), 0.4: (0.08, 0.12, 0.2, 0.3), 0.6: (0.2, 0.3), 0.8: (0.3, 0.4)}
"""Layers by nozzles, mm."""
THICK, APART = (0.1, 0.2, 0.3, 0.5), (0.4, 0.8, 1.2)
"""Thicknesses and point distances of fuzzy skin, mm."""
SHOWN = {
    "layers of 0.12 mm": profile(0.12, 0.4),
    "layers of 0.3 mm\nnozzle of 0.6 mm": profile(0.3, 0.6),
    "layers of 0.2 mm\nfuzzy skin 0.3 / 0.8 mm": profile(0.2, 0.4, (0.3, 0.8)),
}
WAVES = {"skin, µm: 0.1 to 0.4 mm": 0.1, "0.4 to 1.6 mm": 0.4, "1.6 to 6.4 mm": 1.6}
"""Least wavelengths of two octaves of the skin's surface, mm, by their headings."""
COLOURS = ("#c1652f", "#2f7d8c", "#7a5aa6")


def measured(options: str) -> dict[str, float]:
    """Numbers of the table: V, relief of sides between 1 and 99 % of the heights, waves of the skin."""
    mesh, gcode = sliced(PART, options)
    (feel,) = feel_of_beads([read_gcode(gcode)], Skin(), most=PLACES, without_texture=read_mesh(mesh))
    felt = feel.by_region()
    sides = np.stack([crop.heights for crop in felt["side"].crops])
    row = {f"V, {name}s": felt[name].means["roughness"] for name in ("side", "slope", "top")}
    row["relief of sides, mm"] = float(np.ptp(np.percentile(sides, (1, 99), axis=(1, 2)), axis=0).mean())
    for head, least in WAVES.items():
        bands = [band for band in feel.bands["side"] if least <= band.least_mm < 4.0 * least]
        row[head] = float(np.hypot.reduce([band.initial_um for band in bands]))
    return row


def report(head: str, rows: Mapping[str, Mapping[str, float]]) -> str:
    """A table of profiles."""
    heads = [*next(iter(rows.values()))]
    cells = [
        (name, *(f"{row[key]:.{1 if key in WAVES else 4 if key[0] == 'V' else 2}f}" for key in heads))
        for name, row in rows.items()
    ]
    return table((head, *heads), cells)


def section(axis: Axes, beads: Beads) -> None:
    """Draw walls at the front of a part where a plane across them cuts through, 3 mm high."""
    x, front = float(np.median(beads.start[:, 0])), float(beads.start[:, 1].min())
    walls = beads.part(beads.role <= Role.INNER_WALL)
    walls = walls.part((walls.start[:, 0] - x) * (walls.end[:, 0] - x) < 0.0)
    way = walls.end - walls.start
    at = walls.start + ((x - walls.start[:, 0]) / way[:, 0])[:, None] * way - (0.0, front, 6.0)
    for (_, y, z), wide, high, role in zip(at, walls.width, walls.height, walls.role, strict=True):
        low_left, rounding = (y - 0.5 * (wide - high), z - 0.5 * high), f"round,pad={0.5 * high}"
        colour = "#e9a36f" if role == Role.OUTER_WALL else "#f6e0cf"
        axis.add_patch(FancyBboxPatch(low_left, wide - high, 0.0, rounding, fc=colour, ec="white"))
    axis.set(xlim=(-0.7, 1.3), ylim=(0.0, 3.0), aspect="equal", xlabel="mm", yticks=range(4))


def picture(felt: Mapping[tuple[float, float], float]) -> None:
    """Write the picture: sections of three profiles, and V by thickness and point distance, mm."""
    style()
    layout: dict[str, Any] = {"layout": "constrained", "width_ratios": (1.0, 1.0, 1.0, 1.9)}
    figure, axes = pyplot.subplots(1, 4, figsize=(10.6, 3.9), **layout)
    for axis, (name, options) in zip(axes[:3], SHOWN.items(), strict=True):
        section(axis, read_gcode(sliced(PART, options)[1]).beads)
        axis.set_title(name, fontsize=9)
    for apart, colour in zip(APART, COLOURS, strict=True):
        values = [felt[thick, apart] for thick in THICK]
        axes[3].plot(THICK, values, "o-", markersize=4, color=colour, label=f"points {apart:g} mm apart")
    axes[3].axhspan(0.0, SMOOTH_BELOW, color=GRID, alpha=0.6)
    axes[3].set(ylim=0.0, xlim=(0.05, 0.55), xlabel="thickness of the fuzzy skin, mm", ylabel="V of sides")
    axes[3].legend(frameon=False)
    frame(axes[3])
    write(figure, "filament.png", dpi=110)


def main() -> None:
    fuzzy, plain = [*product(THICK, APART)], [(layer, nozzle) for nozzle in PLAIN for layer in PLAIN[nozzle]]
    options: dict[str | None, dict[str, str]] = {
        "profile": {f"{layer:g} mm, nozzle {nozzle:g} mm": profile(layer, nozzle) for layer, nozzle in plain},
        "fuzzy skin": {f"{one:g} mm, points {two:g} mm": profile(0.2, 0.4, (one, two)) for one, two in fuzzy},
    }
    parts = {
        head: {name: partial(measured, one) for name, one in each.items()} for head, each in options.items()
    }
    for head, found in parts_of(rows_parser(__doc__).parse_args(), RESULT, parts).items():
        print(f"\n{report(str(head), found)}")
    picture(dict(zip(fuzzy, (row["V, sides"] for row in found.values()), strict=True)))


if __name__ == "__main__":
    main()
