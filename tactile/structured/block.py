"""Hexahedra on a coarse mesh with nodes on the mirror planes, for `tactile.layer.elastic_layer`.

The elements are those of `tactile.structured.pixel_block`. Axes are (row, column, depth); depth runs from the
contact face (0) to the bonded face. Young's modulus is 1 in the base of the skin.
"""

import numpy as np

from relief.ground.arrays import Array
from tactile.layer.skin_layers import row_weights
from tactile.structured.side_release import Quarter


class CoarseBlock(Quarter):
    """Mesh of a quarter of the block, of `half` elements along half a side.

    Forces act on nodes, strains are those at the elements' centres.
    """

    @property
    def line(self) -> Array:
        """(half + 1,) node positions along an axis, mm."""
        return np.linspace(0.0, self.half_mm, self.half + 1)

    @property
    def shares(self) -> Array:
        """(half + 1, half + 1): forces act on the nodes."""
        return np.eye(self.half + 1)

    def reading(self, slope: bool, odd: bool) -> Array:
        """(half, half + 1) along an axis: value or slope at the elements' centres, of either parity."""
        near, far = np.eye(self.half, self.half + 1), np.eye(self.half, self.half + 1, 1)
        return (far - near) * (self.half / self.half_mm) if slope else 0.5 * (near + far)

    def at_depth(self, derivative: bool) -> Array:
        """(levels - 1,) weights of value or slope at the receptors, from the centres of rows of elements."""
        weights = np.zeros(len(self.levels))
        for row, weight in row_weights(self.levels, self.depth_mm, self.stack):
            thickness = self.levels[row + 1] - self.levels[row]
            weights[row : row + 2] += weight * (np.array([-1.0, 1.0]) / thickness if derivative else 0.5)
        return weights[:-1]


def depth_levels(depth_mm: float, thickness_mm: float, coarsest_mm: float) -> Array:
    """Node depths of a skin without layers, with the receptors at the centre of a row of elements.

    Args:
        depth_mm: receptor depth.
        thickness_mm: of the block.
        coarsest_mm: greatest thickness of a layer.
    """
    above = int(np.ceil(depth_mm / coarsest_mm - 0.5))
    fine = depth_mm / (above + 0.5)
    top = fine * np.arange(above + 2)
    top = top[top < thickness_mm - 0.25 * fine]
    if len(top) < above + 2:  # receptors next to the bone have an odd number of layers around them
        around = 1
        while (layer := 2.0 * (thickness_mm - depth_mm) / around) > min(coarsest_mm, 1.9 * depth_mm):
            around += 2
        first = depth_mm - 0.5 * layer
        above = int(np.ceil(first / coarsest_mm))
        return np.concatenate(
            (np.linspace(0.0, first, above + 1), np.linspace(first + layer, thickness_mm, (around + 1) // 2))
        )
    rest = int(np.ceil((thickness_mm - top[-1]) / coarsest_mm))
    return np.concatenate((top, np.linspace(top[-1], thickness_mm, rest + 1)[1:]))
