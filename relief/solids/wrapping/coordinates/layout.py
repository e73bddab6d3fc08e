"""Flat coordinates of a surface, mm: those of its triangles in one or several patches, with their shares."""

from dataclasses import dataclass, replace

import numpy as np

from relief.ground.arrays import Array, Flags, Index

SHARPNESS = 6
"""Power of the patches' shares inside of triangles. Shares change over strips of 2 mm, wider than triangles;
with this power about 0.4 mm of a strip are mixtures. Gravel feels rougher on wider ones."""


@dataclass(frozen=True)
class Layout:
    """Flat coordinates of the triangles of a body.

    Attributes:
        patch: (faces, k) numbers of the patches that a triangle belongs to; -1: none.
        uv: (faces, k, 3, 2) coordinates of the corners in mm, u to the right and v up.
        weight: (faces, k, 3) share of each patch at the corners; over k the sum is 1, or 0 without any.
        stretch: (faces,) largest relative change of a length in the leading patch.
        patches: Number of patches.
        around_mm: (patches,) circumferences of the body, mm, which are periods of u. Infinite for patches
            that are not periodic; None if none is.
    """

    patch: Index
    uv: Array
    weight: Array
    stretch: Array
    patches: int
    around_mm: Array | None = None

    def at(self, face: Index, share: Array) -> tuple[Array, Array]:
        """Coordinates (n, k, 2) of points in their patches, mm, and the patches' shares (n, k).

        Args:
            face: (n,) triangles that the points lie in.
            share: (n, 3) barycentric coordinates there.
        """
        uv = np.einsum("nc,nkcd->nkd", share, self.uv[face])
        weight = np.einsum("nc,nkc->nk", share, self.weight[face])
        # A corner without a patch of its triangle takes the coordinates of the other corners.
        bare = ~weight.any(axis=1)
        weight[bare] = self.weight[face[bare]].sum(axis=2)
        weight = weight**SHARPNESS
        weight[weight < 1e-6 * weight.max(axis=1, keepdims=True)] = 0.0
        return uv, shares_of(weight)

    def leading(self) -> Index:
        """(faces,) places among the patches of each triangle of the one with the largest share."""
        return np.asarray(np.argmax(self.weight.sum(axis=2), axis=1))

    def laid(self) -> Flags:
        """(faces,) whether any patch covers a triangle."""
        return np.asarray(self.weight.any(axis=(1, 2)))

    def moved(self, corners: Array, matrices: Array, shift: Array) -> "Layout":
        """The layout with other coordinates, and what these stretch.

        Args:
            corners: (faces, 3, 3) corners of the triangles, mm.
            matrices: (patches, 2, 2) or (1, 2, 2) for all, with which coordinates are multiplied.
            shift: (2,) translation after the multiplication, mm.
        """
        each = matrices[np.clip(self.patch, 0, len(matrices) - 1)]
        uv = np.einsum("fkij,fkcj->fkci", each, self.uv) + shift
        laid, leading = self.laid(), self.leading()
        stretch = np.zeros(len(uv))
        stretch[laid] = stretches(corners[laid], uv[laid, leading[laid]])
        return replace(self, uv=uv, stretch=stretch, around_mm=None)


def one_patch(inside: Flags, uv: Array, stretch: Array) -> Layout:
    """The layout of one patch over triangles (faces,), with uv (faces, 3, 2), mm, and stretches (faces,)."""
    weight = np.broadcast_to(inside.astype(np.float64)[:, None, None], (len(inside), 1, 3))
    return Layout(np.where(inside, 0, -1)[:, None], uv[:, None], weight, stretch, 1)


def shares_of(weight: Array) -> Array:
    """Weights (n, k, ...) as shares, whose sum over k is 1, or 0 where all weights are 0."""
    total = weight.sum(axis=1, keepdims=True)
    return np.divide(weight, total, out=np.zeros_like(weight), where=total > 0.0)


def stretches(corners: Array, uv: Array) -> Array:
    """Largest relative change of a length by flat coordinates, (n,).

    Args:
        corners: (n, 3, 3) corners of triangles, mm.
        uv: (n, 3, 2) coordinates of the corners, mm.
    """
    low, high = singular_values(corners, uv)
    return np.asarray(np.maximum(high - 1.0, 1.0 - low))


def singular_values(corners: Array, uv: Array) -> tuple[Array, Array]:
    """Least and greatest factor of a length by flat coordinates, (n,) each; the least below 0 if mirrored."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.maximum(np.linalg.norm(one, axis=1), 1e-12)
    x = (one * two).sum(axis=1) / length
    y = np.maximum(np.linalg.norm(np.cross(one, two), axis=1) / length, 1e-12)
    across = (uv[:, 1] - uv[:, 0]) / length[:, None]
    up = (uv[:, 2] - uv[:, 0] - across * x[:, None]) / y[:, None]
    square = (across**2).sum(axis=1) + (up**2).sum(axis=1)
    determinant = across[:, 0] * up[:, 1] - across[:, 1] * up[:, 0]
    sum_ = np.sqrt(np.maximum(square + 2.0 * determinant, 0.0))
    difference = np.sqrt(np.maximum(square - 2.0 * determinant, 0.0))
    return 0.5 * (sum_ - difference), 0.5 * (sum_ + difference)
