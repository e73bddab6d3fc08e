"""Free sides of the skin block: what they add to a layer with sliding ones, through few motions of sides."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.cache import Arrays, cached
from relief.ground.progress import stage
from tactile.layer.cosine_layer import PARITIES, CosineLayer, Parity, TensorFields, is_odd
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.side_release import Quarter, release

STORED: dict[str, Parity] = {"even": (False, False), "mixed": (False, True), "odd": (True, True)}
"""Parities that are built and kept, by name; the fourth is the mixed one, transposed."""
ACCURACY = 1e-6
"""Greatest part of displacement or strain left out, in units of the greatest part."""
ROWS_AND_COLUMNS_EXCHANGED = [1, 0, 2, 4, 3, 5]
"""Order of the strain components when the axes row and column are exchanged."""
SOURCES = tuple(
    tuple(2 * (row ^ is_odd(pair, 0)) + (column ^ is_odd(pair, 1)) for row in (0, 1) for column in (0, 1))
    for pair in STRAIN_COMPONENTS
)
"""Index in `PARITIES` of the pressure's parity that causes each parity of each strain component."""


@dataclass(frozen=True, repr=False)
class FreeSides(TensorFields):
    """Difference of free sides from sliding ones, for pressures of all four parities at once.

    Parities are in the order of `PARITIES`; of m loads and e points along an axis, those of a quarter.

    Attributes:
        hats: (samples, 2m) from loads to the pixel centres, even ones and then odd ones.
        face: (4, rank, m²) F; the displacement is F'F times the loads.
        strain_in: (4, rank, m²) from loads to amplitudes.
        strain_out: (4, rank, 6e²) from amplitudes to strain.
        interpolation: (samples, 2e) from strains to pixels, even ones and then odd ones.
    """

    hats: Tensor
    face: Tensor
    strain_in: Tensor
    strain_out: Tensor
    interpolation: Tensor

    def displacement(self, pressure: Tensor) -> Tensor:
        """(..., n, n) mm, from pressures (..., n, n) in units of Young's modulus."""
        loads = _quarters(self.hats.T @ pressure @ self.hats)
        moved = torch.bmm(torch.bmm(loads, self.face.mT), self.face)
        side = self.hats.shape[1] // 2
        nodal = moved.transpose(0, 1).reshape(*pressure.shape[:-2], 4, side, side)
        return self.hats @ (_side_by_side(nodal) @ self.hats.T)

    def energy(self, pressure: Tensor) -> Tensor:
        """(..., 1, 1) half the work of pressures (..., n, n), in units of Young's modulus."""
        loads = _quarters(self.hats.T @ pressure @ self.hats)
        work = torch.bmm(loads, self.face.mT).square().sum((0, 2))
        return 0.5 * work.view(*pressure.shape[:-2], 1, 1)

    def strain(self, pressure: Tensor) -> Tensor:
        """(..., 6, n, n), from pressures (..., n, n) in units of Young's modulus."""
        loads = _quarters(self.hats.T @ pressure @ self.hats)
        felt = torch.bmm(torch.bmm(loads, self.strain_in.mT), self.strain_out)
        side = self.interpolation.shape[1] // 2
        coarse = felt.transpose(0, 1).reshape(*pressure.shape[:-2], 4, 6, side, side)
        placed = torch.stack(
            [coarse[..., list(sources), number, :, :] for number, sources in enumerate(SOURCES)], dim=-4
        )
        return self.interpolation @ _side_by_side(placed) @ self.interpolation.T


def _quarters(square: Tensor) -> Tensor:
    """(4, b, m²): the quarters of (..., 2m, 2m), flat, b of each."""
    m = square.shape[-1] // 2
    quarters = square.unflatten(-2, (2, m)).unflatten(-1, (2, m)).transpose(-3, -2)
    return quarters.reshape(-1, 4, m * m).transpose(0, 1)


def _side_by_side(quarters: Tensor) -> Tensor:
    """(..., 2m, 2m) of four quarters (..., 4, m, m)."""
    m = quarters.shape[-1]
    square = quarters.unflatten(-3, (2, 2)).transpose(-3, -2)
    return square.reshape(*quarters.shape[:-3], 2 * m, 2 * m)


@dataclass(frozen=True, repr=False)
class FreeSidedLayer(CosineLayer):
    """Normal displacement and strain at depth of the free-sided block under pressures on an n x n grid.

    Attributes:
        free_sides: their addition to the layer; None where the sides slide.
    """

    free_sides: FreeSides | None

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (..., n, n) of the skin, mm, away from the texture: C p."""
        layer = super().displacement(pressure)
        return layer if self.free_sides is None else layer + self.free_sides.displacement(pressure)

    def energy(self, pressure: Tensor) -> Tensor:
        """(..., 1, 1) elastic energy 1/2 p'Cp."""
        layer = super().energy(pressure)
        return layer if self.free_sides is None else layer + self.free_sides.energy(pressure)

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at receptor depth, components as in `tactile.strain.STRAIN_COMPONENTS`."""
        layer = super().strain(pressure)
        return layer if self.free_sides is None else layer + self.free_sides.strain(pressure)


def free_sides(
    kind: str,
    key: Mapping[str, float | int | str],
    quarter: Callable[[], Quarter],
    felt: Callable[[Parity], Array],
    hats: Array,
    interpolation: Array,
    pixel_mm2: float,
) -> FreeSides:
    """Free sides of a skin on a mesh: built the first time, from disk after that; in double precision.

    Args:
        kind: of the mesh, for people; first part of the name of the cache's file.
        key: everything that they depend on, as for `cached`.
        quarter: makes the mesh.
        felt: of a parity, (m², patterns) orthonormal patterns of load that reach the receptors.
        hats, interpolation: as of `FreeSides`.
        pixel_mm2: area of a pixel.
    """

    def build() -> Arrays:
        arrays: Arrays = {}
        with stage(f"building the {kind.replace('-', ' ')} (kept on disk)", len(STORED)) as advance:
            for name, parity in STORED.items():
                added = vars(release(quarter(), parity, felt(parity), ACCURACY))
                # Single precision: 6e-8 off the same truth, half the bytes to keep and to read.
                arrays |= {f"{part}_{name}": array.astype(np.float32) for part, array in added.items()}
                advance()
        return arrays

    loads, points = (matrix.shape[1] ** 2 // 4 for matrix in (hats, interpolation))
    shapes = {"face": (-1, loads), "strain_in": (-1, loads), "strain_out": (6, points, -1)}
    layout = {f"{part}_{name}": (shape, "f4") for name in STORED for part, shape in shapes.items()}
    arrays = cached(kind, key, build, layout)
    # A pattern of one parity stores four times the energy of its quarter: hence 1/4 per unit of load on the
    # whole face.
    force = 0.25 * pixel_mm2
    parts = {
        part: [_of_parity(arrays, part, parity).astype(np.float64) for parity in PARITIES] for part in shapes
    }
    return FreeSides(
        torch.as_tensor(hats),
        _stacked(parts["face"]) * np.sqrt(force),
        _stacked(parts["strain_in"]) * force,
        _stacked([out.reshape(-1, out.shape[-1]).T for out in parts["strain_out"]]),
        torch.as_tensor(interpolation),
    )


def _of_parity(arrays: Arrays, part: str, parity: Parity) -> Array:
    """Part of a parity's `Release`; of one that is not stored, that of the transposed pattern."""
    names = {parity: name for name, parity in STORED.items()}
    if parity in names:
        return arrays[f"{part}_{names[parity]}"]
    array = arrays[f"{part}_{names[parity[::-1]]}"]
    if part == "strain_out":
        side = round(array.shape[1] ** 0.5)
        exchanged = array.reshape(6, side, side, -1).transpose(0, 2, 1, 3)[ROWS_AND_COLUMNS_EXCHANGED]
        return exchanged.reshape(array.shape)
    side = round(array.shape[1] ** 0.5)
    return array.reshape(-1, side, side).transpose(0, 2, 1).reshape(array.shape)


def _stacked(matrices: list[Array]) -> Tensor:
    """(k, greatest rank, ...) of k matrices (rank, ...), with zeros below."""
    rank = max(len(matrix) for matrix in matrices)
    return torch.as_tensor(
        np.stack([np.pad(matrix, ((0, rank - len(matrix)), (0, 0))) for matrix in matrices])
    )
