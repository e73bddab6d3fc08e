"""Fuzzy skin: walls whose points slicers move at random, as beads.

PrusaSlicer, SuperSlicer, OrcaSlicer and Bambu Studio share one law (Cura's): along an outer wall lie points
at distances that are uniform from 3/4 to 5/4 of the point distance; each is moved along the normal by an
amount that is uniform within plus and minus the thickness, and the nozzle goes straight from point to point.
The points of each layer are random; the width of the bead stays as it is, and the first layer is plain.
"""

import numpy as np

from relief.solids.filament.beads import Beads, Role
from relief.solids.meshes.mesh_places import Frame, frame_along

NEAREST, RANGE = 0.75, 0.5
"""Least distance of two points and the range of the distance, both in point distances."""


def fuzzy_wall(
    thickness_mm: float,
    point_distance_mm: float,
    width_mm: float,
    layer_mm: float,
    side_mm: float,
    patches: int,
    random: np.random.Generator,
) -> tuple[Beads, list[Frame]]:
    """A straight fuzzy wall, and places of fingers on it, side by side.

    The same generator gives the same points for every thickness, so that what is felt changes smoothly.

    Args:
        thickness_mm: of the fuzzy skin: the farthest that a point is moved either way.
        point_distance_mm: mean distance of points along the wall.
        width_mm: of the bead.
        layer_mm: height of a layer.
        side_mm: of the patch of a finger.
        patches: number of places.
        random: draws the points.

    Returns:
        The outer wall, which runs along x and faces -y, and frames of the places. The path of the nozzle
        without fuzzy skin is y = 0. Lengths of filament are 0.
    """
    half = 0.5 * side_mm * patches + width_mm
    layers = int(np.ceil((side_mm + 2.0 * width_mm) / layer_mm))
    # The wall begins ten points later, by when the distance to the next point is random.
    count = int(np.ceil(2.0 * half / (NEAREST * point_distance_mm))) + 12
    x = np.cumsum(point_distance_mm * (NEAREST + RANGE * random.random((layers, count))), axis=1)
    x -= half + 10.0 * point_distance_mm
    y = thickness_mm * random.uniform(-1.0, 1.0, x.shape)
    z = np.broadcast_to(layer_mm * np.arange(1.0, layers + 1.0)[:, None], x.shape)
    points = np.stack([x, y, z], axis=2)
    start, end = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
    some = (end[:, 0] > -half) & (start[:, 0] < half)
    of_each, kind = np.ones(some.sum()), np.full(some.sum(), Role.OUTER_WALL, np.uint8)
    layer = np.repeat(np.arange(layers), count - 1)[some]
    beads = Beads(start[some], end[some], width_mm * of_each, layer_mm * of_each, kind, layer, 0.0 * of_each)
    middle, outward = 0.5 * layer_mm * layers, np.array([0.0, -1.0, 0.0])
    places = side_mm * (np.arange(patches) - 0.5 * (patches - 1))
    return beads, [frame_along(np.array([at, -0.5 * width_mm, middle]), outward) for at in places]
