"""STEP parts of the benchmark, from a CAD kernel: run from the root, by a Python that has `build123d` 0.13.

python -m benchmarks.objects.step.in_build123d FOLDER [NAME ...]

Each part is written as `NAME.step`, with its colours and names, and as `NAME.stl` at a usual tolerance of CAD
programs: `CHORD_MM` and `TURN` are the largest distance and angle between a facet and the surface. Lengths
are in mm, those of `inches` in inches.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from build123d import (
    Align,
    Axis,
    Box,
    Circle,
    Color,
    Compound,
    Cone,
    Cylinder,
    Plane,
    Polyline,
    Pos,
    RectangleRounded,
    Sphere,
    Spline,
    Torus,
    Unit,
    chamfer,
    export_step,
    export_stl,
    extrude,
    fillet,
    loft,
    make_face,
    revolve,
)

ON_BED = (Align.CENTER, Align.CENTER, Align.MIN)
"""Solids stand on z = 0."""
CHORD_MM, TURN = 0.1, 0.5
"""Tolerances of the STL, mm and rad: what programs call medium."""


def knob() -> Any:
    """A turned knob of 30 mm with fillets of 3 mm and 1 mm and a D-shaped bore."""
    part = Cylinder(15, 18, align=ON_BED)
    part = fillet(part.edges().sort_by(Axis.Z)[-1], 3)
    part = fillet(part.edges().sort_by(Axis.Z)[0], 1)
    return part - (Cylinder(3, 12, align=ON_BED) - Pos(4.5, 0, 0) * Box(4, 8, 12, align=ON_BED))


def bracket() -> Any:
    """A plate and a wall with a fillet of 4 mm between, and one of 1 mm on top of the wall."""
    outline = Polyline((0, 0), (30, 0), (30, 4), (4, 4), (4, 22), (0, 22), close=True)
    part = extrude(Plane.XZ * make_face(outline), -24)
    inside = [e for e in part.edges() if abs(e.center().X - 4) + abs(e.center().Z - 4) < 1e-6]
    part = fillet(inside, 4)
    top = [e for e in part.edges() if abs(e.center().Z - 22) < 1e-6 and abs(e.center().X - 4) < 1e-6]
    return fillet(top, 1)


def bottle() -> Any:
    """A solid of revolution with planes, cylinders, a cone and fillets."""
    outline = Polyline((0, 0), (18, 0), (18, 25), (8, 40), (8, 50), (0, 50), close=True)
    part = revolve(Plane.XZ * make_face(outline), Axis.Z)
    at = lambda radius, z: [  # noqa: E731
        e for e in part.edges() if abs(e.center().Z - z) < 1e-6 and abs(e.length / 6.2831853 - radius) < 1e-3
    ]
    part = fillet([*at(18, 25), *at(8, 40)], 4)
    return fillet(at(18, 0), 2)


def ring() -> Any:
    """A torus that stands on its side in no axis's plane: 20 mm and 5 mm."""
    return Pos(0, 0, 12) * Plane((0, 0, 0), z_dir=(1, 0.5, 2)).location * Torus(20, 5)


def cone() -> Any:
    """A blunt cone with a bore along its axis and one across."""
    part = Cone(18, 8, 30, align=ON_BED) - Cylinder(4, 30, align=ON_BED)
    return part - Pos(0, 0, 12) * Plane.YZ.location * Cylinder(3, 40)


def chamfers() -> Any:
    """A box with chamfers of 2 mm along all edges of its top and of 5 mm along its uprights."""
    part = Box(36, 26, 18, align=ON_BED)
    part = chamfer(part.edges().filter_by(Axis.Z), 5)
    return chamfer(part.faces().sort_by(Axis.Z)[-1].edges(), 2)


def pin() -> Any:
    """A cylinder with half a sphere of its radius on it: a pole, seams, and an edge that is none."""
    return Cylinder(8, 25, align=ON_BED) + Pos(0, 0, 25) * Sphere(8)


def pair() -> Any:
    """An assembly of a red cap and a blue base, apart from one another, each turned in its own place."""
    cap = Cylinder(10, 12, align=ON_BED)
    cap = fillet(cap.edges().sort_by(Axis.Z)[-1], 2)
    cap.label, cap.color = "cap", Color(1.0, 0.0, 0.0)
    base = Box(24, 24, 8, align=ON_BED)
    base.label, base.color = "base", Color(0.0, 0.0, 1.0)
    return Compound(label="pair", children=[Pos(-16, 0, 0) * cap, Pos(16, 0, 0) * base])


def inches() -> Any:
    """A plate of 1.5 x 1 x 0.25 inches with round uprights of 0.25 inches."""
    return extrude(RectangleRounded(1.5, 1.0, 0.25), 0.25)


def free_form() -> Any:
    """A lofted handle, whose side is a B-spline, with a wavy bump of a spline beside it."""
    sections = [Circle(8), Pos(0, 0, 20) * RectangleRounded(22, 12, 4), Pos(0, 0, 40) * Circle(6)]
    body = loft(sections)
    outline = Spline((-20, 0), (-8, 5), (4, 3), (20, 0))
    wave = make_face([outline, Polyline((20, 0), (20, -6), (-20, -6), (-20, 0))])
    return Compound(children=[body, Pos(0, 30, 6) * extrude(Plane.XZ * wave, 12)])


PARTS: dict[str, Callable[[], Any]] = {
    each.__name__: each
    for each in (knob, bracket, bottle, ring, cone, chamfers, pin, pair, inches, free_form)
}


def main() -> None:
    folder = Path(sys.argv[1])
    for name in sys.argv[2:] or PARTS:
        part = PARTS[name]()
        export_step(part, folder / f"{name}.step", unit=Unit.IN if name == "inches" else Unit.MM)
        export_stl(part, folder / f"{name}.stl", tolerance=CHORD_MM, angular_tolerance=TURN)
        print(name, part.is_valid, f"{part.volume:.1f} mm3", len(part.faces()), "faces")


if __name__ == "__main__":
    main()
