"""Top view: faces under points of the plate, the same whatever the heights."""

import numpy as np

from relief.arrays import Array, Index
from visual.geometry.topology import PlateTopology


def face_at(plate: PlateTopology, x: Array, y: Array) -> Index:
    """Faces (points,) of the plate under points x, y (points,), mm."""
    across, down = _cell(plate.cols, plate.size_mm, x), _cell(plate.rows, plate.size_mm, -y)
    second = across[1] + down[1] >= 1.0
    return 2 * (down[0] * (plate.cols + 1) + across[0]) + second


def _cell(samples: int, size_mm: float, position: Array) -> tuple[Index, Array]:
    """Cell of a coordinate, and share of the cell's width before it; outermost cells are half as wide."""
    line = (position / size_mm + 0.5) * samples + 0.5
    cell = np.clip(np.floor(line).astype(np.int64), 0, samples)
    within = line - cell
    within = np.where(cell == 0, 2.0 * within - 1.0, np.where(cell == samples, 2.0 * within, within))
    return cell, within
