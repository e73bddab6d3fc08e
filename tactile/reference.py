"""The skin block by finite elements as an operator on pressures: the reference that other models answer to.

The block does not depend on the texture: its four parity blocks are condensed onto the pixels of the contact
face once per skin and grid, and kept on disk. After that a texture costs some dense products. Same interface
as `tactile.hybrid.HybridOperator`, so contact, its gradient and everything above are the same code.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from tactile import condensation, pixel_block
from tactile.block import STRAIN_COMPONENTS, Parity
from tactile.cache import Arrays, cached, fingerprint
from tactile.layer import layer_response
from tactile.pixel_block import PixelBlock, face_response
from tactile.skin import Skin

Array = NDArray[np.float64]

DECAY_AT_DEPTH = 8.0
"""Waves of pressure whose wavenumber times depth exceeds this are left out of the strain: they reach the
receptors with less than (1 + 10.5) exp(-10.5) = 3e-4 of their strain, and are small themselves."""
FIRST_LAYER, GROWTH, THICKEST_MM = 0.8, 1.15, 0.2
"""Of the mesh: the layer at the contact face in pitches, the ratio of neighbours, and no layer is thicker."""
STORED: dict[str, Parity] = {"even": (False, False), "mixed": (False, True), "odd": (True, True)}
ROWS_AND_COLUMNS_EXCHANGED = [1, 0, 2, 4, 3, 5]
"""The order of the strain components when the axes are."""


@dataclass(frozen=True)
class ReferenceBlock:
    """One parity block.

    Attributes:
        compliance: (half², half²) from pressures (units of E) to displacement (mm) on a quarter of the face.
        strain: (6, half², modes) from cosine amplitudes of the pressure to strain on a quarter.
        modes: (modes,) which of the n² cosine modes these are.
    """

    parity: Parity
    compliance: Tensor
    strain: Tensor
    modes: Tensor

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., n, n), of this parity's part of a pressure."""
        quarter = _part(pressure, self.parity)
        return _whole((quarter.flatten(-2) @ self.compliance).view(quarter.shape), self.parity)

    def strains(self, amplitudes: Tensor) -> Tensor:
        """(..., 6, n, n), of this parity's part of a pressure with cosine amplitudes (..., n, n)."""
        half = amplitudes.shape[-1] // 2
        chosen = amplitudes.flatten(-2)[..., self.modes]
        components = []
        for operator, pair in zip(self.strain, STRAIN_COMPONENTS, strict=True):
            odd = [((pair[0] == axis) != (pair[1] == axis)) != self.parity[axis] for axis in (0, 1)]
            components.append(_whole((chosen @ operator.T).unflatten(-1, (half, half)), (odd[0], odd[1])))
        return torch.stack(components, dim=-3)


@dataclass(frozen=True)
class ReferenceOperator:
    """Normal displacement and strain at depth under pressures on an n x n grid, n even.

    Pressures have shape (..., n, n) and are in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        cosines: (n, n) orthonormal cosine modes (columns) at the pixel centres (rows).
        symbol: (n, n) compliance per mode of the layer with sliding sides: the preconditioner, nothing else.
        even, mixed, odd: the parity blocks. What is odd in the row is the mixed block's, transposed.
    """

    samples: int
    size_mm: float
    cosines: Tensor
    symbol: Tensor
    even: ReferenceBlock
    mixed: ReferenceBlock
    odd: ReferenceBlock

    @property
    def pixel_area_mm2(self) -> float:
        return (self.size_mm / self.samples) ** 2

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement of the skin, mm, away from the texture: C p."""
        mixed = self.mixed.displacement(torch.stack((pressure, pressure.mT)))
        return self.even.displacement(pressure) + self.odd.displacement(pressure) + mixed[0] + mixed[1].mT

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the compliance of a layer with sliding sides."""
        modes = self.cosines.T @ residual @ self.cosines
        return self.cosines @ (modes / self.symbol) @ self.cosines.T

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain at receptor depth: (..., 6, n, n), components as in `tactile.block.STRAIN_COMPONENTS`."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        mixed = self.mixed.strains(torch.stack((amplitudes, amplitudes.mT)))
        exchanged = mixed[1].mT[..., ROWS_AND_COLUMNS_EXCHANGED, :, :]
        return self.even.strains(amplitudes) + self.odd.strains(amplitudes) + mixed[0] + exchanged

    def to(self, dtype: torch.dtype) -> ReferenceOperator:
        """The same operator in another precision."""

        def cast(block: ReferenceBlock) -> ReferenceBlock:
            return replace(block, compliance=block.compliance.to(dtype), strain=block.strain.to(dtype))

        return replace(
            self,
            cosines=self.cosines.to(dtype),
            symbol=self.symbol.to(dtype),
            even=cast(self.even),
            mixed=cast(self.mixed),
            odd=cast(self.odd),
        )


def _part(field: Tensor, parity: Parity) -> Tensor:
    """(..., n/2, n/2): the part of a field of one parity, on the quarter where row and column are high."""
    for axis, odd in zip((-2, -1), parity, strict=True):
        half = field.shape[axis] // 2
        near, far = field.narrow(axis, half, half), field.narrow(axis, 0, half).flip(axis)
        field = 0.5 * (near - far if odd else near + far)
    return field


def _whole(quarter: Tensor, parity: Parity) -> Tensor:
    """(..., n, n): a quarter and its mirror images."""
    for axis, odd in zip((-2, -1), parity, strict=True):
        mirrored = quarter.flip(axis)
        quarter = torch.cat((-mirrored if odd else mirrored, quarter), dim=axis)
    return quarter


def reference_operator(
    skin: Skin, samples: int, size_mm: float, dtype: torch.dtype = torch.float64
) -> ReferenceOperator:
    """The operator of a skin on an n x n patch: built the first time, from disk after that.

    Args:
        skin: only Poisson's ratio, thickness and depth matter here.
        samples: n, even.
    """
    if samples % 2:
        raise ValueError("samples must be even: the block is split at its mirror planes")
    return _operator(skin.poisson_ratio, skin.thickness_mm, skin.depth_mm, samples, size_mm, dtype)


@lru_cache(maxsize=2)
def _operator(
    nu: float, thickness: float, depth: float, n: int, size: float, dtype: torch.dtype
) -> ReferenceOperator:
    mesh = PixelBlock(size / 2.0, n // 2, graded_levels(thickness, size / n), depth, nu)
    key: dict[str, float | int | str] = {
        "code": fingerprint(pixel_block, condensation, sys.modules[__name__]),
        "nu": nu,
        "thickness": thickness,
        "depth": depth,
        "size": size,
        "samples": n,
    }
    arrays = cached("reference", key, lambda: _build(mesh))
    wavenumber = np.pi * np.arange(n) / size
    symbol = layer_response(np.hypot(wavenumber[:, None], wavenumber), nu, thickness, depth).surface

    def tensor(array: NDArray[Any]) -> Tensor:
        return torch.as_tensor(array).to(dtype)

    def block(name: str) -> ReferenceBlock:
        modes = torch.as_tensor(_modes(n, size, depth, STORED[name]))
        compliance, strain = (tensor(arrays[f"{kind}_{name}"]) for kind in ("compliance", "strain"))
        return ReferenceBlock(STORED[name], compliance, strain, modes)

    even, mixed, odd = (block(name) for name in STORED)
    return ReferenceOperator(n, size, tensor(_cosines(n)), tensor(symbol), even, mixed, odd)


def _build(mesh: PixelBlock) -> Arrays:
    n, area = 2 * mesh.half, mesh.pitch_mm**2
    quarter = _cosines(n)[mesh.half :]
    arrays: Arrays = {}
    for name, parity in STORED.items():
        row, column = np.divmod(_modes(n, 2.0 * mesh.half_mm, mesh.depth_mm, parity), n)
        loads = (quarter[:, None, row] * quarter[None, :, column]).reshape(mesh.half**2, -1)
        response = face_response(mesh, parity, area * loads)
        # Single precision: 6e-8 off the same truth, half the bytes to keep and to read.
        arrays[f"compliance_{name}"] = (area * response.compliance).astype(np.float32)
        arrays[f"strain_{name}"] = response.strain.astype(np.float32)
    return arrays


def graded_levels(thickness_mm: float, pitch_mm: float) -> Array:
    """Node depths: thin layers at the contact face, growing toward the bone."""
    layers = [FIRST_LAYER * pitch_mm]
    while sum(layers) < thickness_mm:
        layers.append(min(GROWTH * layers[-1], THICKEST_MM))
    depths = np.concatenate(([0.0], np.cumsum(layers)))
    return depths * (thickness_mm / depths[-1])


def _cosines(n: int) -> Array:
    """(n, n) orthonormal cosine modes (columns) at the pixel centres (rows)."""
    modes = np.cos(np.pi * np.outer((np.arange(n) + 0.5) / n, np.arange(n))) * np.sqrt(2.0 / n)
    modes[:, 0] = np.sqrt(1.0 / n)
    return modes


def _modes(n: int, size_mm: float, depth_mm: float, parity: Parity) -> NDArray[np.intp]:
    """Numbers (of n²) of the cosine modes of a parity that reach the receptors."""
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    reaching = np.pi / size_mm * np.hypot(row, column) <= DECAY_AT_DEPTH / depth_mm
    of_parity = (row % 2 == parity[0]) & (column % 2 == parity[1])
    return np.flatnonzero(reaching & of_parity)
