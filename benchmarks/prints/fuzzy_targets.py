"""Fuzzy skin for five targets: what PrusaSlicer makes of the numbers that `retouch fuzzy` finds.

python -m benchmarks.prints.fuzzy_targets [TARGET ...] [--again]

A box with sides of 40 mm and a cylinder are sliced five times for each target; fingers press on upright sides
at contact locations that the search, which presses on computed walls, has not seen.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import Manifold

import retouch
from benchmarks.shared.common import parts_of, publish, rows_parser, table
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.meshes.shells import body_of
from relief.solids.objects.swept import cylinder

TARGETS = (0.008, 0.015, 0.025, 0.035, 0.05)
PROFILE = "layer_height = 0.2\nfirst_layer_height = 0.2\nnozzle_diameter = 0.4\nfuzzy_skin = none\n"


def box() -> Body:
    """A box of 40 x 40 x 20 mm."""
    return body_of(Manifold.cube((40.0, 40.0, 20.0)))[0]


PARTS = {"box": box, "cylinder": lambda: cylinder(20.0, 30.0)}


def reached(part: Path, profile: Path, target: float) -> dict[str, Any]:
    """What the slices of a part have for a target."""
    with tempfile.TemporaryDirectory() as folder:
        made = retouch.fuzzy(part, profile, Path(folder) / "new.ini", roughness=target, quiet=True)
    keys = ("settings", "target", "roughness", "slices", "jnd_from_target")
    found = {key: made.as_json()[key] for key in keys}
    return found | {"slices_std": float(np.std(made.slices, ddof=1))}


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (profile := folder / "plain.ini").write_text(PROFILE)
        parts: dict[str | None, dict[str, Any]] = {}
        for name, make in PARTS.items():
            part = write_parts(folder / f"{name}.stl", [Part(name, make())])
            parts[name] = {f"{target:g}": partial(reached, part, profile, target) for target in TARGETS}
        found = parts_of(rows_parser(__doc__).parse_args(), "fuzzy_targets", parts)
    publish("fabrication", "fuzzy skin", report(found))


def report(found: dict[str | None, Any]) -> str:
    """The table of targets: settings, and V of the slices of both parts with its distance from the target."""
    rows = []
    for target in TARGETS:
        each = [found[name][f"{target:g}"] for name in PARTS]
        settings = (each[0]["settings"][key] for key in ("fuzzy_skin_thickness", "fuzzy_skin_point_dist"))
        felt = (f"{np.mean(row['slices']):.4f} ({row['jnd_from_target']:+.2f})" for row in each)
        rows.append((f"{target:g}", *settings, *felt))
    return table(
        ("target V", "thickness, mm (box)", "points, mm", *(f"{name}: V (JND off)" for name in PARTS)), rows
    )


if __name__ == "__main__":
    main()
