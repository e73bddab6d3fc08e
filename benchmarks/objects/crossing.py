"""Bodies that cross themselves, felt as they are and after a union.

python -m benchmarks.objects.crossing [FOLDER]

Two balls in gravel that reach into one another, as two parts and united by Manifold. And the handle of which
benchmarks.objects.parts.handle_in_blender writes two files into a folder, as it is and united by Blender.
Roughness as pressed at the same places of both, and as `retouch evaluate` tells it of either at its own.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from manifold3d import Manifold, Mesh64

from benchmarks.objects.bundled import TEXTURE, roughness, tile_of
from benchmarks.shared.common import DOCS, load, machine, parser_of, put, save, table
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.solids.body import Body, Part, joined
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.meshes import self_intersections
from relief.solids.meshes.crops import Cropper
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.wrapped_body import Covering, wrap
from retouch.verbs.solid_evaluation import read_solid

PLACES, FACES, APART_MM = 100, 150_000, 22.0
"""Most places, triangles of a ball in gravel, and the distance of the balls, mm."""
RESULT, COMMAND = "crossing", "benchmarks.objects.crossing"


def two_balls(folder: Path) -> tuple[Path, Path]:
    """Files of two balls in gravel that cross, as two parts and as one."""
    ball = wrap(OBJECTS["ball"].make(), [Covering(tile_of(TEXTURE))], Settings(faces=FACES)).body
    other = Body(ball.vertices + np.array([APART_MM, 0.0, 0.0]), ball.faces)
    whole = _manifold(ball) + _manifold(other)
    mesh = whole.to_mesh64()
    united = Body(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))
    bodies = {"balls": joined([Part("", ball), Part("", other)]), "balls-united": united}
    one, two = (write_parts(folder / f"{name}.stl", [Part(name, body)]) for name, body in bodies.items())
    return one, two


def _manifold(body: Body) -> Manifold:
    return Manifold(Mesh64(body.vertices, body.faces.astype(np.uint64)))


def compared(crossing: Path, united: Path) -> dict[str, Any]:
    """Roughness of a body that crosses itself and of its union."""
    began = time.process_time()
    row: dict[str, Any] = {"faces": len(read_mesh(crossing).body.faces)}
    row["pairs"] = self_intersections(read_mesh(crossing).body)
    felt, meshes = {}, {}
    for name, file in (("crossing", crossing), ("united", united)):
        meshes[name] = read_solid(file)
        felt[name] = feel_of(meshes[name], load_skin("paper"), "layer", PLACES)
        row[f"told_{name}"] = felt[name].means["roughness"]
    frames = [crop.frame for crop in felt["united"].crops]
    both = {name: _pressed(mesh, frames) for name, mesh in meshes.items()}
    return row | {
        **{name: float(values.mean()) for name, values in both.items()},
        "most": float(np.abs(both["crossing"] / both["united"] - 1.0).max()),
        "places": len(frames),
        "cpu_s": time.process_time() - began,
    }


def _pressed(mesh: Mesh, frames: list[Any]) -> Any:
    cropper = Cropper(mesh.body)
    return roughness(np.stack([cropper.crop(frame).heights for frame in frames]))


def shown(content: dict[str, Any]) -> str:
    """The table of the page."""
    heads = [
        "body",
        "triangles",
        "crossing pairs",
        "V, crossing",
        "V, united",
        "off, %",
        "most at a place, %",
    ]
    heads += ["V told, crossing", "V told, united", "places"]
    rows = [
        (
            name,
            *(f"{row[key]:,}" for key in ("faces", "pairs")),
            *(f"{row[key]:.4f}" for key in ("crossing", "united")),
            f"{100 * (row['crossing'] / row['united'] - 1):+.2f}",
            f"{100 * row['most']:.2f}",
            *(f"{row[key]:.4f}" for key in ("told_crossing", "told_united")),
            row["places"],
        )
        for name, row in content["bodies"].items()
    ]
    return table(heads, rows) + "\n"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", metavar="FOLDER", help="with the files of the handle")
    folder = parser.parse_args().folder
    content = {"machine": machine(), "bodies": load(RESULT).get("bodies", {})}
    if folder is None:
        with TemporaryDirectory() as temporary:
            content["bodies"]["two balls in gravel"] = compared(*two_balls(Path(temporary)))
    else:
        files = folder / "handle.stl", folder / "handle-united.stl"
        content["bodies"]["handle of Blender"] = compared(*files)
    save(RESULT, content)
    put(DOCS / "evidence" / "objects.md", "crossing", COMMAND, shown(content))


if __name__ == "__main__":
    main()
