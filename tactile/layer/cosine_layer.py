"""Exact elastic layer on a grid of pixels, in cosine modes: what every model of the skin block shares.

The block of the skin has free sides. Both of its models are one formula on two meshes,

    C p      = exact layer  p  +  T (free - sliding) T' p,

and the same of the strain. A layer in the cosine basis has sliding sides and is exact for every wavelength.
Free sides add what finite elements with free sides give, minus what the same elements give with sliding ones,
so that their discretisation error cancels. T interpolates from the elements to the pixels.
`elastic_layer` takes a coarse mesh for the difference, `tactile.elements.finite_elements` a fine one.
"""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
import scipy.fft
import torch
from torch import Tensor

from relief.ground.arrays import Array
from tactile.layer.layer_response import layer_response
from tactile.skin import Skin
from tactile.strain import STRAIN_COMPONENTS

Parity = tuple[bool, bool]
"""Whether a load is odd in (row, column) about the block's two mirror planes."""

PARITIES: tuple[Parity, ...] = ((False, False), (False, True), (True, False), (True, True))


class TensorFields:
    """Base of dataclasses that hold tensors: cast as one, and shown without the tensors' values."""

    def to(self, dtype: torch.dtype, device: torch.device | None = None) -> Self:
        """A copy with floating-point tensors in another precision, or all tensors on another device."""

        def cast(value: Any) -> Any:
            if isinstance(value, TensorFields):
                return value.to(dtype, device)
            if isinstance(value, Tensor):
                return value.to(device, dtype if value.is_floating_point() else value.dtype)
            return value

        return replace(self, **{f.name: cast(getattr(self, f.name)) for f in fields(self)})  # type: ignore[arg-type,type-var]

    def __repr__(self) -> str:
        def shown(value: Any) -> str:
            return " x ".join(map(str, value.shape)) if isinstance(value, Tensor) else repr(value)

        values = ", ".join(f"{f.name}={shown(getattr(self, f.name))}" for f in fields(self))  # type: ignore[arg-type]
        return f"{type(self).__name__}({values})"


@dataclass(frozen=True, repr=False)
class CosineLayer(TensorFields):
    """Normal displacement and strain at depth of a layer with sliding sides, diagonal in cosine modes.

    Pressures have shape (..., n, n) and are in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        cosines, sines: (n, n) values of the n modes (columns) at the pixel centres (rows); cosines are
            orthonormal.
        symbol: (n, n) compliance per mode, mm.
        strain_symbols: (6, n, n) strain at depth per mode.
    """

    samples: int
    size_mm: float
    cosines: Tensor
    sines: Tensor
    symbol: Tensor
    strain_symbols: Tensor

    def __repr__(self) -> str:
        grid = f"{self.samples} x {self.samples} samples of {self.size_mm:g} mm"
        return f"{type(self).__name__}({grid}, {str(self.symbol.dtype).removeprefix('torch.')})"

    def amplitudes(self, field: Tensor) -> Tensor:
        """Amplitudes (..., n, n) in cosine modes of a field (..., n, n)."""
        if field.is_cpu:
            return _fast_transform(field, False)
        return self.cosines.T @ field @ self.cosines

    def field(self, amplitudes: Tensor) -> Tensor:
        """The field (..., n, n) of amplitudes (..., n, n) in cosine modes, the inverse of `amplitudes`."""
        if amplitudes.is_cpu:
            return _fast_transform(amplitudes, True)
        return self.cosines @ amplitudes @ self.cosines.T

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (..., n, n) of the skin, mm, away from the texture: C p."""
        return self.field(self.symbol * self.amplitudes(pressure))

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the layer's compliance: that of a block nearly, away from the smoothest modes."""
        return self.field(self.amplitudes(residual) / self.symbol)

    def energy(self, pressure: Tensor) -> Tensor:
        """(..., 1, 1) elastic energy 1/2 p'Cp: half of the transforms of a displacement."""
        return 0.5 * (self.symbol * self.amplitudes(pressure).square()).sum((-2, -1), keepdim=True)

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at depth, components as in `tactile.strain.STRAIN_COMPONENTS`."""
        return self.strain_of(self.amplitudes(pressure))

    def strain_modes(self, amplitudes: Tensor) -> Tensor:
        """Amplitudes (..., 6, n, n) of the strain at depth, from those (..., n, n) of the pressure.

        They belong to sines along the axes along which a component is odd, and to cosines along the others.
        """
        return amplitudes.unsqueeze(-3) * self.strain_symbols

    def strain_of(self, amplitudes: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at depth under a pressure with amplitudes (..., n, n) in cosine modes."""
        modes = self.strain_modes(amplitudes)
        components = []
        for number, pair in enumerate(STRAIN_COMPONENTS):
            row = self.sines if is_odd(pair, 0) else self.cosines
            column = self.sines if is_odd(pair, 1) else self.cosines
            components.append(row @ modes[..., number, :, :] @ column.T)
        return torch.stack(components, dim=-3)


class _CosineTransform(torch.autograd.Function):
    """Orthonormal cosine transform along the last two axes, or its inverse, which is its adjoint.

    The transform is SciPy's, of order n² log n. Products with matrices of cosines take 2.3 times as long on
    128 samples a side in single precision, 6 times on 400, and as long on 32; in double precision 3, 6 and
    1.2.
    """

    @staticmethod
    def forward(ctx: Any, field: Tensor, inverse: bool) -> Tensor:
        ctx.inverse = inverse
        return _transform(field, inverse)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        return _fast_transform(gradients[0], not ctx.inverse), None


def _fast_transform(field: Tensor, inverse: bool) -> Tensor:
    if not field.requires_grad:
        return _transform(field, inverse)
    result: Tensor = _CosineTransform.apply(field, inverse)
    return result


def _transform(field: Tensor, inverse: bool) -> Tensor:
    transform = scipy.fft.idctn if inverse else scipy.fft.dctn
    return torch.from_numpy(transform(field.numpy(), axes=(-2, -1), norm="ortho"))


def sliding_layer(skin: Skin, samples: int, size_mm: float) -> CosineLayer:
    """The layer of a skin with sliding sides on an n x n patch, at unit modulus, in double precision.

    Args:
        skin: all but force and modulus matters here.
        samples: n.
        size_mm: side of the patch.
    """
    symbols = layer_symbols(samples, size_mm, skin)
    return CosineLayer(samples, size_mm, *map(torch.as_tensor, (*modes_at_centres(samples), *symbols)))


def modes_at_centres(n: int) -> tuple[Array, Array]:
    """(n, n) cosines (orthonormal) and sines of the n modes (columns) at the pixel centres (rows)."""
    angle = np.pi * np.outer((np.arange(n) + 0.5) / n, np.arange(n))
    scale = np.full(n, np.sqrt(2.0 / n))
    scale[0] = np.sqrt(1.0 / n)
    return np.cos(angle) * scale, np.sin(angle) * scale


def layer_symbols(n: int, size_mm: float, skin: Skin) -> tuple[Array, Array]:
    """Surface compliance (n, n) in mm and strains at depth (6, n, n) per mode, at a modulus of 1 MPa."""
    wavenumber = np.pi * np.arange(n) / size_mm
    kr, kc = np.meshgrid(wavenumber, wavenumber, indexing="ij")
    k = np.hypot(kr, kc)
    layer = layer_response(k, skin.poisson_ratio, skin.thickness_mm, skin.depth_mm, skin.stack)
    # Lateral displacement is minus (U/k) times the gradient of the pressure pattern; W/k terms are those of
    # the shear strain.
    over_k = np.divide(layer.lateral, k, out=np.zeros_like(k), where=k > 0)
    shear = -0.5 * (layer.normal - np.divide(layer.lateral_slope, k, out=np.zeros_like(k), where=k > 0))
    strains = np.stack(
        (over_k * kr**2, over_k * kc**2, layer.normal_slope, shear * kc, shear * kr, -over_k * kr * kc)
    )
    return layer.surface, strains


def is_odd(pair: tuple[int, int], axis: int) -> bool:
    """Whether a strain component is odd along an axis under a load that is even along the same axis."""
    return (pair[0] == axis) != (pair[1] == axis)
