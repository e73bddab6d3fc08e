"""Hexahedra with a node of the contact face at every pixel centre, for `tactile.elements.finite_elements`.

Integration is selectively reduced: the volumetric part at one point, the rest at eight, because plain
trilinear elements lock at nu = 0.48. Pixels are centred half a pitch off the mirror planes, so an element
straddles each plane. Under a load that is even or odd about the plane, the element's far node moves like plus
or minus its near node; the far node is a ghost that is folded back, and a quarter of the block stands for the
whole.

Axes are (row, column, depth); depth runs from the contact face (0) to the bonded face. Young's modulus is 1
in the base of the skin.
"""

import numpy as np

from relief.ground.arrays import Array
from tactile.layer.interpolation import STENCIL, lagrange
from tactile.layer.skin_layers import levels_within
from tactile.structured.side_release import Quarter


class PixelBlock(Quarter):
    """Mesh of a quarter of the block, of `half` pixels along half a side."""

    straddling = True

    @property
    def pitch_mm(self) -> float:
        """Side of a pixel."""
        return self.half_mm / self.half

    def at_depth(self, derivative: bool) -> Array:
        """(levels - 1,) weights of the value or the slope at the receptors, from the nodes of their layer."""
        weights, here = np.zeros(len(self.levels)), levels_within(self.levels, self.depth_mm, self.stack)
        weights[here] = lagrange(self.levels[here], np.array([self.depth_mm]), derivative)[0]
        # The bonded level does not move, so its column is left out.
        return weights[:-1]

    @property
    def line(self) -> Array:
        """(half + 2,) node positions along an axis: the ghost, the pixel centres, the side."""
        return np.append((np.arange(self.half + 1) - 0.5) * self.pitch_mm, self.half_mm)

    @property
    def shares(self) -> Array:
        """(half + 1, half) along an axis: the nodes' shares of the pixels' forces.

        A pixel's force acts at the pixel's centre; of a pixel at the rim, a quarter of the force acts at the
        side, as under uniform pressure.
        """
        shares = np.eye(self.half + 1, self.half)
        shares[-2:, -1] = 0.75, 0.25
        return shares

    def reading(self, slope: bool, odd: bool) -> Array:
        """(half, half + 1) along an axis: value or slope of an even or odd field at the pixel centres."""
        if not slope:
            return np.eye(self.half, self.half + 1)
        mirrored = STENCIL // 2
        inner = self.line[1:]
        extended = np.concatenate((-inner[:mirrored][::-1], inner))
        full = lagrange(extended, inner[:-1], True)
        result = full[:, mirrored:].copy()
        result[:, :mirrored] += (-1.0 if odd else 1.0) * full[:, mirrored - 1 :: -1][:, :mirrored]
        return result
