"""Parts of the benchmark from a CAD kernel: run from the root, by a Python that has `build123d` 0.13.

python -m benchmarks.objects.parts.in_build123d FOLDER [NAME ...]

Each part is exported twice: `NAME.3mf` at 0.02 mm and 0.15 rad, `NAME-fine.3mf` at 0.002 mm and 0.05 rad, the
largest distance and angle between a facet and the surface. Lengths are in mm.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from build123d import (
    Align,
    Axis,
    Box,
    Circle,
    Cylinder,
    Ellipse,
    Helix,
    Line,
    Plane,
    Polyline,
    Pos,
    RectangleRounded,
    RegularPolygon,
    Rot,
    SlotCenterToCenter,
    Spline,
    Text,
    Transition,
    export_stl,
    extrude,
    fillet,
    loft,
    make_face,
    revolve,
    sweep,
)

from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.files import read_mesh

ON_BED = (Align.CENTER, Align.CENTER, Align.MIN)
"""Solids stand on z = 0."""
TOLERANCES = {"": (0.02, 0.15), "-fine": (0.002, 0.05)}
"""Largest distance, mm, and angle, rad, of facets, by what is added to the name."""


def round_edges(part: Any, at: Callable[[Any], bool], radius: float) -> Any:
    """The part with the edges that a condition names rounded, inside and outside ones alike."""
    return fillet(part.edges().filter_by(at), radius)


def at_height(z: float) -> Callable[[Any], bool]:
    """Whether an edge lies all at a height."""
    return lambda edge: (
        all(abs(vertex.Z - z) < 1e-6 for vertex in edge.vertices()) and (abs(edge.center().Z - z) < 1e-6)
    )


def knob() -> Any:
    """A turned knob: 25 mm wide, 16 mm high, fillets of 2 mm and 1 mm, a D-shaped bore of 6 mm."""
    part = Cylinder(12.5, 16, align=ON_BED)
    part = round_edges(part, at_height(16), 2)
    part = round_edges(part, at_height(0), 1)
    bore = Cylinder(3, 12, align=ON_BED) - Pos(4.5, 0, 0) * Box(4, 8, 12, align=ON_BED)
    return part - bore


def bracket(radius: float) -> Any:
    """A plate 30 x 24 x 4 and a wall 4 x 24 x 22, with a fillet in the inside corner."""
    outline = Polyline((0, 0), (30, 0), (30, 4), (4, 4), (4, 22), (0, 22), close=True)
    part = extrude(Plane.XZ * make_face(outline), -24)
    return round_edges(part, lambda edge: abs(edge.center().X - 4) + abs(edge.center().Z - 4) < 1e-6, radius)


def block() -> Any:
    """A block 30 x 30 x 10 with a bore of 8 mm."""
    return Box(30, 30, 10, align=ON_BED) - Cylinder(4, 10, align=ON_BED)


def tray() -> Any:
    """A rounded block with a pocket whose inside corners and floor have fillets of 3 mm."""
    part = extrude(RectangleRounded(44, 32, 6), 12)
    pocket = Pos(0, 0, 5) * extrude(RectangleRounded(36, 24, 4), 12)
    return part - round_edges(pocket, at_height(5), 3)


def ribs() -> Any:
    """A plate 40 x 30 x 4 with four ribs, 3 mm wide and 5 mm high, and fillets of 0.5 mm at their feet."""
    part = Box(40, 30, 4, align=ON_BED)
    for x in (-15, -5, 5, 15):
        part += Pos(x, 0, 4) * Box(3, 24, 5, align=ON_BED)
    return round_edges(part, lambda edge: at_height(4)(edge) and abs(edge.center().Y) < 12.5, 0.5)


def label() -> Any:
    """A plate 46 x 22 x 4 with rounded corners and raised letters, 1.5 mm high."""
    return extrude(RectangleRounded(46, 22, 4), 4) + Pos(0, 0, 4) * extrude(Text("Retouch", 10), 1.5)


def bolt() -> Any:
    """A hexagonal head of 22 mm with a bolt of 14 mm and a thread of 3 mm pitch."""
    head = extrude(RegularPolygon(12, 6), 9)
    path = Helix(3, 18, 7)
    tooth = Plane(path @ 0, z_dir=path % 0) * make_face(
        Polyline((-1.0, -0.6), (-1.0, 0.6), (0.8, 0.15), (0.8, -0.15), close=True)
    )
    thread = sweep(tooth, path=path, is_frenet=True)
    return head + Pos(0, 0, 9) * Cylinder(7, 24, align=ON_BED) + Pos(0, 0, 12) * thread


def flange() -> Any:
    """A disc of 44 mm with a hub, a fillet of 4 mm between them, a bore of 12 and four of 4 mm."""
    part = Cylinder(22, 5, align=ON_BED) + Cylinder(11, 18, align=ON_BED)
    part = round_edges(part, lambda edge: at_height(5)(edge) and edge.radius < 12, 4)
    part -= Cylinder(6, 18, align=ON_BED)
    for turn in range(4):
        part -= Rot(0, 0, 45 + 90 * turn) * Pos(17, 0, 0) * Cylinder(2, 5, align=ON_BED)
    return part


def grip() -> Any:
    """A turned handle, 70 mm long, bulging from 18 to 30 mm, with a blind bore of 8 mm."""
    side = Spline((9, 0), (15, 22), (11, 45), (13, 70), tangents=((0.3, 1), (0, 1)))
    rim = Polyline((13, 70), (0, 70), (0, 0), (9, 0))
    part = revolve(Plane.XZ * make_face([*side.edges(), *rim.edges()]), Axis.Z)
    part = round_edges(part, at_height(70), 3)
    return part - Cylinder(4, 30, align=ON_BED)


def elbow() -> Any:
    """A bent pipe, 22 mm wide with a bore of 12 mm and a bend of 20 mm radius."""
    path = Line((0, 0, 0), (0, 0, 15)) + Spline(
        (0, 0, 15), (5.86, 0, 29.14), (20, 0, 35), tangents=((0, 0, 1), (1, 0, 0))
    )
    path += Line((20, 0, 35), (35, 0, 35))
    return sweep(Circle(11) - Circle(6), path=path, transition=Transition.ROUND)


def case() -> Any:
    """An open box with walls of 3 mm, fillets of 1 mm inside, and four bosses with bores of 3 mm."""
    part = extrude(RectangleRounded(46, 36, 5), 16)
    hollow = Pos(0, 0, 3) * extrude(RectangleRounded(40, 30, 2), 14)
    part -= round_edges(hollow, at_height(3), 1)
    for x in (-15, 15):
        for y in (-10, 10):
            boss = Cylinder(4, 10, align=ON_BED) - Pos(0, 0, 2) * Cylinder(1.5, 10, align=ON_BED)
            part += Pos(x, y, 2) * boss
    return part


def lever() -> Any:
    """A link between two eyes with bores of 10 and 5 mm, fillets of 6 mm between, and a pocket."""
    part = Cylinder(11, 12, align=ON_BED) + Pos(44, 0, 0) * Cylinder(7, 12, align=ON_BED)
    part += Pos(22, 0, 0) * Box(44, 9, 8, align=ON_BED)
    upright = [edge for edge in part.edges().filter_by(Axis.Z) if 8 < edge.center().X < 40]
    part = fillet(upright, 6)
    part -= Cylinder(5, 12, align=ON_BED)
    part -= Pos(44, 0, 0) * Cylinder(2.5, 12, align=ON_BED)
    return part - Pos(24, 0, 5) * extrude(SlotCenterToCenter(12, 4), 4)


def dial() -> Any:
    """A dial of 36 mm with twelve flutes of 3 mm radius, rounded by 1.5 mm above, and a bore of 6 mm."""
    outline = Circle(18)
    for turn in range(12):
        outline -= Rot(0, 0, 30 * turn) * Pos(19.5, 0) * Circle(3)
    outline = fillet(outline.vertices(), 1.5)
    part = round_edges(extrude(outline, 14), at_height(14), 1.5)
    return part - Cylinder(3, 10, align=ON_BED)


def mouse() -> Any:
    """A loft from an ellipse to a smaller one, edges rounded by 4 mm: free-form, with no plane but two."""
    levels = ((0, 0, 28, 17), (2, 10, 25, 15), (5, 20, 17, 9))
    part = loft([(Pos(x, 0, z) * Ellipse(*radii)).face() for x, z, *radii in levels])
    return round_edges(part, at_height(20), 4)


PARTS: dict[str, Callable[[], Any]] = {
    "knob": knob,
    "bracket-1": lambda: bracket(1),
    "bracket-4": lambda: bracket(4),
    "block": block,
    "tray": tray,
    "ribs": ribs,
    "label": label,
    "bolt": bolt,
    "flange": flange,
    "grip": grip,
    "elbow": elbow,
    "case": case,
    "lever": lever,
    "dial": dial,
    "mouse": mouse,
}


def main() -> None:
    folder = Path(sys.argv[1])
    for name in sys.argv[2:] or PARTS:
        part = PARTS[name]()
        for suffix, (distance, angle) in TOLERANCES.items():
            with tempfile.TemporaryDirectory() as where:
                file = Path(where, f"{name}.stl")
                export_stl(part, file, tolerance=distance, angular_tolerance=angle)
                body = read_mesh(file).body
            path = write_parts(folder / f"{name}{suffix}.3mf", [Part(name, body)])
            print(f"{path}: {len(body.faces)} triangles, {path.stat().st_size // 1024} KiB", flush=True)


if __name__ == "__main__":
    main()
