"""The skin block as an operator on pressures: a fine elastic layer plus free sides on a coarse mesh.

    C p      = layer (cosine transform) p  +  R dC R' p
    strain p = layer strain (mirrored)  p  +  Q dE R' p

A layer in the cosine basis has sliding sides; dC and dE are finite elements with free sides minus finite
elements with sliding sides on one coarse mesh, so that discretisation error cancels. What the free sides add
is smooth, because a nearly incompressible block squeezes out through them as a whole. All operators are for
unit Young's modulus: pressures are in units of E, so that one set serves every modulus and force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.cache import Arrays, cached
from tactile.block import PARITIES, STRAIN_COMPONENTS, Parity, depth_levels, quarter_responses
from tactile.cosine_layer import is_odd, layer_symbols, modes_at_centres, strain_from_modes
from tactile.skin import Skin

Array = NDArray[np.float64]

VERSION = 2
"""Raised whenever what is built here changes: part of the key of the cache."""

COARSE_ELEMENTS = 32
"""Elements along a side of the coarse mesh. 48 -> 32 changes V by at most 0.23 %."""

COARSE_LAYER_MM = 0.27
"""No layer of the coarse mesh is thicker."""


SOURCES = tuple(
    tuple(2 * (row ^ is_odd(pair, 0)) + (column ^ is_odd(pair, 1)) for row in (0, 1) for column in (0, 1))
    for pair in STRAIN_COMPONENTS
)
"""For each strain component, and each parity of it in the order of `PARITIES`, the place there of the parity
of the pressure that it comes from."""


@dataclass(frozen=True)
class FreeSides:
    """What free sides add, for pressures of all four parities at once.

    Attributes:
        hats: (samples, 2 * nodes) coarse hat functions at the pixel centres, even ones and then odd ones.
        compliance: (4, nodes², nodes²) dC of each parity, in the order of `PARITIES`.
        strain: (4, nodes², 6 * elements²) transposed dE.
        interpolation: (samples, 2 * elements) from coarse strains to pixels, even ones and then odd ones.
    """

    hats: Tensor
    compliance: Tensor
    strain: Tensor
    interpolation: Tensor

    def displacement(self, rows: Tensor) -> Tensor:
        """What `hats` times it is to be added (..., 2 * nodes, n), by the hats' products with pressures."""
        nodes = self.hats.shape[1] // 2
        found = _by_parity(rows @ self.hats, self.compliance).unflatten(-1, (nodes, nodes))
        return _side_by_side(found) @ self.hats.T

    def strains(self, rows: Tensor) -> Tensor:
        """(..., 6, n, n), by the hats' products (..., 2 * nodes, n) with pressures."""
        elements = self.interpolation.shape[1] // 2
        coarse = _by_parity(rows @ self.hats, self.strain).unflatten(-1, (6, elements, elements))
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


@dataclass(frozen=True)
class ElasticLayerOperator:
    """Normal displacement and strain at depth of the free-sided block under pressures on an n x n grid.

    Pressures have shape (..., n, n) and are in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        cosines, sines: (n, n) values of the n modes (columns) at the pixel centres (rows); cosines are
            orthonormal.
        symbol: (n, n) layer compliance per mode, mm.
        strain_symbols: (6, n, n) layer strain at depth per mode.
        free_sides: their correction; None where sides slide.
    """

    samples: int
    size_mm: float
    cosines: Tensor
    sines: Tensor
    symbol: Tensor
    strain_symbols: Tensor
    free_sides: FreeSides | None

    @property
    def pixel_area_mm2(self) -> float:
        return (self.size_mm / self.samples) ** 2

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement of the skin, mm, away from the texture: C p."""
        modes = self.cosines.T @ pressure @ self.cosines
        result = self.cosines @ ((self.symbol * modes) @ self.cosines.T)
        if self.free_sides is not None:
            hats = self.free_sides.hats
            result = result + hats @ self.free_sides.displacement(hats.T @ pressure)
        return result

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the layer's part of C, an approximate inverse of C away from the smoothest modes."""
        modes = self.cosines.T @ residual @ self.cosines
        return self.cosines @ (modes / self.symbol) @ self.cosines.T

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain at receptor depth: (..., 6, n, n), components as in `tactile.block.STRAIN_COMPONENTS`."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        result = strain_from_modes(amplitudes, self.strain_symbols, self.cosines, self.sines)
        if self.free_sides is not None:
            result = result + self.free_sides.strains(self.free_sides.hats.T @ pressure)
        return result

    def to(self, dtype: torch.dtype, device: torch.device | None = None) -> ElasticLayerOperator:
        """The same operator in another precision, or on another device."""

        def cast(value: Any) -> Any:
            return value.to(device, dtype) if isinstance(value, Tensor) else value

        def all_cast(fields: Any) -> dict[str, Any]:
            return {name: cast(value) for name, value in vars(fields).items()}

        sides = None if self.free_sides is None else replace(self.free_sides, **all_cast(self.free_sides))
        return replace(self, **(all_cast(self) | {"free_sides": sides}))


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
        skin: only Poisson's ratio, thickness and depth matter here.
        samples: n.
        coarse: elements along a side of the coarse mesh; even.
        free_sides: without, the sides slide (the bare layer; for comparison).
    """
    if coarse % 2:
        raise ValueError("coarse must be even: the mesh is split at its mirror planes")
    return _operator(
        skin.poisson_ratio, skin.thickness_mm, skin.depth_mm, samples, size_mm, dtype, coarse, free_sides
    )


@lru_cache(maxsize=8)
def _operator(
    nu: float,
    thickness: float,
    depth: float,
    n: int,
    size: float,
    dtype: torch.dtype,
    coarse: int,
    free_sides: bool,
) -> ElasticLayerOperator:
    position = (np.arange(n) + 0.5) / n
    cosines, sines = modes_at_centres(n)
    surface, strains = layer_symbols(n, size, nu, thickness, depth)

    def tensor(array: Array) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(array)).to(dtype)

    sides = None
    if free_sides:
        key = {
            "version": VERSION,
            "nu": nu,
            "thickness": thickness,
            "depth": depth,
            "size": size,
            "coarse": coarse,
        }
        corrections = cached(
            "free-sides", key, lambda: _free_sides_correction(nu, thickness, depth, size, coarse)
        )
        area = (size / n) ** 2
        names = [_parity_name(parity) for parity in PARITIES]
        hats, interpolation = (
            np.concatenate([make(position, coarse, odd) for odd in (False, True)], axis=1)
            for make in (_parity_hats, _strain_interpolation)
        )
        sides = FreeSides(
            tensor(hats),
            tensor(np.stack([corrections[f"compliance_{name}"] * area for name in names])),
            tensor(np.stack([corrections[f"strain_{name}"].T * area for name in names])),
            tensor(interpolation),
        )
    return ElasticLayerOperator(
        n,
        size,
        tensor(cosines),
        tensor(sines),
        tensor(surface),
        tensor(strains),
        sides,
    )


def _free_sides_correction(nu: float, thickness: float, depth: float, size: float, coarse: int) -> Arrays:
    levels = depth_levels(depth, thickness, COARSE_LAYER_MM)
    free, sliding = (
        quarter_responses(size / 2.0, coarse // 2, levels, depth, nu, sides) for sides in ("free", "sliding")
    )
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


def _parity_hats(position: Array, coarse: int, odd: bool) -> Array:
    """(samples, coarse/2 + 1) hat functions, each plus or minus its mirror image; `position` in [0, 1]."""
    nodes = np.arange(coarse + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(position[:, None] * coarse - nodes))
    centre = coarse // 2
    outward, inward = hats[:, centre:], hats[:, centre::-1]
    result = outward - inward if odd else outward + inward
    result[:, 0] = 0.0 if odd else hats[:, centre]
    return result


def _strain_interpolation(position: Array, coarse: int, odd: bool) -> Array:
    """(samples, coarse/2): linear between element centres and beyond the outermost; mirrored with sign."""
    place = position * coarse - 0.5
    lower = np.clip(np.floor(place).astype(int), 0, coarse - 2)
    weight = place - lower
    full = np.zeros((position.size, coarse))
    rows = np.arange(position.size)
    full[rows, lower] = 1.0 - weight
    full[rows, lower + 1] += weight
    centre = coarse // 2
    return full[:, centre:] + (-1.0 if odd else 1.0) * full[:, centre - 1 :: -1]
