"""Elastic layer with free sides: the skin block as an operator on pressures, by exact layer and coarse mesh.

    C p      = exact layer  p  +  R (free - sliding) R' p
    strain p = exact layer strain p  +  Q (free - sliding) R' p

The formula is the one of `tactile.elements.finite_elements` (see `cosine_layer` beside it), on a mesh of 32 x
32 elements instead of 64 x 64 nodes. What the free sides add is smooth, because a nearly incompressible block
squeezes out through its sides as a whole, so linear interpolation (R from nodes, Q from the elements'
centres) serves. All operators are for unit Young's modulus: pressures are in units of E, so that one set
serves every modulus and force.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from relief.common.cache import Arrays, cached, fingerprint, is_cached
from relief.common.progress import stage
from tactile.layer.cosine_layer import PARITIES, CosineLayer, Parity, TensorFields, is_odd, sliding_layer
from tactile.layer.interpolation import mirrored_centres, mirrored_hats
from tactile.layer.layers import even_levels
from tactile.skin import Skin
from tactile.strain import STRAIN_COMPONENTS

COARSE_ELEMENTS = 32
"""Elements along a side of the coarse mesh: V differs by at most 0.23 % from V with 48."""

COARSE_LAYER_MM = 0.27
"""Greatest thickness of the coarse mesh's layers, mm: nine or ten of them in 2.5 mm of skin."""

SOURCES = tuple(
    tuple(2 * (row ^ is_odd(pair, 0)) + (column ^ is_odd(pair, 1)) for row in (0, 1) for column in (0, 1))
    for pair in STRAIN_COMPONENTS
)
"""For each strain component, and each parity of the component, the place in `PARITIES` of the pressure's
parity that causes it."""


@dataclass(frozen=True, repr=False)
class FreeSides(TensorFields):
    """What free sides add to sliding ones, for pressures of all four parities at once.

    Attributes:
        hats: (samples, 2 * nodes) coarse hat functions at the pixel centres, even ones and then odd ones.
        compliance: (4, nodes², nodes²) difference of each parity's compliance, in the order of `PARITIES`.
        strains: (4, nodes², 6 * elements²) difference of each parity's strain, transposed.
        interpolation: (samples, 2 * elements) from coarse strains to pixels, even ones and then odd ones.
    """

    hats: Tensor
    compliance: Tensor
    strains: Tensor
    interpolation: Tensor

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., n, n) mm, from pressures (..., n, n) in units of Young's modulus."""
        nodes = self.hats.shape[1] // 2
        nodal = _by_parity(self.hats.T @ pressure @ self.hats, self.compliance).unflatten(-1, (nodes, nodes))
        return self.hats @ (_side_by_side(nodal) @ self.hats.T)

    def strain(self, pressure: Tensor) -> Tensor:
        """(..., 6, n, n), from pressures (..., n, n) in units of Young's modulus."""
        elements = self.interpolation.shape[1] // 2
        coarse = _by_parity(self.hats.T @ pressure @ self.hats, self.strains)
        coarse = coarse.unflatten(-1, (6, elements, elements))
        placed = torch.stack(
            [coarse[..., list(sources), number, :, :] for number, sources in enumerate(SOURCES)], dim=-4
        )
        return self.interpolation @ _side_by_side(placed) @ self.interpolation.T


def _by_parity(nodal: Tensor, matrices: Tensor) -> Tensor:
    """(..., 4, b): every quarter of (..., 2m, 2m), flat, times its matrix (4, m², b)."""
    m = nodal.shape[-1] // 2
    quarters = nodal.unflatten(-2, (2, m)).unflatten(-1, (2, m)).transpose(-3, -2)
    flat = quarters.reshape(-1, 4, m * m).transpose(0, 1)
    return torch.bmm(flat, matrices).transpose(0, 1).reshape(*nodal.shape[:-2], 4, matrices.shape[-1])


def _side_by_side(quarters: Tensor) -> Tensor:
    """(..., 2m, 2m) of four quarters (..., 4, m, m)."""
    m = quarters.shape[-1]
    square = quarters.unflatten(-3, (2, 2)).transpose(-3, -2)
    return square.reshape(*quarters.shape[:-3], 2 * m, 2 * m)


@dataclass(frozen=True, repr=False)
class ElasticLayerOperator(CosineLayer):
    """Normal displacement and strain at depth of the free-sided block under pressures on an n x n grid.

    Attributes:
        free_sides: their addition to the layer; None where the sides slide.
    """

    free_sides: FreeSides | None

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (..., n, n) of the skin, mm, away from the texture: C p."""
        # Not the base's order of products, which rounds otherwise: descents are to repeat bit for bit.
        layer = self.cosines @ ((self.symbol * self.amplitudes(pressure)) @ self.cosines.T)
        return layer if self.free_sides is None else layer + self.free_sides.displacement(pressure)

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at receptor depth, components as in `tactile.strain.STRAIN_COMPONENTS`."""
        layer = super().strain(pressure)
        return layer if self.free_sides is None else layer + self.free_sides.strain(pressure)


def elastic_layer_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    coarse: int = COARSE_ELEMENTS,
    free_sides: bool = True,
) -> ElasticLayerOperator:
    """The operator of a skin on an n x n patch.

    The coarse part takes some seconds to build the first time, and comes from disk after that.

    Args:
        skin: all but force and modulus matters here.
        samples: n.
        size_mm: side of the patch.
        dtype: of the operator's tensors.
        coarse: elements along a side of the coarse mesh; even.
        free_sides: without, the sides slide (the bare layer; for comparison).

    Raises:
        ValueError: `coarse` is odd.
    """
    if coarse % 2:
        raise ValueError("coarse must be even: the mesh is split at its mirror planes")
    return _operator(skin.at_unit_modulus(), samples, size_mm, dtype, coarse, free_sides)


@lru_cache(maxsize=8)
def _operator(
    skin: Skin, n: int, size: float, dtype: torch.dtype, coarse: int, free_sides: bool
) -> ElasticLayerOperator:
    sides = _free_sides(skin, n, size, coarse) if free_sides else None
    return ElasticLayerOperator(**vars(sliding_layer(skin, n, size)), free_sides=sides).to(dtype)


def _free_sides(skin: Skin, n: int, size: float, coarse: int) -> FreeSides:
    names = [_parity_name(parity) for parity in PARITIES]
    nodes, elements = (coarse // 2 + 1) ** 2, (coarse // 2) ** 2
    layout = {f"compliance_{name}": ((nodes, nodes), "f8") for name in names}
    layout |= {f"strain_{name}": ((len(STRAIN_COMPONENTS) * elements, nodes), "f8") for name in names}
    difference = cached(
        "free-sides", _key(skin, size, coarse), lambda: _free_minus_sliding(skin, size, coarse), layout
    )
    area, position = (size / n) ** 2, (np.arange(n) + 0.5) / n
    hats, interpolation = (
        np.concatenate([make(position, coarse, odd) for odd in (False, True)], axis=1)
        for make in (mirrored_hats, mirrored_centres)
    )
    return FreeSides(
        torch.as_tensor(hats),
        torch.as_tensor(np.stack([difference[f"compliance_{name}"] * area for name in names])),
        torch.as_tensor(
            np.ascontiguousarray(np.stack([difference[f"strain_{name}"].T * area for name in names]))
        ),
        torch.as_tensor(interpolation),
    )


def is_built(skin: Skin, size_mm: float, coarse: int = COARSE_ELEMENTS) -> bool:
    """Whether the coarse part is in the cache on disk; arguments as of `elastic_layer_operator`."""
    return is_cached("free-sides", _key(skin.at_unit_modulus(), float(size_mm), coarse))


def _key(skin: Skin, size: float, coarse: int) -> dict[str, float | int | str]:
    return {"code": fingerprint(__name__), **skin.structure, "size": size, "coarse": coarse}


def _free_minus_sliding(skin: Skin, size: float, coarse: int) -> Arrays:
    # Imported to build only: scikit-fem is not loaded while the cache serves.
    from tactile.structured.block import depth_levels, quarter_responses

    if skin.layers:
        levels = even_levels(skin.thickness_mm, COARSE_LAYER_MM, skin.stack)
    else:
        levels = depth_levels(skin.depth_mm, skin.thickness_mm, COARSE_LAYER_MM)
    both = []
    with stage("building the elastic layer (kept on disk)", 2) as advance:
        for sides in ("free", "sliding"):
            both.append(quarter_responses(size / 2.0, coarse // 2, levels, skin, sides))
            advance()
    free, sliding = both
    arrays: Arrays = {}
    for parity in PARITIES:
        # A pattern of one parity stores four times the energy of its quarter: hence 1/4 per unit of the load
        # on the whole face.
        name = _parity_name(parity)
        arrays[f"compliance_{name}"] = 0.25 * (free[parity].displacement - sliding[parity].displacement)
        strain = 0.25 * (free[parity].strain - sliding[parity].strain)
        arrays[f"strain_{name}"] = strain.reshape(-1, strain.shape[-1])
    return arrays


def _parity_name(parity: Parity) -> str:
    return "".join("odd" if odd else "even" for odd in parity)
