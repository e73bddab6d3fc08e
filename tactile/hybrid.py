"""The skin block as an operator on pressures: a fine elastic layer plus free sides on a coarse mesh.

    C p      = layer (cosine transform) p  +  R dC R' p
    strain p = layer strain (mirrored)  p  +  Q dE R' p

A layer in the cosine basis has sliding sides; dC and dE are finite elements with free sides minus finite
elements with sliding sides on one coarse mesh, so that discretisation error cancels. What the free sides add
is smooth, because a nearly incompressible block squeezes out through them as a whole. All operators are for
unit Young's modulus: pressures are in units of E, so that one set serves every modulus and force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from tactile.block import PARITIES, STRAIN_COMPONENTS, Parity, depth_levels, quarter_responses
from tactile.cache import Arrays, cached
from tactile.cosine_layer import is_odd, layer_symbols, modes_at_centres, strain_from_modes
from tactile.skin import Skin

Array = NDArray[np.float64]

VERSION = 2
"""Raised whenever what is built here changes: part of the key of the cache."""

COARSE_ELEMENTS = 32
"""Elements along a side of the coarse mesh. 48 -> 32 changes V by at most 0.23 %."""

COARSE_LAYER_MM = 0.27
"""No layer of the coarse mesh is thicker."""


@dataclass(frozen=True)
class ParityBlock:
    """The free-sides correction of one parity.

    Attributes:
        row_hats, column_hats: (samples, nodes) coarse hat functions of this parity at the pixel centres.
        compliance: (nodes², nodes²) dC.
        strain: (6 * elements², nodes²) dE.
        row_interpolation, column_interpolation: (2, samples, elements) from coarse strains to pixels, for
            strains that are even [0] or odd [1] in that axis.
    """

    parity: Parity
    row_hats: Tensor
    column_hats: Tensor
    compliance: Tensor
    strain: Tensor
    row_interpolation: Tensor
    column_interpolation: Tensor


@dataclass(frozen=True)
class HybridOperator:
    """Normal displacement and strain at depth of the free-sided block under pressures on an n x n grid.

    Pressures have shape (..., n, n) and are in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        cosines, sines: (n, n) values of the n modes (columns) at the pixel centres (rows); cosines are
            orthonormal.
        symbol: (n, n) layer compliance per mode, mm.
        strain_symbols: (6, n, n) layer strain at depth per mode.
        blocks: the free-sides correction.
    """

    samples: int
    size_mm: float
    cosines: Tensor
    sines: Tensor
    symbol: Tensor
    strain_symbols: Tensor
    blocks: tuple[ParityBlock, ...]

    @property
    def pixel_area_mm2(self) -> float:
        return (self.size_mm / self.samples) ** 2

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement of the skin, mm, away from the texture: C p."""
        modes = self.cosines.T @ pressure @ self.cosines
        result = self.cosines @ (self.symbol * modes) @ self.cosines.T
        for block in self.blocks:
            nodal = (block.row_hats.T @ pressure @ block.column_hats).flatten(-2) @ block.compliance
            nodal = nodal.unflatten(-1, (block.row_hats.shape[1], block.column_hats.shape[1]))
            result = result + block.row_hats @ nodal @ block.column_hats.T
        return result

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the layer's part of C, an approximate inverse of C away from the smoothest modes."""
        modes = self.cosines.T @ residual @ self.cosines
        return self.cosines @ (modes / self.symbol) @ self.cosines.T

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain at receptor depth: (..., 6, n, n), components as in `tactile.block.STRAIN_COMPONENTS`."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        result = strain_from_modes(amplitudes, self.strain_symbols, self.cosines, self.sines)
        for block in self.blocks:
            elements = block.row_interpolation.shape[2]
            nodal = (block.row_hats.T @ pressure @ block.column_hats).flatten(-2)
            coarse = (nodal @ block.strain.T).unflatten(-1, (6, elements, elements))
            parts = []
            for number, pair in enumerate(STRAIN_COMPONENTS):
                row = block.row_interpolation[int(block.parity[0] != is_odd(pair, 0))]
                column = block.column_interpolation[int(block.parity[1] != is_odd(pair, 1))]
                parts.append(row @ coarse[..., number, :, :] @ column.T)
            result = result + torch.stack(parts, dim=-3)
        return result

    def to(self, dtype: torch.dtype, device: torch.device | None = None) -> HybridOperator:
        """The same operator in another precision, or on another device."""

        def cast(value: Any) -> Any:
            return value.to(device, dtype) if isinstance(value, Tensor) else value

        blocks = tuple(replace(b, **{k: cast(v) for k, v in vars(b).items()}) for b in self.blocks)
        return replace(self, **{k: cast(v) for k, v in vars(self).items() if k != "blocks"}, blocks=blocks)


def hybrid_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    coarse: int = COARSE_ELEMENTS,
    free_sides: bool = True,
) -> HybridOperator:
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
) -> HybridOperator:
    position = (np.arange(n) + 0.5) / n
    cosines, sines = modes_at_centres(n)
    surface, strains = layer_symbols(n, size, nu, thickness, depth)

    def tensor(array: Array) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(array)).to(dtype)

    blocks: tuple[ParityBlock, ...] = ()
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
        blocks = tuple(_parity_block(p, corrections, position, size, coarse, area, tensor) for p in PARITIES)
    return HybridOperator(
        n,
        size,
        tensor(cosines),
        tensor(sines),
        tensor(surface),
        tensor(strains),
        blocks,
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


def _parity_block(
    parity: Parity,
    corrections: Arrays,
    position: Array,
    size: float,
    coarse: int,
    pixel_area: float,
    tensor: Callable[[Array], Tensor],
) -> ParityBlock:
    name = _parity_name(parity)
    hats = [tensor(_parity_hats(position, coarse, odd)) for odd in parity]
    interpolation = tensor(np.stack([_strain_interpolation(position, coarse, odd) for odd in (False, True)]))
    compliance = tensor(corrections[f"compliance_{name}"] * pixel_area)
    strain = tensor(corrections[f"strain_{name}"] * pixel_area)
    return ParityBlock(parity, hats[0], hats[1], compliance, strain, interpolation, interpolation)


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
