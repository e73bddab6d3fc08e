"""The exact elastic layer on a grid of pixels: cosine modes, their symbols, and strains from amplitudes.

A layer in the cosine basis has sliding sides; `tactile.elastic_layer` and `tactile.finite_elements` add the
free ones.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from tactile.block import STRAIN_COMPONENTS
from tactile.layer_response import layer_response

Array = NDArray[np.float64]


def modes_at_centres(n: int) -> tuple[Array, Array]:
    """(n, n) cosines (orthonormal) and sines of the n modes (columns) at the pixel centres (rows)."""
    angle = np.pi * np.outer((np.arange(n) + 0.5) / n, np.arange(n))
    scale = np.full(n, np.sqrt(2.0 / n))
    scale[0] = np.sqrt(1.0 / n)
    return np.cos(angle) * scale, np.sin(angle) * scale


def layer_symbols(
    n: int, size_mm: float, poisson_ratio: float, thickness_mm: float, depth_mm: float
) -> tuple[Array, Array]:
    """Surface compliance (n, n) in mm and strains at depth (6, n, n) per mode, at E = 1 MPa."""
    wavenumber = np.pi * np.arange(n) / size_mm
    kr, kc = np.meshgrid(wavenumber, wavenumber, indexing="ij")
    k = np.hypot(kr, kc)
    layer = layer_response(k, poisson_ratio, thickness_mm, depth_mm)
    # Lateral displacement is minus (U/k) times the gradient of the pressure pattern; W/k terms are those of
    # the shear strain.
    over_k = np.divide(layer.lateral, k, out=np.zeros_like(k), where=k > 0)
    shear = -0.5 * (layer.normal - np.divide(layer.lateral_slope, k, out=np.zeros_like(k), where=k > 0))
    strains = np.stack(
        (over_k * kr**2, over_k * kc**2, layer.normal_slope, shear * kc, shear * kr, -over_k * kr * kc)
    )
    return layer.surface, strains


def strain_from_modes(amplitudes: Tensor, symbols: Tensor, cosines: Tensor, sines: Tensor) -> Tensor:
    """(..., 6, n, n) strains at the pixel centres.

    Args:
        amplitudes: (..., n, n) of the pressure in cosine modes.
        symbols: (6, n, n).
        cosines, sines: as of `modes_at_centres`.
    """
    modes = amplitudes.unsqueeze(-3) * symbols
    components = []
    for number, pair in enumerate(STRAIN_COMPONENTS):
        row = sines if is_odd(pair, 0) else cosines
        column = sines if is_odd(pair, 1) else cosines
        components.append(row @ modes[..., number, :, :] @ column.T)
    return torch.stack(components, dim=-3)


def is_odd(pair: tuple[int, int], axis: int) -> bool:
    """Whether a strain component is odd along an axis under a load that is even along it."""
    return (pair[0] == axis) != (pair[1] == axis)
