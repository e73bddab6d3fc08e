"""Spherical fingertips by `retouch evaluate --finger` beside the round finger of their radius.

python -m benchmarks.touch.own_finger [NAME ...] [--again]

Rows are radii of a cap 4 mm thick, with the homogeneous finger of 0.05 MPa at 1 N; `measured` is layered, and
`halved` has facets of half a pixel in place of one.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np

import tactile
from benchmarks.shared.common import cpu_s, publish, rows_of, table
from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from retouch.verbs.fingers import own_finger
from tactile.jnd import jnd_apart
from tactile.unstructured.meshing import Sizing

TEXTURES = ("gravel-tile", "brick-tile", "knit-tile")
THICKNESS_MM = 4.0
SOFT = tactile.Skin(young_modulus_mpa=0.05, force_n=1.0)
ROWS: dict[str, tuple[float, str]] = {
    "8 mm": (8.0, "soft"),
    "10 mm": (10.0, "soft"),
    "15 mm": (15.0, "soft"),
    "8 mm, halved": (8.0, "halved"),
    "10 mm, measured": (10.0, "measured"),
    "15 mm, measured": (15.0, "measured"),
}


def cap(radius_mm: float) -> Mesh:
    """A spherical fingertip with a flat top."""
    ball = manifold3d.Manifold.sphere(radius_mm, 256).translate((0.0, 0.0, radius_mm))
    mesh = ball.trim_by_plane((0.0, 0.0, -1.0), -THICKNESS_MM).to_mesh()
    body = Body(np.asarray(mesh.vert_properties, np.float64)[:, :3], np.asarray(mesh.tri_verts, np.intp))
    return Mesh(body, None, Path(f"sphere of {radius_mm:g} mm"))


def measured(radius_mm: float, kind: str) -> dict[str, Any]:
    """What both fingers feel of the textures, and CPU seconds of meshing, condensing and each press."""
    skin = load_skin("measured") if kind == "measured" else SOFT
    if kind == "halved":
        own_finger.Sizing = lambda contact, *rest: Sizing(0.5 * contact, *rest)  # type: ignore[assignment,misc]
    began = cpu_s()
    finger = own_finger.own_finger(cap(radius_mm), skin)
    touches, spent = {}, []
    for name in TEXTURES:
        both = finger.feel(Relief.read(find_texture(Path(name))))
        spent.append(cpu_s() - began)
        touches[name] = {
            which: {**felt.means, "in_contact": felt.contact_fraction}
            for which, felt in zip(("own", "round"), both, strict=True)
        }
    own_finger.Sizing = Sizing  # type: ignore[misc]
    return {
        "first texture CPU s": spent[0],
        "next textures CPU s": 0.5 * (spent[2] - spent[0]),
        "textures": touches,
    }


def lines(rows: dict[str, Any]) -> list[list[Any]]:
    """How far V, area and JND of each fingertip are from the round finger: range over the textures."""
    found = []
    for row, content in rows.items():
        felt = content["textures"]
        cells = [
            _ends([100.0 * (felt[name]["own"][key] / felt[name]["round"][key] - 1.0) for name in TEXTURES], 1)
            for key in ("roughness", "contact_area_mm2")
        ]
        by_own, by_round = (
            [_from_first(felt, name, which) for name in TEXTURES[1:]] for which in ("own", "round")
        )
        off = [one - other for one, other in zip(by_own, by_round, strict=True)]
        found.append([row, *cells, _ends(off, 2)])
    return found


def _from_first(felt: dict[str, Any], name: str, which: str) -> float:
    """JND of a texture from the first one, by one of the two fingers."""
    return jnd_apart(felt[name][which]["roughness"], felt[TEXTURES[0]][which]["roughness"])


def _ends(values: list[float], digits: int) -> str:
    return f"{min(values):+.{digits}f} to {max(values):+.{digits}f}"


def main() -> None:
    measures = {row: partial(measured, *kind) for row, kind in ROWS.items()}
    rows = rows_of(__doc__, "own_finger", "rows", measures)
    head = ("fingertip", "V, %", "contact area, %", "JND between textures")
    publish("touch", "own", table(head, lines(rows)))


if __name__ == "__main__":
    main()
