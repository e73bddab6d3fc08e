"""Elastic layer with free sides: the skin block as an operator on pressures, by exact layer and coarse mesh.

    C p      = exact layer  p  +  R (free - sliding) R' p
    strain p = exact layer strain p  +  Q (free - sliding) R' p

The formula is the one of `tactile.elements.finite_elements` (see `cosine_layer` beside it), on a mesh of 32 x
32 elements instead of 64 x 64 nodes. What the free sides add is smooth, because a nearly incompressible block
squeezes out through its sides as a whole, so linear interpolation (R from nodes, Q from the elements'
centres) serves. All operators are for unit Young's modulus: pressures are in units of E, so that one set
serves every modulus and force.
"""

from functools import lru_cache

import numpy as np
import torch

from relief.ground.cache import fingerprint, is_cached
from tactile.layer.cosine_layer import sliding_layer
from tactile.layer.free_sides import FreeSidedLayer, FreeSides, free_sides
from tactile.layer.interpolation import mirrored_centres, mirrored_hats
from tactile.layer.skin_layers import even_levels
from tactile.skin import Skin
from tactile.structured.block import CoarseBlock, depth_levels

KIND = "elastic-layer"
"""Name of the coarse part in the cache."""

COARSE_ELEMENTS = 32
"""Elements along a side of the coarse mesh: V differs by at most 0.23 % from V with 48."""

COARSE_LAYER_MM = 0.27
"""Greatest thickness of the coarse mesh's layers, mm: nine or ten of them in 2.5 mm of skin."""


class ElasticLayerOperator(FreeSidedLayer):
    """Free-sided block of the skin, what its sides add by a coarse mesh."""


def elastic_layer_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    coarse: int = COARSE_ELEMENTS,
    free_sides: bool | None = None,
) -> ElasticLayerOperator:
    """The operator of a skin on an n x n patch.

    The coarse part takes some seconds to build the first time, and comes from disk after that.

    Args:
        skin: all but force and modulus matters here.
        samples: n.
        size_mm: side of the patch.
        dtype: of the operator's tensors.
        coarse: elements along a side of the coarse mesh; even.
        free_sides: without, the sides slide (the bare layer). None: those of a flat finger are free; under a
            round one they lie far from the contact and slide.

    Raises:
        ValueError: `coarse` is odd.
    """
    if coarse % 2:
        raise ValueError("coarse must be even: the mesh is split at its mirror planes")
    free = skin.shape == "flat" if free_sides is None else free_sides
    return _operator(skin.at_unit_modulus(), samples, size_mm, dtype, coarse, free)


@lru_cache(maxsize=8)
def _operator(
    skin: Skin, n: int, size: float, dtype: torch.dtype, coarse: int, free: bool
) -> ElasticLayerOperator:
    if dtype != torch.float64:
        return _operator(skin, n, size, torch.float64, coarse, free).to(dtype)
    sides = _free_sides(skin, n, size, coarse) if free else None
    return ElasticLayerOperator(**vars(sliding_layer(skin, n, size)), free_sides=sides)


def _free_sides(skin: Skin, n: int, size: float, coarse: int) -> FreeSides:
    def quarter() -> CoarseBlock:
        levels = (
            even_levels(skin.thickness_mm, COARSE_LAYER_MM, skin.stack)
            if skin.layers
            else depth_levels(skin.depth_mm, skin.thickness_mm, COARSE_LAYER_MM)
        )
        return CoarseBlock(size / 2.0, coarse // 2, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)

    position = (np.arange(n) + 0.5) / n
    hats, interpolation = (
        np.concatenate([make(position, coarse, odd) for odd in (False, True)], axis=1)
        for make in (mirrored_hats, mirrored_centres)
    )
    every = np.eye((coarse // 2 + 1) ** 2)
    key = _key(skin, size, coarse)
    return free_sides(KIND, key, quarter, lambda _: every, hats, interpolation, (size / n) ** 2)


def is_built(skin: Skin, size_mm: float, coarse: int = COARSE_ELEMENTS) -> bool:
    """Whether the coarse part is in the cache on disk; arguments as of `elastic_layer_operator`."""
    return is_cached(KIND, _key(skin.at_unit_modulus(), float(size_mm), coarse))


def _key(skin: Skin, size: float, coarse: int) -> dict[str, float | int | str]:
    return {"code": fingerprint(__name__), **skin.structure, "size": size, "coarse": coarse}
