"""Hollow parts for masks: a cup with conical or cylindrical walls, a rounded foot and a rounded rim, and
prisms."""

import numpy as np
from manifold3d import CrossSection

from relief.ground.arrays import Array
from relief.solids.body import Body

FLOOR_MM = 2.0
"""Height of the floor inside, mm."""


def cup(
    rings: int = 2, tilt_deg: float = 4.7, radius: float = 9.0, height: float = 24.0, wall: float = 2.0
) -> Body:
    """A cup whose walls lean outward, with so many rings of vertices on each wall, mm."""
    tilt = np.radians(tilt_deg)
    up, out = np.array([np.sin(tilt), np.cos(tilt)]), np.array([np.cos(tilt), -np.sin(tilt)])
    # The section, as radius and height: fillet of the foot, outer wall, rim, inner wall, floor.
    section = _arc(np.array([radius - FLOOR_MM, FLOOR_MM]), FLOOR_MM, -0.5 * np.pi, -tilt, 3)
    rim_mm, steps = 0.5 * wall, np.linspace(0.0, 1.0, rings)[1:, None]
    top = section[-1] + up * (height - rim_mm - section[-1][1]) / up[1]
    section += list(section[-1] + steps * (top - section[-1]))
    section += _arc(top - rim_mm * out, rim_mm, -tilt, np.pi - tilt, 6)[1:]
    foot = section[-1] + up * (FLOOR_MM - section[-1][1]) / up[1]
    section += list(section[-1] + steps * (foot - section[-1]))
    return _revolved(np.array(section))


def _arc(middle: Array, radius: float, start: float, end: float, facets: int) -> list[Array]:
    angles = np.linspace(start, end, facets + 1)
    return [middle + radius * np.array([np.cos(angle), np.sin(angle)]) for angle in angles]


def _revolved(section: Array, sides: int = 48) -> Body:
    """The body of a section (n, 2) from one end of the axis to the other."""
    angles, rows = 2.0 * np.pi * np.arange(sides) / sides, len(section)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.column_stack([r * around, np.full(sides, z)]) for r, z in section]
    ends = [[0.0, 0.0, section[0, 1]], [0.0, 0.0, section[-1, 1]]]
    here = np.arange(sides) + sides * np.arange(rows)[:, None]
    beside = np.roll(here, -1, axis=1)
    below, above, middle = here[:-1], here[1:], np.full(sides, rows * sides)
    faces = [
        np.stack([below, beside[:-1], beside[1:]], axis=-1).reshape(-1, 3),
        np.stack([below, beside[1:], above], axis=-1).reshape(-1, 3),
        np.stack([middle, beside[0], here[0]], axis=-1),
        np.stack([here[-1], beside[-1], middle + 1], axis=-1),
    ]
    return Body(np.concatenate([*rings, ends]), np.concatenate(faces))


def extruded(section: Array, long_mm: float) -> Body:
    """A prism along y, around the origin, with a section (n, 2) in x and z, counter-clockwise."""
    mesh = CrossSection([section]).extrude(long_mm).to_mesh()
    x, z, y = np.asarray(mesh.vert_properties, float)[:, :3].T
    return Body(np.stack([x, 0.5 * long_mm - y, z], axis=1), np.asarray(mesh.tri_verts, np.int64))
