"""The button of the guide: a disc with a domed top, as a badge is put on.

python -m benchmarks.objects.guide.button FILE

Lengths are in mm. The button is 36 mm wide and 8.2 mm high, and its edge above is rounded.
"""

import sys
from pathlib import Path

import numpy as np
import trimesh

from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts

RADIUS_MM, DOME_MM, ROUND_MM, RIM_MM = 18.0, 36.0, 1.5, 2.5
"""Radii of the button, the ball of its top and its edge, mm, and the height at which the edge begins."""
SECTIONS = 128
"""Facets around; `retouch wrap` makes even triangles of them, however many there are."""


def button() -> trimesh.Trimesh:
    """The profile, a circle that touches both the upright side and the ball of the top, turned about z."""
    across = RADIUS_MM - ROUND_MM
    middle = RIM_MM - np.sqrt((DOME_MM - ROUND_MM) ** 2 - across**2)
    steepest = np.arcsin(across / (DOME_MM - ROUND_MM))
    edge, top = np.linspace(np.pi / 2.0, steepest, 9), np.linspace(steepest, 0.0, 9)[1:]
    profile = [
        np.array([[0.0, 0.0], [RADIUS_MM, 0.0]]),
        np.stack([across + ROUND_MM * np.sin(edge), RIM_MM + ROUND_MM * np.cos(edge)], axis=1),
        np.stack([DOME_MM * np.sin(top), middle + DOME_MM * np.cos(top)], axis=1),
    ]
    mesh: trimesh.Trimesh = trimesh.creation.revolve(np.concatenate(profile), sections=SECTIONS)
    return mesh


def main() -> None:
    mesh = button()
    write_parts(
        Path(sys.argv[1]), [Part("button", Body(np.array(mesh.vertices, dtype=np.float64), mesh.faces))]
    )


if __name__ == "__main__":
    main()
