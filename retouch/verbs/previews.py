"""Preview of a prepared height map: the picture, the relief and the numbers on one sheet."""

import os
from pathlib import Path

from relief.ground.files import write_atomically
from relief.ground.formatting import number
from relief.ground.progress import stage
from relief.preparing.picture_preparation import Prepared
from relief.preparing.preview import preview
from retouch.verbs.evaluation import Evaluation


def save_preview(prepared: Prepared, file: str | os.PathLike[str], felt: Evaluation | None = None) -> None:
    """Write the picture, the relief under raking light and the numbers of a height map as a PNG.

    Args:
        prepared: the height map.
        file: to write.
        felt: the evaluation of `prepared.relief`, whose numbers are shown.

    Raises:
        OSError: the file cannot be written.
    """
    with stage("drawing the preview"):
        write_atomically(Path(file), preview(prepared, _figures(prepared, felt)))


def _figures(prepared: Prepared, felt: Evaluation | None) -> list[tuple[str, str]]:
    """Numbers, and what they mean."""
    if prepared.relief_mm is None:
        return []
    slopes = [f"{angle:.0f}°" for angle in prepared.numbers["slopes_deg"].values()]
    figures = [(f"{prepared.relief_mm:.3g} mm", "relief"), (" / ".join(slopes), "slopes, median / steep")]
    if felt is not None:
        figures.append((number(felt.roughness), "roughness V"))
        figures.append((f"{100.0 * felt.contact_fraction:.0f} %", "of the patch in contact"))
    tile = prepared.numbers.get("tile", {})
    if "seam_errors" in tile:
        seam = tile["seam_errors"][tile["method"]]
        figures.append((f"{100.0 * seam:.1f} %", f"seam error, {tile['method']}"))
    return figures
