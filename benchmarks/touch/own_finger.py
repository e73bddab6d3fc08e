"""Spherical fingertips by `retouch evaluate --finger` beside the round finger of their radius.

python -m benchmarks.touch.own_finger            # what is missing in results/own_finger.json
python -m benchmarks.touch.own_finger --again    # all of it

Rows are radii of a cap 4 mm thick, with the homogeneous finger of 0.05 MPa at 1 N; `measured` is layered, and
`halved` has facets of half a pixel in place of one.
"""

from __future__ import annotations

import resource
from functools import partial
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np

import tactile
from benchmarks.shared.common import DOCS, again_given, kept, load, publish, table
from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from retouch.verbs.fingers import own_finger
from tactile.jnd import jnd_apart
from tactile.unstructured.meshing import Sizing

COMMAND = "benchmarks.touch.own_finger"
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
    began = _cpu_s()
    finger = own_finger.own_finger(cap(radius_mm), skin)
    touches, spent = {}, []
    for name in TEXTURES:
        both = finger.feel(Relief.read(find_texture(Path(name))))
        spent.append(_cpu_s() - began)
        touches[name] = {
            which: {**felt.means, "in_contact": felt.contact_fraction}
            for which, felt in zip(("own", "round"), both, strict=True)
        }
    own_finger.Sizing = Sizing  # type: ignore[misc]
    return {
        "radii mm": finger.skin.radii_mm,
        "square mm": finger.square_mm,
        "volume mm3": finger.surface.volume_mm3,
        "first texture CPU s": spent[0],
        "next textures CPU s": 0.5 * (spent[2] - spent[0]),
        "textures": touches,
    }


def _cpu_s() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def rows() -> list[list[Any]]:
    """How far V, area and JND of each fingertip are from the round finger: range over the textures."""
    found = []
    for row, content in load("own_finger")["rows"].items():
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
    again = again_given(__doc__)
    for row, (radius, kind) in ROWS.items():
        kept("own_finger", "rows", row, partial(measured, radius, kind), again)
    head = ("fingertip", "V, %", "contact area, %", "JND between textures")
    publish(DOCS / "evidence" / "touch.md", "own", COMMAND, table(head, rows()))


if __name__ == "__main__":
    main()
