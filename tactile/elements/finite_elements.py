"""Finite elements: the skin block as an operator on pressures, the reference that other models are judged by.

    C p      = exact layer  p  +  T (free - sliding) T' p
    strain p = the same of the strain

The formula is the one of `tactile.layer.elastic_layer` (see `cosine_layer` beside it), on a mesh with a node
at every pixel or with 64 nodes a side. The block does not depend on the texture: its parity blocks with free
sides are condensed onto the nodes of the contact face once per skin and mesh, and kept on disk; a texture
costs some dense products after that. Elements err most under the shortest waves of pressure, which do not
feel the sides of the block; the same elements with sliding sides err alike, so the difference is free of this
error. T interpolates from the nodes of the mesh to the pixels, where contact is decided; where there is a
node at every pixel, T is the identity.
"""

from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.cache import fingerprint, is_cached
from tactile.layer.cosine_layer import Parity, modes_at_centres, sliding_layer
from tactile.layer.free_sides import FreeSidedLayer, FreeSides, free_sides
from tactile.layer.interpolation import lagrange
from tactile.layer.skin_layers import LEAST_ROWS, Stack, boundaries
from tactile.skin import Skin
from tactile.structured.pixel_block import PixelBlock

DECAY_AT_DEPTH = 8.0
"""Largest product of wavenumber and receptor depth for which strain is taken from the elements; shorter waves
of pressure are left to the exact layer. Little of them reaches the receptors: (1 + 8) exp(-8) = 0.3 %."""
FIRST_LAYER = 0.8
"""Thickness of the mesh's layer at the contact face, in pitches: about as thick as its elements are wide."""
GROWTH = 1.15
"""Ratio of the thicknesses of neighbouring layers, toward the bone."""
THICKEST_MM = 0.2
"""Greatest thickness of a row of elements, mm: a dozen and more in 2.5 mm of skin."""
THICKEST_LAYERED_MM = 0.1
"""Greatest thickness of a row of elements in a layered skin, mm, whose strain bends at the boundaries. With
0.4 mm of 4 MPa over 0.2 MPa, V of four reliefs falls by 0.7 to 1.5 % from rows of 0.2 mm to these rows,
toward V of the elastic layer."""
KIND = "finite-elements"
"""Name of these operators in the cache."""


class FiniteElementOperator(FreeSidedLayer):
    """Free-sided block of the skin, what its sides add by a fine mesh."""


def finite_element_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    mesh: int | None = None,
) -> FiniteElementOperator:
    """The operator of a skin on an n x n patch: built the first time, from disk after that.

    Args:
        skin: all but force and modulus matters here.
        samples: n.
        size_mm: side of the patch.
        dtype: of the operator's tensors.
        mesh: nodes along a side of the contact face, even; None: one at each pixel.

    Raises:
        ValueError: the mesh is odd.
    """
    nodes = samples if mesh is None else mesh
    if nodes % 2:
        raise ValueError("the mesh must be even: the block is split at its mirror planes")
    block = skin.at_unit_modulus()
    sides, layer = _free_sides(block, samples, size_mm, nodes), sliding_layer(block, samples, size_mm)
    return FiniteElementOperator(**vars(layer), free_sides=sides).to(dtype)


@lru_cache(maxsize=2)
def _free_sides(skin: Skin, n: int, size: float, nodes: int) -> FreeSides:
    half = nodes // 2
    cosines = modes_at_centres(nodes)[0][half:]

    def felt(parity: Parity) -> Array:
        row, column = np.divmod(_modes(nodes, size, skin.depth_mm, parity), nodes)
        # Orthonormal on the whole face, hence of length 1/2 on a quarter.
        return 2.0 * (cosines[:, None, row] * cosines[None, :, column]).reshape(half**2, -1)

    pixels, places = ((np.arange(k) + 0.5) / k for k in (n, nodes))
    mirrored = [np.concatenate((sign * np.eye(half)[::-1], np.eye(half))) for sign in (1.0, -1.0)]
    hats = lagrange(places, pixels, False) @ np.concatenate(mirrored, axis=1)
    return free_sides(
        KIND, _key(skin, nodes, size), lambda: _mesh(skin, size, nodes), felt, hats, hats, (size / n) ** 2
    )


def is_built(skin: Skin, nodes: int, size_mm: float) -> bool:
    """Whether the elements of a skin are in the cache on disk; arguments as of `finite_element_operator`."""
    return is_cached(KIND, _key(skin.at_unit_modulus(), nodes, float(size_mm)))


def _key(skin: Skin, nodes: int, size: float) -> dict[str, float | int | str]:
    return {"code": fingerprint(__name__), **skin.structure, "size": size, "nodes": nodes}


def _mesh(skin: Skin, size: float, nodes: int) -> PixelBlock:
    levels = graded_levels(skin.thickness_mm, size / nodes, skin.stack)
    return PixelBlock(size / 2.0, nodes // 2, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)


def graded_levels(thickness_mm: float, pitch_mm: float, stack: Stack = ()) -> Array:
    """Node depths: thin rows of elements at the contact face, growing toward the bone; one at each boundary.

    A layer of the skin has at least `LEAST_ROWS` rows, and starts with rows as thick as without layers.
    """
    levels, thickest = [np.zeros(1)], THICKEST_LAYERED_MM if stack else THICKEST_MM
    for end in (*boundaries(stack), thickness_mm):
        top = levels[-1][-1]
        first = FIRST_LAYER * pitch_mm + (GROWTH - 1.0) * top
        rows = [min(first, thickest, (end - top) / LEAST_ROWS) if stack else first]
        while sum(rows) < end - top:
            rows.append(min(GROWTH * rows[-1], thickest))
        depths = np.cumsum(rows)
        levels.append(top + depths * ((end - top) / depths[-1]))
    return np.concatenate(levels)


def _modes(n: int, size_mm: float, depth_mm: float, parity: Parity) -> NDArray[np.intp]:
    """Numbers (of n²) of the cosine modes of a parity that reach the receptors."""
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    reaching = np.pi / size_mm * np.hypot(row, column) <= DECAY_AT_DEPTH / depth_mm
    of_parity = (row % 2 == parity[0]) & (column % 2 == parity[1])
    return np.flatnonzero(reaching & of_parity)
