"""Finite elements: the skin block as an operator on pressures, the reference that other models are judged by.

    C p      = exact layer  p  +  T (free - sliding) T' p
    strain p = the same of the strain

The formula is the one of `tactile.layer.elastic_layer` (see `cosine_layer` beside it), on a mesh with a node
at every pixel or with 64 nodes a side. The block does not depend on the texture: its parity blocks with free
sides are condensed onto the nodes of the contact face once per skin and mesh, and kept on disk; a texture
costs some dense products after that. Elements err most under the shortest waves of pressure, which do not
feel the sides of the block. The same elements with sliding sides are solved mode by mode
(`tactile.structured.pixel_layer`), so the difference is free of this error. T interpolates from the nodes of
the mesh to the pixels, where contact is decided; where there is a node at every pixel, T is the identity.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.common.arrays import Array
from relief.common.cache import Arrays, cached, fingerprint, is_cached
from relief.common.progress import stage
from tactile.layer.cosine_layer import (
    PARITIES,
    CosineLayer,
    Parity,
    TensorFields,
    is_odd,
    modes_at_centres,
    sliding_layer,
)
from tactile.layer.interpolation import lagrange
from tactile.layer.layers import LEAST_ROWS, Stack, boundaries
from tactile.skin import Skin
from tactile.strain import STRAIN_COMPONENTS

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
"""The same of a skin with layers, whose strain bends at the boundaries: with 0.4 mm of 4 MPa over 0.2 MPa,
V of four reliefs falls by 0.7 to 1.5 % from rows of 0.2 mm to these, toward the elastic layer's."""
STORED: dict[str, Parity] = {"even": (False, False), "mixed": (False, True), "odd": (True, True)}
"""Parity blocks that are built and kept, by name; the fourth is the mixed one, transposed."""
ROWS_AND_COLUMNS_EXCHANGED = [1, 0, 2, 4, 3, 5]
"""Order of the strain components when the axes row and column are exchanged."""


@dataclass(frozen=True, repr=False)
class ParityBlock(TensorFields):
    """Block under loads of one parity, with free sides.

    Attributes:
        parity: whether the loads are odd in (row, column).
        compliance: (half², half²) from pressures (units of E) to displacement (mm) on a quarter of the face.
        strain: (6, half², modes) from cosine amplitudes of the pressure to strain on a quarter.
        modes: (modes,) which of the n² cosine modes these are.
    """

    parity: Parity
    compliance: Tensor
    strain: Tensor
    modes: Tensor

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., n, n) mm, of this parity's part of a pressure (..., n, n)."""
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


@dataclass(frozen=True, repr=False)
class Elements(TensorFields):
    """What free sides add to sliding ones, by the elements of an m x m mesh, m even.

    Attributes:
        sliding: the elements with sliding sides, diagonal in the mesh's own modes.
        even, mixed, odd: the parity blocks with free sides. What is odd in the row is the mixed block's,
            transposed.
        interpolation: (n, m) from the mesh to the pixels along an axis.
    """

    sliding: CosineLayer
    even: ParityBlock
    mixed: ParityBlock
    odd: ParityBlock
    interpolation: Tensor

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., n, n) mm, from pressures (..., n, n) in units of Young's modulus."""
        nodal = self._on_mesh(pressure)
        mixed = self.mixed.displacement(torch.stack((nodal, nodal.mT)))
        free = self.even.displacement(nodal) + self.odd.displacement(nodal) + mixed[0] + mixed[1].mT
        return self.interpolation @ (free - self.sliding.displacement(nodal)) @ self.interpolation.T

    def strain(self, pressure: Tensor) -> Tensor:
        """(..., 6, n, n), from pressures (..., n, n) in units of Young's modulus."""
        nodal = self._on_mesh(pressure)
        amplitudes = self.sliding.amplitudes(nodal)
        sliding = self.sliding.strain_of(amplitudes)
        mixed = self.mixed.strains(torch.stack((amplitudes, amplitudes.mT)))
        exchanged = mixed[1].mT[..., ROWS_AND_COLUMNS_EXCHANGED, :, :]
        free = self.even.strains(amplitudes) + self.odd.strains(amplitudes) + mixed[0] + exchanged
        return self.interpolation @ (free - sliding) @ self.interpolation.T

    def _on_mesh(self, pressure: Tensor) -> Tensor:
        """Pressures (..., m, m) at the nodes that do the same work: forces are spread by the transpose."""
        nodes_per_pixel = (self.interpolation.shape[1] / self.interpolation.shape[0]) ** 2
        return nodes_per_pixel * (self.interpolation.T @ pressure @ self.interpolation)


@dataclass(frozen=True, repr=False)
class FiniteElementOperator(CosineLayer):
    """Normal displacement and strain at depth of the free-sided block under pressures on an n x n grid.

    Attributes:
        elements: what free sides add to the layer.
        bare: whether the layer is left out of displacement and strain, and `elements` are the whole block.
    """

    elements: Elements
    bare: bool

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (..., n, n) of the skin, mm, away from the texture: C p."""
        if self.bare:
            return self.elements.displacement(pressure)
        return super().displacement(pressure) + self.elements.displacement(pressure)

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at receptor depth, components as in `tactile.strain.STRAIN_COMPONENTS`."""
        if self.bare:
            return self.elements.strain(pressure)
        return super().strain(pressure) + self.elements.strain(pressure)


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
        skin: all but force and modulus matters here.
        samples: n.
        size_mm: side of the patch.
        dtype: of the operator's tensors.
        mesh: nodes along a side of the contact face, even; None: one at each pixel.
        exact_layer: without, the bare elements (for comparison), with a node at each pixel.

    Raises:
        ValueError: the mesh is odd, or coarser than the pixels without the exact layer.
    """
    nodes = samples if mesh is None else mesh
    if nodes % 2:
        raise ValueError("the mesh must be even: the block is split at its mirror planes")
    if not exact_layer and nodes != samples:
        raise ValueError("the bare elements need a node at every pixel")
    block = skin.at_unit_modulus()
    sliding, blocks = _elements(block, nodes, size_mm)
    if not exact_layer:
        symbol, strain = torch.zeros_like(sliding.symbol), torch.zeros_like(sliding.strain_symbols)
        sliding = replace(sliding, symbol=symbol, strain_symbols=strain)
    pixels, places = ((np.arange(k) + 0.5) / k for k in (samples, nodes))
    elements = Elements(sliding, **blocks, interpolation=torch.as_tensor(lagrange(places, pixels, False)))
    layer = vars(sliding_layer(block, samples, size_mm))
    return FiniteElementOperator(**layer, elements=elements, bare=not exact_layer).to(dtype)


@lru_cache(maxsize=2)
def _elements(skin: Skin, nodes: int, size: float) -> tuple[CosineLayer, dict[str, ParityBlock]]:
    """The elements with sliding sides, and the blocks with free ones by name, in double precision."""
    modes = {parity: _modes(nodes, size, skin.depth_mm, parity) for parity in PARITIES}
    quarter, components = (nodes // 2) ** 2, len(STRAIN_COMPONENTS)
    layout = {"layer_surface": ((nodes, nodes), "f8"), "layer_strain": ((components, nodes, nodes), "f8")}
    for name, parity in STORED.items():
        layout[f"compliance_{name}"] = (quarter, quarter), "f4"
        layout[f"strain_{name}"] = (components, quarter, len(modes[parity])), "f4"
    stored = cached("finite-elements", _key(skin, nodes, size), lambda: _build(skin, nodes, size), layout)
    arrays = {name: torch.as_tensor(array) for name, array in stored.items()}
    reaching = torch.zeros(nodes * nodes, dtype=torch.float64)
    for places in modes.values():
        reaching[torch.as_tensor(places)] = 1.0
    blocks = {}
    for name, parity in STORED.items():
        of_parity = torch.as_tensor(modes[parity])
        block = ParityBlock(parity, arrays[f"compliance_{name}"], arrays[f"strain_{name}"], of_parity)
        blocks[name] = block.to(torch.float64)
    strain = arrays["layer_strain"] * reaching.view(nodes, nodes)
    cosines, sines = map(torch.as_tensor, modes_at_centres(nodes))
    return CosineLayer(nodes, size, cosines, sines, arrays["layer_surface"], strain), blocks


def is_built(skin: Skin, nodes: int, size_mm: float) -> bool:
    """Whether the elements of a skin are in the cache on disk; arguments as of `finite_element_operator`."""
    return is_cached("finite-elements", _key(skin.at_unit_modulus(), nodes, float(size_mm)))


def _key(skin: Skin, nodes: int, size: float) -> dict[str, float | int | str]:
    return {"code": fingerprint(__name__), **skin.structure, "size": size, "nodes": nodes}


def _build(skin: Skin, nodes: int, size: float) -> Arrays:
    # Imported to build only: the assembly and the solvers are not loaded while the cache serves.
    from tactile.structured.pixel_block import PixelBlock, face_response
    from tactile.structured.pixel_layer import discrete_layer

    levels = graded_levels(skin.thickness_mm, size / nodes, skin.stack)
    mesh = PixelBlock(size / 2.0, nodes // 2, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)
    area = mesh.pitch_mm**2
    quarter = modes_at_centres(nodes)[0][mesh.half :]
    layer = discrete_layer(mesh)
    arrays: Arrays = {"layer_surface": layer.surface, "layer_strain": layer.strain}
    steps = 2 * len(STORED)
    with stage(f"building the finite elements ({nodes} nodes a side, kept on disk)", steps) as advance:
        for name, parity in STORED.items():
            row, column = np.divmod(_modes(nodes, size, skin.depth_mm, parity), nodes)
            loads = (quarter[:, None, row] * quarter[None, :, column]).reshape(mesh.half**2, -1)
            response = face_response(mesh, parity, area * loads, advance=advance)
            # Single precision: 6e-8 off the same truth, half the bytes to keep and to read.
            arrays[f"compliance_{name}"] = (area * response.compliance).astype(np.float32)
            arrays[f"strain_{name}"] = response.strain.astype(np.float32)
    return arrays


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
