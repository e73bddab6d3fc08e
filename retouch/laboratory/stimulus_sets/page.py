"""The page of a stimulus set: pictures of all plates, how they feel, and how people should rank them."""

import base64
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
from markupsafe import Markup
from PIL import Image

from optimize.run_directory.finished_run import read_result
from optimize.run_directory.key import REPORT
from relief.relief import Relief
from retouch.laboratory.stimulus_sets.document import RENDERS, SetNumbers
from retouch.laboratory.stimulus_sets.levels import CONTACT, CONTROLS, ROUGHNESS, SCALED
from retouch.laboratory.stimulus_sets.plates import cut_square
from retouch.laboratory.stimulus_sets.stimulus_set import StimulusSet
from retouch.pages.plate_viewer.figure import SPOT_SAMPLES, plate_spot
from retouch.pages.rendering import render_page

SIDE = 240
"""Pixels along the side of a picture of a plate."""
QUALITY = 85
"""Of the pictures, which are JPEG: a set may have hundreds."""
KINDS = {
    ROUGHNESS: "Levels of roughness",
    CONTACT: "Levels of contact area",
    SCALED: "Scaled in height, to compare with",
    CONTROLS: "Other patches of the picture, unchanged",
}
"""Headings of the kinds of plates."""
PNG_AFTER = "-after.png"


def page(numbers: SetNumbers, stimuli: StimulusSet, out: Path) -> bytes:
    """The page.

    Args:
        numbers: of the set.
        stimuli: the set.
        out: its folder.
    """
    folders = [plate.folder for plate in numbers.plates]
    return render_page(
        "stimuli.html.j2",
        scripts=("pairs.js",),
        plates=True,
        pair={"title": f"Stimuli: {', '.join(stimuli.names)}"},
        content=numbers,
        kinds=KINDS,
        spot=lambda plate: spot(out / plate.folder, plate.label, stimuli.print.plate_mm),
        reports={folder: f"{folder}/{REPORT}" for folder in folders if (out / folder / REPORT).is_file()},
        summary=numbers.summary,
        settings=stimuli.print,
        printer=stimuli.printer,
        shade=shade,
        spot_samples=SPOT_SAMPLES,
    )


def spot(folder: Path, label: str, plate_mm: float) -> Markup | None:
    """The plate under the first light, which a lamp lights that moves; None without a picture.

    Under parallel light from a camera straight above, the picture of a plate is that of its tile, repeated.
    """
    first = next(iter(sorted((folder / RENDERS).glob(f"*{PNG_AFTER}"))), None)
    if first is None:
        return None
    tile = read_result(folder, repeats=False)
    whole = Image.fromarray(
        cut_square(np.asarray(Image.open(first).convert("L")), tile.width_mm, plate_mm)[0]
    )
    whole.thumbnail((2 * SIDE, 2 * SIDE), Image.Resampling.BOX)
    file = io.BytesIO()
    whole.save(file, "JPEG", quality=QUALITY)
    picture = "data:image/jpeg;base64," + base64.b64encode(file.getvalue()).decode("ascii")
    return plate_spot(picture, label, _part(tile, plate_mm))


def _part(tile: Relief, plate_mm: float) -> Relief:
    """The plate, or one period of a plate that is larger: averaged down, more would look smoother."""
    if plate_mm > tile.width_mm:
        return replace(tile, repeats=(True, True))
    heights, side_mm = cut_square(tile.heights, tile.width_mm, plate_mm)
    return replace(tile, heights=heights, width_mm=side_mm)


def shade(share: float) -> str:
    """Share of the page's blue in a cell of a matrix; all of it at 1 and above."""
    return f"{100.0 * min(share, 1.0):.0f}%"
