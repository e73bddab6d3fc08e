"""Free sides of the skin block: what they add to a layer with sliding ones, through few motions of sides."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.cache import Arrays, Key, cached
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
    key: Key,
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

    def parts(parity: Parity) -> Arrays:
        added = release(quarter(), parity, felt(parity), ACCURACY)
        strain_out = added.strain_out.reshape(-1, added.strain_out.shape[-1]).T
        return {"face": added.face, "strain_in": added.strain_in, "strain_out": strain_out}

    loads, points = (matrix.shape[1] ** 2 // 4 for matrix in (hats, interpolation))
    # Single precision: 6e-8 off the same truth, half the bytes to keep and to read.
    layout = {"face": (loads, "f4"), "strain_in": (loads, "f4"), "strain_out": (6 * points, "f4")}
    kept = kept_parities(kind, key, parts, layout)
    # A pattern of one parity stores four times the energy of its quarter: hence 1/4 per unit of load on the
    # whole face.
    force = 0.25 * pixel_mm2
    return FreeSides(
        torch.as_tensor(hats),
        kept["face"] * np.sqrt(force),
        kept["strain_in"] * force,
        kept["strain_out"],
        torch.as_tensor(interpolation),
    )


def kept_parities(
    kind: str,
    key: Key,
    parts: Callable[[Parity], Arrays],
    layout: Mapping[str, tuple[int, str]],
    stored: Mapping[str, Parity] = STORED,
    shipped: Path | None = None,
) -> dict[str, Tensor]:
    """Parts of an operator for every parity: built the first time, from disk after that; in double precision.

    Args:
        kind, key, shipped: as of `cached`.
        parts: of a parity, each (rank, k), by name.
        layout: k of each part, and its precision on disk.
        stored: parities that are built and kept, by name; others are the transposed ones of those.

    Returns:
        (4, greatest rank, k) by name, in the order of `PARITIES`, with zeros below.
    """

    def build() -> Arrays:
        arrays: Arrays = {}
        with stage(f"building the {kind.replace('-', ' ')} (kept on disk)", len(stored)) as advance:
            for name, parity in stored.items():
                built = parts(parity).items()
                arrays |= {f"{part}_{name}": array.astype(layout[part][1]) for part, array in built}
                advance()
        return arrays

    each = {f"{part}_{name}": ((-1, k), kept) for name in stored for part, (k, kept) in layout.items()}
    arrays = cached(kind, key, build, each, shipped)
    names = {parity: name for name, parity in stored.items()}

    def of_parity(part: str, parity: Parity) -> Array:
        if parity in names:
            return arrays[f"{part}_{names[parity]}"]
        return _transposed(arrays[f"{part}_{names[parity[::-1]]}"], 6 if part == "strain_out" else 1)

    return {part: _stacked([of_parity(part, parity) for parity in PARITIES]) for part in layout}


def _transposed(patterns: Array, components: int) -> Array:
    """Patterns (rank, components * m²) with rows and columns exchanged; numbers (rank, 1) stay."""
    side = round((patterns.shape[1] / components) ** 0.5)
    exchanged = patterns.reshape(-1, components, side, side).swapaxes(2, 3)
    return (exchanged[:, ROWS_AND_COLUMNS_EXCHANGED] if components > 1 else exchanged).reshape(patterns.shape)


def _stacked(matrices: list[Array]) -> Tensor:
    """(n, greatest rank, k) of n matrices (rank, k), with zeros below."""
    rank = max(map(len, matrices))
    padded = [np.pad(one.astype(np.float64), ((0, rank - len(one)), (0, 0))) for one in matrices]
    return torch.as_tensor(np.stack(padded))
