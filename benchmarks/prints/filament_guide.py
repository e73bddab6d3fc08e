"""How prints of filament feel by profile: the tables and the picture of docs/filament.md.

python -m benchmarks.prints.filament_guide [--again]     # writes docs/images/filament.png as well

A box of 30 x 30 x 14.4 mm, whole layers of all profiles, beside one side of which a slope of 45 degrees lies,
is sliced by each profile, with `prusa-slicer` of the path, and felt on up to 48 places. Resumable:
results/filament_guide.json keeps each profile.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from benchmarks.prints.filament import profile, sliced
from benchmarks.shared.chart_style import GRID, frame, pyplot, style, write
from benchmarks.shared.common import DOCS, IMAGES, again_given, kept, load, publish, table
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.verification.solids.bead_feel import feel_of_beads
from relief.solids.filament.beads import Beads, Role
from relief.solids.filament.gcode_reader import read_gcode
from relief.solids.files import read_mesh
from retouch.verbs.evaluation import load_skin
from tactile.jnd import SMOOTH_BELOW

RESULT, COMMAND, PAGE = "filament_guide", "benchmarks.prints.filament_guide", DOCS / "filament.md"
PART, PLACES = "wedge", 48
PLAIN = ((0.25, 0.08), (0.25, 0.12), (0.4, 0.08), (0.4, 0.12), (0.4, 0.2), (0.4, 0.3))
PLAIN += ((0.6, 0.2), (0.6, 0.3), (0.8, 0.3), (0.8, 0.4))
"""Nozzles and layers, mm."""
THICK, APART = (0.1, 0.2, 0.3, 0.5), (0.4, 0.8, 1.2)
"""Thicknesses and point distances of fuzzy skin, mm."""
SHOWN = {
    "layers 0.12 mm": (0.12, 0.4, None),
    "layers 0.3 mm, nozzle 0.6": (0.3, 0.6, None),
    "layers 0.2 mm, fuzzy skin 0.3 / 0.8": (0.2, 0.4, (0.3, 0.8)),
}
SKIN = ((0.1, 0.4), (0.4, 1.6), (1.6, 6.4))
"""Wavelengths of the skin's surface that are shown, mm: two octaves each."""
COLOURS = ("#c1652f", "#2f7d8c", "#7a5aa6")


def measured(options: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers by region: V, bands of the skin, and the relief between 1 and 99 % of the heights, mm."""
    with tempfile.TemporaryDirectory() as folder:
        mesh, gcode = sliced(PART, options, Path(folder))
        read = read_gcode(gcode)
        (feel,) = feel_of_beads([read], load_skin(DEFAULT_SKIN), most=PLACES, without_texture=read_mesh(mesh))
    regions: dict[str, Any] = feel.details()["regions"]
    for name, part in feel.by_region().items():
        low, high = np.percentile([crop.heights for crop in part.crops], (1.0, 99.0), axis=(1, 2))
        regions[name]["relief_mm"] = float((high - low).mean())
    return regions


def cells(regions: Mapping[str, Any]) -> tuple[str, ...]:
    """V of sides, slopes and tops, relief of sides, and rms of the skin's surface there, µm."""
    felt = [f"{regions[name]['roughness']:.4f}" for name in ("side", "slope", "top")]
    side = regions["side"]
    rms = [
        sum(b["rms_um"] ** 2 for b in side["bands"] if least <= b["least_mm"] < most) ** 0.5
        for least, most in SKIN
    ]
    return (*felt, f"{side['relief_mm']:.2f}", *(f"{one:.1f}" for one in rms))


def report(head: str, rows: Iterable[tuple[str, Mapping[str, Any]]]) -> str:
    """A table of profiles."""
    skin = [f"{least:g} to {most:g} mm" for least, most in SKIN]
    heads = (head, "V, sides", "slopes of 45°", "tops", "relief of sides, mm", f"skin, µm: {skin[0]}")
    return table((*heads, *skin[1:]), [(name, *cells(regions)) for name, regions in rows])


def section(axis: Axes, beads: Beads, x_mm: float) -> None:
    """Draw where walls cross a plane x of the part, looking along its front, 3 mm high."""
    beads = beads.part(beads.role <= Role.OVERHANG_WALL)
    front, low = beads.start[:, 1].min(), 6.0
    way = beads.end - beads.start
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (x_mm - beads.start[:, 0]) / way[:, 0]
    crossing = np.flatnonzero((share >= 0.0) & (share < 1.0))
    for bead in crossing:
        _, y, z = beads.start[bead] + share[bead] * way[bead]
        if y < front + 2.0 and low - 0.5 < z < low + 3.5:
            wide, high = beads.width[bead], beads.height[bead]
            outer = beads.role[bead] == Role.OUTER_WALL
            box = FancyBboxPatch(
                (y - front - 0.5 * wide + 0.5 * high, z - low - 0.5 * high),
                max(wide - high, 1e-3),
                0.0,
                boxstyle=f"round,pad={0.5 * high}",
                facecolor="#e9a36f" if outer else "#f3d9c4",
                edgecolor="white",
                linewidth=0.5,
            )
            axis.add_patch(box)
    axis.set(xlim=(-0.7, 1.5), ylim=(0.0, 3.0), aspect="equal")


def picture(fuzzy: Mapping[tuple[float, float], float]) -> None:
    """Write the picture: V by thickness and point distance, mm, beside sections of three profiles."""
    style()
    figure, axes = pyplot.subplots(
        1, 4, figsize=(10.6, 4.0), layout="constrained", width_ratios=(1.0, 1.0, 1.0, 1.9)
    )
    for axis, (name, options) in zip(axes, SHOWN.items(), strict=False):
        with tempfile.TemporaryDirectory() as folder:
            beads = read_gcode(sliced(PART, profile(*options), Path(folder))[1]).beads
        section(axis, beads, float(beads.start[:, 0].mean()))
        axis.set_title(name.replace(", ", "\n"), fontsize=9)
    axis = axes[3]
    for apart, colour in zip(APART, COLOURS, strict=True):
        felt = [fuzzy[thick, apart] for thick in THICK]
        axis.plot(THICK, felt, marker="o", markersize=4, color=colour, label=f"points {apart:g} mm apart")
    axis.axhspan(0.0, SMOOTH_BELOW, color=GRID, alpha=0.5)
    frame(axis)
    axis.set(
        ylim=(0.0, None), xlim=(0.05, 0.55), xlabel="thickness of the fuzzy skin, mm", ylabel="V of sides"
    )
    axis.legend(frameon=False)
    write(figure, IMAGES / "filament.png", dpi=120)


def main() -> None:
    again = again_given(__doc__)
    plain = {f"nozzle {nozzle:g}, layers {layer:g} mm": profile(layer, nozzle) for nozzle, layer in PLAIN}
    rough = {(thick, apart): profile(0.2, 0.4, (thick, apart)) for thick in THICK for apart in APART}
    named = {f"{thick:g} mm, {apart:g} mm": options for (thick, apart), options in rough.items()}
    for part, profiles in {"plain": plain, "fuzzy": named}.items():
        for name, options in profiles.items():
            kept(RESULT, part, name, lambda options=options: measured(options), again)
    found = load(RESULT)
    publish(PAGE, "plain", COMMAND, report("profile", found["plain"].items()))
    publish(PAGE, "fuzzy", COMMAND, report("thickness, point distance", found["fuzzy"].items()))
    felt = [found["fuzzy"][name]["side"]["roughness"] for name in named]
    picture(dict(zip(rough, felt, strict=True)))


if __name__ == "__main__":
    main()
