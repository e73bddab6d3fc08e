"""Top view: faces under points of the plate, the same whatever the heights."""

import numpy as np

from relief.ground.arrays import Array, Index
from visual.geometry.topology import PlateTopology


def face_at(plate: PlateTopology, x: Array, y: Array) -> Index:
    """Faces (points,) of the plate under points x, y (points,), mm."""
    across = _cell(plate.cols, plate.size_mm, plate.halo[1], x)
    down = _cell(plate.rows, plate.height_mm, plate.halo[0], -y)
    second = across[1] + down[1] >= 1.0
    return 2 * (down[0] * plate.cells[1] + across[0]) + second


def _cell(samples: int, size_mm: float, halo: int, position: Array) -> tuple[Index, Array]:
    """Cell of a coordinate, and share of the cell's width before it.

    Without a halo the outermost cells are half as wide.
    """
    last = samples + 2 * max(1, halo) - 2
    line = (position / size_mm + 0.5) * samples + (max(1, halo) - 0.5)
    cell = np.clip(np.floor(line).astype(np.int64), 0, last)
    within = line - cell
    if not halo:
        within = np.where(cell == 0, 2.0 * within - 1.0, np.where(cell == last, 2.0 * within, within))
    return cell, within
