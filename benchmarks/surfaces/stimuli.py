"""A stimulus set in numbers: the levels that plates reach, and how people should sort them, beside the paper.

retouch stimuli gravel-tile bark-tile knit-tile leather-tile pebbles-tile weave-tile --jnd -2,-1,0,1,2 -o DIR
python -m benchmarks.surfaces.stimuli DIR

The numbers go to results/stimuli.json and into docs/evidence/people.md, the picture to docs/images.
Without DIR the page is written again from the results.
"""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from benchmarks.shared.chart_style import style
from benchmarks.shared.common import IMAGES, load, machine, publish, save, study_given, table
from relief.heightmap import load_height_map
from relief.solids.export.pixel_font import bitmap
from retouch.laboratory.stimulus_sets.document import DOCUMENT, RENDERS
from retouch.laboratory.stimulus_sets.levels import ROUGHNESS
from retouch.laboratory.stimulus_sets.plates import cut_square
from retouch.laboratory.stimulus_sets.stimulus_set import FILE, StimulusSet
from retouch.pages.colour_maps import hillshade

PICTURE = IMAGES / "stimuli.png"
SHOWN = 3
"""Textures of the picture."""
DPI, GREYS = (150, 120), 32
"""Resolution of the picture of one texture, and of several; shades of grey. The file stays below 400 kB."""
RAISED_MM, BACK_PIXELS = 0.4, 12
"""Height of the letters on the drawn backs, mm, and pixels of the drawing for each of theirs."""
KEPT = ("label", "level", "jnd", "jnd_least", "jnd_most", "off_target_percent", "picture_change_percent")


def main() -> None:
    folder = study_given(__doc__)
    if folder is not None:
        content = json.loads((folder / DOCUMENT).read_text())
        save("stimuli", {"machine": machine()} | measured(content))
        style()
        draw(folder, content)
    publish("people", "stimuli", section(load("stimuli")))


def measured(content: dict[str, Any]) -> dict[str, Any]:
    """What is kept of a set: its levels, without pairs and other kinds of plates."""
    textures = {
        texture["name"]: {
            "roughness": texture["roughness"],
            "plates": [
                {"mark": _mark(plate["level"])} | {name: plate[name] for name in KEPT}
                for plate in texture["plates"]
                if plate["kind"] == ROUGHNESS
            ],
            **{name: texture["levels"][name] for name in ("neighbours_percent", "sorted_percent", "fingers")},
        }
        for texture in content["textures"]
    }
    return {"textures": textures, "summary": content["summary"]}


def _mark(level: float) -> str:
    """A level of roughness as it stands on the back of a plate."""
    return f"{level:+g}" if level else "0"


def section(found: dict[str, Any]) -> str:
    """The set in words and by texture."""
    summary = found["summary"]
    lines = []
    for name, texture in found["textures"].items():
        plates = [plate for plate in texture["plates"] if plate["level"]]
        ends = (f"{how(plate['picture_change_percent'] for plate in plates):.1f}" for how in (min, max))
        lines.append([name, " to ".join(ends), f"{texture['neighbours_percent']:.0f}", _fingers(texture)])
    words = (
        f"{summary['met']} of {summary['plates']} plates are within 1 % of their targets, the worst is "
        f"{summary['largest_off_target_percent']:.2g} % off. Neighbouring levels should be ranked correctly "
        f"in {summary['neighbours_percent']:.1f} % of pairs; the paper's participants did in 85 % (standard "
        f"deviation 4). Plates two steps apart should be in the wrong order in "
        f"{0.6 * summary['far_discrepancy_percent']:.1f} of 60 sorts; in the paper they were in 3 of 60."
    )
    head = ["texture", "pictures, %", "neighbours correct, %", "by other fingers, %"]
    return f"{textwrap.fill(words, 120)}\n\n{table(head, lines)}"


def _fingers(texture: dict[str, Any]) -> str:
    """Least and largest share of pairs that other fingers rank correctly."""
    each = [finger["neighbours_percent"] for finger in texture["fingers"]]
    return f"{min(each):.0f} to {max(each):.0f}"


def draw(folder: Path, content: dict[str, Any]) -> None:
    """The plates of the first textures from above under the first light, and one from below."""
    plate_mm = StimulusSet.read(folder / FILE).print.plate_mm
    textures = content["textures"][:SHOWN]
    count = max(len([p for p in t["plates"] if p["kind"] == ROUGHNESS]) for t in textures)
    figure, axes = plt.subplots(
        len(textures), count + 1, figsize=(1.75 * (count + 1), 2.0 * len(textures)), squeeze=False
    )
    for row, texture in zip(axes, textures, strict=True):
        plates = [plate for plate in texture["plates"] if plate["kind"] == ROUGHNESS]
        for axis in row:
            axis.axis("off")
        for axis, plate in zip(row, plates, strict=False):
            axis.imshow(_above(folder / plate["folder"], plate_mm), cmap="gray", vmin=0, vmax=255)
            axis.set_title(f"{plate['label']}: {plate['jnd']:+.2f} JND", fontsize=7.5)
        row[-1].imshow(_below(plates[-1]["label"], plate_mm), cmap="gray", vmin=0.0, vmax=1.0)
        row[-1].set_title("back of the last", fontsize=7.5)
    figure.tight_layout(pad=0.8)
    figure.savefig(PICTURE, dpi=DPI[len(textures) > 1])
    plt.close(figure)
    # Everything in it is grey, which a third of the bytes holds.
    Image.open(PICTURE).convert("L").quantize(GREYS).save(PICTURE, optimize=True)


def _above(folder: Path, plate_mm: float) -> np.ndarray:
    first = min((folder / RENDERS).glob("*-after.png"))
    side_mm = load_height_map(folder / "heights.exr").side_mm
    return cut_square(np.asarray(Image.open(first).convert("L")), side_mm, plate_mm)[0]


def _below(label: str, plate_mm: float) -> np.ndarray:
    """The back of a plate as seen from below, shaded."""
    letters = np.kron(bitmap(label.upper().split(" ")), np.ones((BACK_PIXELS, BACK_PIXELS)))
    pixel_mm = min(0.8, (plate_mm - 4.0) * BACK_PIXELS / letters.shape[1])
    side = round(plate_mm / pixel_mm * BACK_PIXELS)
    back = np.zeros((side, side))
    top, left = (side - letters.shape[0]) // 2, (side - letters.shape[1]) // 2
    back[top : top + letters.shape[0], left : left + letters.shape[1]] = RAISED_MM * letters
    return 0.3 + 0.7 * np.asarray(hillshade(back, plate_mm))


if __name__ == "__main__":
    main()
