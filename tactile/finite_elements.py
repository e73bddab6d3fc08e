"""The skin block by finite elements as an operator on pressures: the reference that other models answer to.

    C p      = exact layer  p  +  T (elements with free sides - elements with sliding sides) T' p
    strain p = the same of the strain

The block does not depend on the texture: its parity blocks are condensed onto the nodes of the contact face
once per skin and mesh, and kept on disk; a texture costs some dense products after that. Elements are worst
under the shortest waves of pressure, and these do not feel the sides of the block: what the same elements
make of sliding sides is known mode by mode (`tactile.pixel_layer`), what is right is known exactly
(`tactile.layer_response`), and the difference is taken off. T interpolates from the nodes of the mesh to the
pixels, where contact is decided; where there is a node at every pixel, T is the identity. Same interface as
`tactile.elastic_layer.ElasticLayerOperator`, so contact, its gradient and everything above are the same code.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.cache import Arrays, cached, fingerprint
from tactile import condensation, pixel_block, pixel_layer
from tactile.block import PARITIES, STRAIN_COMPONENTS, Parity
from tactile.cosine_layer import is_odd, layer_symbols, modes_at_centres, strain_from_modes
from tactile.pixel_block import PixelBlock, face_response, lagrange
from tactile.pixel_layer import discrete_layer
from tactile.skin import Skin

Array = NDArray[np.float64]

DECAY_AT_DEPTH = 8.0
"""Of the elements' strain, waves of pressure whose wavenumber times depth exceeds this are left to the exact
layer: little of them reaches the receptors, (1 + 8) exp(-8) = 0.3 %."""
FIRST_LAYER, GROWTH, THICKEST_MM = 0.8, 1.15, 0.2
"""Of the mesh: the layer at the contact face in pitches, the ratio of neighbours, the thickest that grows."""
STORED: dict[str, Parity] = {"even": (False, False), "mixed": (False, True), "odd": (True, True)}
ROWS_AND_COLUMNS_EXCHANGED = [1, 0, 2, 4, 3, 5]
"""The order of the strain components when the axes are."""


@dataclass(frozen=True)
class ParityBlock:
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
            odd = [is_odd(pair, axis) != self.parity[axis] for axis in (0, 1)]
            components.append(_whole((chosen @ operator.T).unflatten(-1, (half, half)), (odd[0], odd[1])))
        return torch.stack(components, dim=-3)

    def to(self, dtype: torch.dtype) -> ParityBlock:
        return replace(self, compliance=self.compliance.to(dtype), strain=self.strain.to(dtype))


@dataclass(frozen=True)
class Elements:
    """What free sides add to sliding ones, by the elements of an m x m mesh, m even.

    Attributes:
        cosines, sines: (m, m) as of `tactile.cosine_layer.modes_at_centres`.
        sliding, sliding_strain: (m, m) and (6, m, m) symbols of the elements with sliding sides.
        even, mixed, odd: the parity blocks with free sides. What is odd in the row is the mixed block's,
            transposed.
    """

    cosines: Tensor
    sines: Tensor
    sliding: Tensor
    sliding_strain: Tensor
    even: ParityBlock
    mixed: ParityBlock
    odd: ParityBlock

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., m, m) mm, from pressures (..., m, m) in units of Young's modulus."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        sliding = self.cosines @ (self.sliding * amplitudes) @ self.cosines.T
        mixed = self.mixed.displacement(torch.stack((pressure, pressure.mT)))
        alike = self.even.displacement(pressure) + self.odd.displacement(pressure)
        return alike + mixed[0] + mixed[1].mT - sliding

    def strain(self, pressure: Tensor) -> Tensor:
        """(..., 6, m, m)."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        sliding = strain_from_modes(amplitudes, self.sliding_strain, self.cosines, self.sines)
        mixed = self.mixed.strains(torch.stack((amplitudes, amplitudes.mT)))
        exchanged = mixed[1].mT[..., ROWS_AND_COLUMNS_EXCHANGED, :, :]
        alike = self.even.strains(amplitudes) + self.odd.strains(amplitudes)
        return alike + mixed[0] + exchanged - sliding

    def to(self, dtype: torch.dtype) -> Elements:
        return Elements(**{field.name: getattr(self, field.name).to(dtype) for field in fields(self)})


@dataclass(frozen=True)
class FiniteElementOperator:
    """Normal displacement and strain at depth under pressures on an n x n grid.

    Pressures have shape (..., n, n) and are in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        cosines, sines: (n, n) as of `tactile.cosine_layer.modes_at_centres`.
        symbol, strain_symbols: (n, n) and (6, n, n) of the exact layer with sliding sides; zero in the bare
            elements.
        preconditioner: (n, n) symbol of the exact layer.
        interpolation: (n, m) from the mesh to the pixels.
        elements: what free sides add.
    """

    samples: int
    size_mm: float
    cosines: Tensor
    sines: Tensor
    symbol: Tensor
    strain_symbols: Tensor
    preconditioner: Tensor
    interpolation: Tensor
    elements: Elements

    @property
    def pixel_area_mm2(self) -> float:
        return (self.size_mm / self.samples) ** 2

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement of the skin, mm, away from the texture: C p."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        layer = self.cosines @ (self.symbol * amplitudes) @ self.cosines.T
        sides = self.elements.displacement(self._on_mesh(pressure))
        return layer + self.interpolation @ sides @ self.interpolation.T

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the compliance of a layer with sliding sides."""
        modes = self.cosines.T @ residual @ self.cosines
        return self.cosines @ (modes / self.preconditioner) @ self.cosines.T

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain at receptor depth: (..., 6, n, n), components as in `tactile.block.STRAIN_COMPONENTS`."""
        amplitudes = self.cosines.T @ pressure @ self.cosines
        layer = strain_from_modes(amplitudes, self.strain_symbols, self.cosines, self.sines)
        sides = self.elements.strain(self._on_mesh(pressure))
        return layer + self.interpolation @ sides @ self.interpolation.T

    def _on_mesh(self, pressure: Tensor) -> Tensor:
        """Pressures at the nodes that do the same work: forces are spread by the transpose."""
        nodes_per_pixel = (self.interpolation.shape[1] / self.samples) ** 2
        return nodes_per_pixel * (self.interpolation.T @ pressure @ self.interpolation)

    def to(self, dtype: torch.dtype) -> FiniteElementOperator:
        """The same operator in another precision."""
        return FiniteElementOperator(
            self.samples,
            self.size_mm,
            self.cosines.to(dtype),
            self.sines.to(dtype),
            self.symbol.to(dtype),
            self.strain_symbols.to(dtype),
            self.preconditioner.to(dtype),
            self.interpolation.to(dtype),
            self.elements.to(dtype),
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


def finite_element_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    mesh: int | None = None,
    exact_layer: bool = True,
) -> FiniteElementOperator:
    """The operator of a skin on an n x n patch: built the first time, from disk after that.

    Args:
        skin: only Poisson's ratio, thickness and depth matter here.
        samples: n.
        mesh: nodes along a side of the contact face, even; None: one at each pixel.
        exact_layer: without, the bare elements (for comparison), with a node at each pixel.
    """
    nodes = samples if mesh is None else mesh
    if nodes % 2:
        raise ValueError("the mesh must be even: the block is split at its mirror planes")
    if not exact_layer and nodes != samples:
        raise ValueError("the bare elements need a node at every pixel")
    nu, thickness, depth = skin.poisson_ratio, skin.thickness_mm, skin.depth_mm
    elements = _elements(nu, thickness, depth, nodes, size_mm)
    symbol, strains = layer_symbols(samples, size_mm, nu, thickness, depth)
    layer = (symbol, strains)
    if not exact_layer:
        elements = replace(
            elements,
            sliding=torch.zeros_like(elements.sliding),
            sliding_strain=torch.zeros_like(elements.sliding_strain),
        )
        layer = np.zeros_like(symbol), np.zeros_like(strains)
    pixels, places = ((np.arange(k) + 0.5) / k for k in (samples, nodes))
    interpolation = lagrange(places, pixels, False)
    cosines, sines = modes_at_centres(samples)
    return FiniteElementOperator(
        samples,
        size_mm,
        torch.as_tensor(cosines),
        torch.as_tensor(sines),
        torch.as_tensor(layer[0]),
        torch.as_tensor(layer[1]),
        torch.as_tensor(symbol),
        torch.as_tensor(interpolation),
        elements,
    ).to(dtype)


@lru_cache(maxsize=2)
def _elements(nu: float, thickness: float, depth: float, nodes: int, size: float) -> Elements:
    mesh = PixelBlock(size / 2.0, nodes // 2, graded_levels(thickness, size / nodes), depth, nu)
    key: dict[str, float | int | str] = {
        "code": fingerprint(pixel_block, pixel_layer, condensation, sys.modules[__name__]),
        "nu": nu,
        "thickness": thickness,
        "depth": depth,
        "size": size,
        "nodes": nodes,
    }
    arrays = {k: torch.as_tensor(a) for k, a in cached("reference", key, lambda: _build(mesh)).items()}
    reaching = torch.zeros(nodes * nodes, dtype=torch.float64)
    for parity in PARITIES:
        reaching[torch.as_tensor(_modes(nodes, size, depth, parity))] = 1.0

    def block(name: str) -> ParityBlock:
        modes = torch.as_tensor(_modes(nodes, size, depth, STORED[name]))
        return ParityBlock(STORED[name], arrays[f"compliance_{name}"], arrays[f"strain_{name}"], modes)

    cosines, sines = (torch.as_tensor(a) for a in modes_at_centres(nodes))
    sliding_strain = arrays["layer_strain"] * reaching.view(nodes, nodes)
    blocks = {name: block(name) for name in STORED}
    return Elements(cosines, sines, arrays["layer_surface"], sliding_strain, **blocks).to(torch.float64)


def _build(mesh: PixelBlock) -> Arrays:
    n, area = 2 * mesh.half, mesh.pitch_mm**2
    quarter = modes_at_centres(n)[0][mesh.half :]
    layer = discrete_layer(mesh)
    arrays: Arrays = {"layer_surface": layer.surface, "layer_strain": layer.strain}
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


def _modes(n: int, size_mm: float, depth_mm: float, parity: Parity) -> NDArray[np.intp]:
    """Numbers (of n²) of the cosine modes of a parity that reach the receptors."""
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    reaching = np.pi / size_mm * np.hypot(row, column) <= DECAY_AT_DEPTH / depth_mm
    of_parity = (row % 2 == parity[0]) & (column % 2 == parity[1])
    return np.flatnonzero(reaching & of_parity)
