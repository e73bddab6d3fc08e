"""Grain along and across objects: its direction, its seams and its size, and a picture of them.

python -m benchmarks.objects.direction    # about 15 minutes; writes docs/images/direction.png too

Bark has its grain from the bottom to the top of the tile. Each part is wrapped without a direction by
patches, then with the grain along its axis and across. Told are

* the angle between the grain and the direction wanted, as far as that lies in the surface, by area;
* the part of the surface on which patches or charts that do not fit are mixed (seams), and by how much their
  heights differ where they meet half and half: root mean square, in that of two places by chance;
* the roughness of places with a seam within 2.5 mm against places without, in just-noticeable differences
  with the standard error, by 60 places at most as `retouch evaluate --object` feels them;
* the part of the area on which lengths are off by a tenth or more, and the most on 99 % of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from benchmarks.objects.bundled import tile_of
from benchmarks.objects.direction_figure import sheet, shown
from benchmarks.shared.common import DOCS, IMAGES, ROOT, machine, publish, save, table
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.files import read_mesh
from relief.solids.files.mesh import Mesh
from relief.solids.objects.implicit import body_of
from relief.solids.objects.smooth import ball
from relief.solids.objects.swept import cylinder
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.laying import Laid, TexturePlacer
from relief.solids.wrapping.options import PlacingOptions
from relief.solids.wrapping.placement import placement_of
from relief.solids.wrapping.surfaces import BaseSurface
from relief.solids.wrapping.texture_tiles import Covering
from relief.solids.wrapping.wrapped_body import Wrapped, wrap
from tactile.jnd import ROUGHNESS_JND

COMMAND = "benchmarks.objects.direction"
PAGE = DOCS / "evidence" / "objects.md"
IMAGE = IMAGES / "direction.png"
TEXTURE, FACES, PLACES = "bark-tile", 250_000, 60
NEAR_MM = 2.5
"""Distance from a place within which a seam counts as felt there, mm."""
TORUS_MM, CONE = (18.0, 7.0), 0.011
"""Radii of the torus, mm, and by how much the cone narrows for each mm of its height."""
BOX_MM, FILLET_MM = (20.0, 12.0, 9.0), 4.0
"""Half the sides of the box, and its fillets, mm."""
HEAD = (
    *("part", "options", "by", "grain off, degrees: median", "95 %", "seams, %", "their difference"),
    *("V on seams, JND", "places on and off", "lengths off, %", "most, %", "CPU s"),
)


class Case(NamedTuple):
    """A part with its texture: options of `placement_of`, and where the grain is to run, (3,)."""

    part: str
    name: str
    options: dict[str, Any]
    grain: tuple[float, float, float]
    across: bool = False


def torus() -> Body:
    """A ring about z."""
    wide, thick = TORUS_MM
    reach = np.array([wide + thick, wide + thick, thick])
    return body_of(
        lambda at: np.hypot(np.hypot(at[:, 0], at[:, 1]) - wide, at[:, 2]) - thick, -reach, reach, 1.0
    )


def filleted_box() -> Body:
    """A box with round edges."""
    inner = np.array(BOX_MM) - FILLET_MM

    def field(at: Array) -> Array:
        beyond = np.abs(at) - inner
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0) - FILLET_MM)

    return body_of(field, -np.array(BOX_MM), np.array(BOX_MM), 1.0)


def cone() -> Body:
    """A cylinder that narrows to its top."""
    straight = cylinder(14.0, 40.0, 1.0)
    narrow = 1.0 - CONE * straight.vertices[:, 2:]
    return Body(straight.vertices * np.hstack([narrow, narrow, np.ones_like(narrow)]), straight.faces)


PARTS: dict[str, Callable[[], Body]] = {
    "cylinder": lambda: cylinder(10.0, 40.0, 1.0),
    "cone": cone,
    "ball": lambda: ball(15.0, 1.0),
    "torus": torus,
    "box": filleted_box,
    "knob": lambda: read_mesh(ROOT / "benchmarks" / "objects" / "parts" / "knob.3mf").body,
}


def cases() -> list[Case]:
    """Each part by patches, with the grain along its axis and across; cone and ball by their shapes too."""
    found = []
    for part in PARTS:
        name: str = "x" if part == "box" else "z"
        axis = (1.0, 0.0, 0.0) if part == "box" else (0.0, 0.0, 1.0)
        found += [
            Case(part, "--projection patches", {"projection": "patches"}, axis),
            Case(part, f"--along {name}", {"along": name}, axis),
            Case(part, f"--along {name} --turn 90", {"along": name, "turn_deg": 90.0}, axis, across=True),
        ]
        if part in ("cone", "ball"):
            shape = {"cone": "cylinder", "ball": "sphere"}[part]
            found.append(Case(part, f"--projection {shape}", {"projection": shape}, axis))
    return found


def measured(case: Case) -> tuple[dict[str, Any], Body]:
    """The numbers of a case, and the wrapped body."""
    bare, covering = PARTS[case.part](), Covering(tile_of(TEXTURE))
    placement, settings = placement_of(PlacingOptions(**case.options)), Settings(faces=FACES)
    began = time.process_time()
    wrapped = wrap(bare, [covering], settings, placement=placement)
    seconds = time.process_time() - began
    base = BaseSurface(FileSurface(bare, None, {}, settings))
    (laid,) = TexturePlacer(base, placement, settings.falloff_mm).laid([covering])
    off = grain_off(base, laid, np.array(case.grain), case.across)
    row = {
        "by": wrapped.coordinates,
        "grain_off_deg": {"median": off[0], "95": off[1]},
        "seams_percent": 100.0 * wrapped.blended,
        "difference": difference(laid),
        **on_and_off_seams(bare, wrapped),
        "off_size_percent": 100.0 * wrapped.off_size,
        "stretch_percent": 100.0 * wrapped.stretch,
        "notes": list(wrapped.notes),
        "cpu_s": seconds,
    }
    return row, wrapped.body


def grain_off(base: BaseSurface, laid: Laid, wanted: Array, across: bool) -> tuple[float, float]:
    """Median and 95 % of the angles, degrees, between the grain and where it is to run, by area.

    Places at which less than half of the direction lies in the surface are left out.
    """
    faces = laid.layout.laid()
    corners, areas = base.body.vertices[base.body.faces[faces]], base.body.areas[faces]
    uv = laid.layout.uv[faces, laid.layout.leading()[faces]]
    to_space = np.linalg.pinv(np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=1))
    top = np.einsum("nk,nkd->nd", to_space[:, 1], corners[:, 1:] - corners[:, :1])
    normals = base.body.normals[faces] / (2.0 * areas[:, None])
    goal = wanted - (normals @ wanted)[:, None] * normals
    clear = np.linalg.norm(goal, axis=1) > 0.5
    goal = np.cross(normals, goal) if across else goal
    cosine = np.abs((top * goal).sum(axis=1)) / np.maximum(
        np.linalg.norm(top, axis=1) * np.linalg.norm(goal, axis=1), 1e-12
    )
    angle = np.degrees(np.arccos(np.clip(cosine[clear], 0.0, 1.0)))
    order = np.argsort(angle)
    passed = np.cumsum(areas[clear][order]) / areas[clear].sum()
    median, most = (float(angle[order][np.searchsorted(passed, share)]) for share in (0.5, 0.95))
    return median, most


def difference(laid: Laid) -> float | None:
    """Root mean square difference of the heights of two patches, where each has a weight of a third or more.

    The unit is the same difference of two random places; None without two patches that meet.
    """
    layout, tile = laid.layout, laid.covering.tile
    if layout.weight.shape[1] < 2:
        return None
    mean = layout.weight.mean(axis=2)
    first, second = np.argsort(-mean, axis=1)[:, :2].T
    rows = np.flatnonzero(np.take_along_axis(mean, second[:, None], axis=1)[:, 0] > 1.0 / 3.0)
    if not len(rows):
        return None
    one, other = (tile.at(layout.uv[rows, slot[rows]].mean(axis=1)) for slot in (first, second))
    return float(np.sqrt(np.mean((one - other) ** 2)) / (np.sqrt(2.0) * tile.heights.std()))


def on_and_off_seams(bare: Body, wrapped: Wrapped) -> dict[str, Any]:
    """Roughness of places with a seam near them against those without, in just-noticeable differences."""
    meshes = (Mesh(body, None, Path("part")) for body in (wrapped.body, bare))
    nothing = {"seam_jnd": None, "seam_error_jnd": None, "places": [0, 0]}
    try:
        felt = feel_of(next(meshes), load_skin("paper"), "layer", PLACES, next(meshes))
    except InputError:
        return nothing
    at = np.array([crop.frame.at for crop in felt.crops])
    rough = np.log(felt.values["roughness"]) / np.log(ROUGHNESS_JND)
    seams = wrapped.original.vertices[wrapped.seams & (wrapped.textured > 0.5)]
    on: NDArray[np.bool_] = np.zeros(len(at), bool)
    if len(seams):
        on = cKDTree(seams).query(at)[0] < NEAR_MM
    counts = [int(on.sum()), int((~on).sum())]
    if min(counts) < 3:
        return nothing | {"places": counts}
    errors = [rough[part].std(ddof=1) / np.sqrt(part.sum()) for part in (on, ~on)]
    apart = float(rough[on].mean() - rough[~on].mean())
    return {"seam_jnd": apart, "seam_error_jnd": float(np.hypot(*errors)), "places": counts}


def main() -> None:
    rows: dict[str, dict[str, Any]] = {}
    pictures: dict[str, list[Image.Image]] = {}
    for case in cases():
        row, body = measured(case)
        rows.setdefault(case.part, {})[case.name] = row
        print(case.part, case.name, row, flush=True)
        pictures.setdefault(case.part, []).append(shown(body))
    save("direction", {"texture": TEXTURE, "faces": FACES, "rows": rows, "machine": machine()})
    sheet(pictures).save(IMAGE, optimize=True)
    publish(PAGE, "direction", COMMAND, as_text(rows))


def as_text(rows: dict[str, dict[str, Any]]) -> str:
    """The table of the page."""
    lines = []
    for part, options in rows.items():
        for name, row in options.items():
            apart, error = row["seam_jnd"], row["seam_error_jnd"]
            lines.append(
                (
                    *(part, f"`{name}`", row["by"]),
                    *(f"{row['grain_off_deg'][key]:.0f}" for key in ("median", "95")),
                    *(f"{row['seams_percent']:.1f}", row["difference"]),
                    "-" if apart is None else f"{apart:+.2f} ± {error:.2f}",
                    " / ".join(str(count) for count in row["places"]),
                    *(f"{row[key]:.0f}" for key in ("off_size_percent", "stretch_percent", "cpu_s")),
                )
            )
    return table(HEAD, lines)


if __name__ == "__main__":
    main()
