"""What a wrapped part has, compared with the file that it was made of."""

from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.solid import outer_body, volume_mm3
from tests.relief.solids.wrapping.left_as_read import (
    among,
    crossings,
    farthest,
    left_alone,
    open_edges,
    triangles_of,
)

RELIEF_MM, SLACK_MM, ROUND_MM = 0.4, 0.05, 0.1
"""Height of the relief, mm; what a box may grow by beside it; what a place may move by beside it, with the
smooth surface through round facets and what flat triangles miss."""
LEVEL = 1e-3
"""Share of the volume that may be lost: facets of round holes."""


def faces_of(file: Path) -> int | None:
    """Number of triangles of a file; None where Retouch cannot read it."""
    try:
        return len(read_mesh(file).body.faces)
    except InputError:
        return None


def found(file: Path, out: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Numbers of a wrapped part beside its file, as `faults` judges them.

    Args:
        file: as its owner has it.
        out: what `retouch wrap` wrote.
        options: that it was given.

    Returns:
        Counts, distances and ratios by name: open edges; pairs of faces that pass through one another, in the
        file too, and those by 5 um or more of which one is new; volume over that of the file, and the most
        that the relief explains; how far the box grows and shrinks; the largest distance of new vertices from
        the file, and of flat bottoms from what was written.
    """
    was, now = _as_printed(file, options), read_mesh(out).body
    volume, area = volume_mm3(was), float(was.areas.sum())
    low, high = (end(now.vertices, axis=0) - end(was.vertices, axis=0) for end in (np.min, np.max))
    return {
        "written": len(now.faces),
        "open_edges": open_edges(now),
        "crossings": self_intersections(now),
        "file_crossings": self_intersections(was),
        "new_crossings": crossings(now, ~among(triangles_of(now), triangles_of(was))),
        "volume_ratio": volume_mm3(now) / volume,
        "most_volume": 1.0 + area * RELIEF_MM / abs(volume),
        "grown_mm": float(max(-low.min(), high.max())),
        "shrunk_mm": float(max(low.max(), -high.min())),
        "away_mm": farthest(now.vertices, was),
        "bare_um": 1e3 * farthest(was.vertices[np.unique(was.faces[left_alone(was)])], now),
    }


def _as_printed(file: Path, options: tuple[str, ...]) -> Body:
    """The body of a file, or the union of its parts where these are united."""
    units = options[options.index("--units") + 1] if "--units" in options else None
    body = read_mesh(file, units=units).body
    try:
        return outer_body(body, file.name)[0] if "--unite" in options else body
    except InputError:
        return body


def faults(row: dict[str, Any]) -> list[str]:
    """What is wrong with a wrapped part, as "3 open edges"; numbers of files that are open mean less."""
    wrong = [f"{row[name]} {name.replace('_', ' ')}" for name in ("open_edges", "new_crossings") if row[name]]
    if not 1.0 - LEVEL <= row["volume_ratio"] <= row["most_volume"]:
        wrong.append(f"volume x {row['volume_ratio']:.3f}")
    for name, slack_mm in (("grown_mm", SLACK_MM), ("away_mm", ROUND_MM)):
        wrong += [f"{name} {row[name]:.2f}"] * (row[name] > RELIEF_MM + slack_mm)
    wrong += [f"shrunk_mm {row['shrunk_mm']:.2f}"] * (row["shrunk_mm"] > SLACK_MM)
    wrong += [f"bare_um {row['bare_um']:.1f}"] * (row["bare_um"] > 1.0)
    return wrong
