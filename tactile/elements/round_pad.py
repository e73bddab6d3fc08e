"""Round pad: the layer of the skin, corrected for the curvature of skin and bone by quadratic elements.

    C p      = exact layer  p  +  B (round - flat) B' p
    strain p = the same of the strain

B are the long cosine modes of the patch, in which the exact layer is diagonal; shorter ones are left to the
layer. Round and flat are the same quadratic hexahedra (`tactile.structured.pad_hexahedra`), once between the
skin's paraboloid and a bone that follows it, and once between planes, so that their discretisation error
cancels. Elements yield less than the exact layer (Ritz), so that exact - B flat B' is positive semidefinite
and C is symmetric positive definite.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.cache import Arrays, fingerprint, is_cached, ship
from relief.ground.errors import InputError
from tactile.layer.cosine_layer import CosineLayer, Parity, TensorFields, is_odd, sliding_layer
from tactile.layer.free_sides import STORED, kept_parities
from tactile.layer.skin_layers import SAME_DEPTH_MM, boundaries
from tactile.skin import Skin
from tactile.sparse import factorised
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.pad_hexahedra import RoundPad, gauss_points, quadratics

KIND = "round-pad"
"""Name of the differences in the cache."""
SHIPPED = Path(__file__).resolve().parent.parent / "operators"
"""Folder of the differences of named fingers, which come with Retouch."""
ACCURACY = 1e-4
"""Greatest part of displacement or strain left out, in units of the greatest part."""
CHUNK = 64
"""Loads solved at a time."""
COMPONENTS = len(STRAIN_COMPONENTS)
LOAD_POINTS, STRAIN_POINTS = 6, 2
"""Gauss points of an element along an axis at which loads are integrated, and strain is taken."""
ALL: dict[str, Parity] = STORED | {"mixed, transposed": (True, False)}
"""Parities that are built and kept of a pad with two radii, by name; of one with one radius, `STORED`."""
THICKEST_PAD = 0.8
"""Greatest thickness of the pad in units of its least radius: the bone's radius is what is left."""

Radii = tuple[float, float]
"""Radii of the skin along rows and columns, mm."""


@dataclass(frozen=True)
class PadMesh:
    """Resolution of the elements, and of the pressures that are corrected by them.

    Attributes:
        shortest_mm: shortest wave of pressure that is corrected, along an axis.
        element_mm: side of the elements along rows and columns, under the contact.
        first_mm: thickness of the row of elements at the skin.
        growth: ratio of the thicknesses of neighbouring rows, toward the bone.
        thickest_mm: greatest thickness of a row.
    """

    shortest_mm: float = 1.0
    element_mm: float = 0.5
    first_mm: float = 0.25
    growth: float = 1.3
    thickest_mm: float = 0.8

    def cutoff(self, size_mm: float) -> int:
        """Modes along an axis of a patch, even; the first one is constant, and a wave has two of them."""
        return 2 * max(1, round(size_mm / self.shortest_mm))


@dataclass(frozen=True, repr=False)
class Curvature(TensorFields):
    """Difference of a curved layer from a flat one, in the long cosine modes of each parity.

    Parities are in the order of `PARITIES`; m is the cutoff.

    Attributes:
        face: (4, rank, m²/4) orthogonal rows F of the difference of displacements F' diag(signs) F.
        signs: (4, rank, 1) 1 or -1.
        strain_in: (4, rank, m²/4) from loads to amplitudes.
        strain_out: (4, rank, 6 m²/4) from amplitudes to strain.
    """

    face: Tensor
    signs: Tensor
    strain_in: Tensor
    strain_out: Tensor

    @property
    def cutoff(self) -> int:
        """m."""
        return 2 * round(self.face.shape[-1] ** 0.5)

    def displacement(self, amplitudes: Tensor) -> Tensor:
        """(..., m, m) what is added, from amplitudes (..., m, m) of the pressure."""
        loads = _by_parity(amplitudes)
        moved = ((loads @ self.face.mT) * self.signs.mT) @ self.face
        return _together(moved, amplitudes.shape)

    def energy(self, amplitudes: Tensor) -> Tensor:
        """(..., 1, 1) half the work that is added, from amplitudes (..., m, m) of the pressure."""
        work = ((_by_parity(amplitudes) @ self.face.mT).square() * self.signs.mT).sum((0, 2))
        return 0.5 * work.view(*amplitudes.shape[:-2], 1, 1)

    def strain(self, amplitudes: Tensor) -> Tensor:
        """(..., 6, m, m) what is added, from amplitudes (..., m, m) of the pressure."""
        felt = (_by_parity(amplitudes) @ self.strain_in.mT) @ self.strain_out
        shape = *amplitudes.shape[:-2], COMPONENTS, *amplitudes.shape[-2:]
        return _together(felt.unflatten(-1, (COMPONENTS, -1)).flatten(1, 2), shape)


def _by_parity(square: Tensor) -> Tensor:
    """(4, b, m²/4): modes of each parity of (..., m, m), flat, b of each."""
    half = square.shape[-1] // 2
    split = square.reshape(-1, half, 2, half, 2).permute(2, 4, 0, 1, 3)
    return split.reshape(4, -1, half * half)


def _together(parities: Tensor, shape: torch.Size | tuple[int, ...]) -> Tensor:
    """The modes (*shape) of those of each parity, the inverse of `_by_parity`."""
    half = shape[-1] // 2
    split = parities.reshape(2, 2, -1, half, half).permute(2, 3, 0, 4, 1)
    return split.reshape(shape)


@dataclass(frozen=True, repr=False)
class RoundPadOperator(CosineLayer):
    """Normal displacement and strain at depth of a round pad under pressures on an n x n grid.

    Attributes:
        curvature: its addition to the flat layer.
    """

    curvature: Curvature

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (..., n, n) of the skin, mm, away from the texture: C p."""
        amplitudes = self.amplitudes(pressure)
        moved, cutoff = self.symbol * amplitudes, self.curvature.cutoff
        moved[..., :cutoff, :cutoff] += self.curvature.displacement(amplitudes[..., :cutoff, :cutoff])
        return self.field(moved)

    def energy(self, pressure: Tensor) -> Tensor:
        """(..., 1, 1) elastic energy 1/2 p'Cp."""
        amplitudes, cutoff = self.amplitudes(pressure), self.curvature.cutoff
        layer = 0.5 * (self.symbol * amplitudes.square()).sum((-2, -1), keepdim=True)
        return layer + self.curvature.energy(amplitudes[..., :cutoff, :cutoff])

    def strain_modes(self, amplitudes: Tensor) -> Tensor:
        """Amplitudes (..., 6, n, n) of the strain, from those (..., n, n) of the pressure."""
        modes, cutoff = super().strain_modes(amplitudes), self.curvature.cutoff
        modes[..., :cutoff, :cutoff] += self.curvature.strain(amplitudes[..., :cutoff, :cutoff])
        return modes


def round_pad_operator(
    skin: Skin,
    samples: int,
    size_mm: float,
    mesh: PadMesh | None = None,
) -> RoundPadOperator:
    """The operator of a round finger on an n x n patch: built the first time, from disk after that.

    Its tensors are in double precision.

    Args:
        skin: all but force and modulus matters here.
        samples: n, at least two to the shortest wave of the mesh.
        size_mm: side of the patch.
        mesh: None for `PadMesh()`.

    Raises:
        InputError: a finger that is not round, or thicker than it is round; too few samples.
    """
    mesh = mesh or PadMesh()
    if skin.radii_mm is None:
        raise InputError(
            f'skin.shape: "{skin.shape}" has no radius; the elements are those of a round finger'
        )
    if samples < mesh.cutoff(size_mm):
        raise InputError(
            f"heights: {samples} samples a side of {size_mm:g} mm are fewer than two to the shortest wave "
            f"that a round finger is corrected for, {mesh.shortest_mm:g} mm"
        )
    if skin.thickness_mm > THICKEST_PAD * min(skin.radii_mm):
        raise InputError(
            f"skin.thickness_mm: {skin.thickness_mm:g} is more than {THICKEST_PAD:g} of the radius "
            f"{min(skin.radii_mm):g} mm: a bone that follows the skin would fold"
        )
    return _operator(skin.at_unit_modulus(), skin.radii_mm, samples, float(size_mm), mesh)


@lru_cache(maxsize=8)
def _operator(skin: Skin, radii: Radii, samples: int, size: float, mesh: PadMesh) -> RoundPadOperator:
    layer = sliding_layer(skin, samples, size)
    return RoundPadOperator(**vars(layer), curvature=_curvature(skin, radii, size, mesh))


def is_built(skin: Skin, size_mm: float, mesh: PadMesh | None = None) -> bool:
    """Whether the difference is in the cache on disk; arguments as of `round_pad_operator`."""
    if skin.radii_mm is None:
        return False
    key = _key(skin.at_unit_modulus(), skin.radii_mm, float(size_mm), mesh or PadMesh())
    return is_cached(KIND, key, SHIPPED)


def keep_with_package(skin: Skin, size_mm: float) -> Path:
    """Build the difference of a finger and write it among those that come with Retouch; return its file."""
    assert skin.radii_mm is not None
    key = _key(skin.at_unit_modulus(), skin.radii_mm, float(size_mm), PadMesh())
    _curvature(skin.at_unit_modulus(), skin.radii_mm, float(size_mm), PadMesh())
    return ship(KIND, key, SHIPPED)


def _key(skin: Skin, radii: Radii, size: float, mesh: PadMesh) -> dict[str, float | int | str]:
    return {
        "code": fingerprint(__name__),
        **skin.structure,
        **dict(zip(("radius", "across"), radii, strict=True)),
        "size": size,
        **asdict(mesh),
    }


def _curvature(skin: Skin, radii: Radii, size: float, mesh: PadMesh) -> Curvature:
    modes = (mesh.cutoff(size) // 2) ** 2
    # Patterns of strain have unit norm and are a correction: half precision does.
    layout = {"face": (modes, "f4"), "strain_in": (modes, "f2"), "strain_out": (COMPONENTS * modes, "f2")}
    layout |= dict.fromkeys(("signs", "strain_sizes"), (1, "f4"))
    stored = STORED if radii[0] == radii[1] else ALL
    key, parts = _key(skin, radii, size, mesh), partial(difference, skin, radii, size, mesh)
    kept = kept_parities(KIND, key, parts, layout, stored, SHIPPED)
    return Curvature(
        kept["face"], kept["signs"], kept["strain_in"], kept["strain_sizes"] * kept["strain_out"]
    )


def difference(skin: Skin, radii: Radii, size: float, mesh: PadMesh, parity: Parity) -> Arrays:
    """Parts of `Curvature` for one parity: what the round pad adds to the flat one, in low rank.

    Args:
        skin: of unit modulus.
        radii: along rows and columns, mm.
        size: side of the patch, mm.
        mesh: its elements and its shortest wave.
        parity: of the pressures.
    """
    ends = np.linspace(0.0, 0.5 * size, int(np.ceil(0.5 * size / mesh.element_mm)) + 1)
    levels = pad_levels(skin, mesh)

    def pad(each: Radii) -> RoundPad:
        return RoundPad(ends, ends, levels, each, skin.poisson_ratio, skin.stack)

    cutoff, flat = mesh.cutoff(size), (np.inf, np.inf)
    face, strain = response(pad(radii), parity, skin.depth_mm, cutoff)
    flat_face, flat_strain = flat_response(pad(flat), parity, skin.depth_mm, cutoff)
    every = np.arange(len(face))
    face[every, every] -= flat_face
    strain[:, every, every] -= flat_strain
    strain = strain.reshape(-1, len(face))
    values, vectors = np.linalg.eigh(0.5 * (face + face.T))
    kept = np.abs(values) > ACCURACY * np.abs(values).max()
    left, sizes, right = np.linalg.svd(strain, full_matrices=False)
    rank = int((sizes > ACCURACY * sizes[0]).sum())
    return {
        "face": (vectors[:, kept] * np.sqrt(np.abs(values[kept]))).T,
        "signs": np.sign(values[kept, None]),
        "strain_in": right[:rank],
        "strain_sizes": sizes[:rank, None],
        "strain_out": left[:, :rank].T,
    }


def pad_levels(skin: Skin, mesh: PadMesh) -> Array:
    """Ends of the rows of elements: growing from the skin to the bone, with one at each boundary."""
    levels = [0.0]
    for end in (*boundaries(skin.stack), skin.thickness_mm):
        top = levels[-1]
        first = min(mesh.first_mm + (mesh.growth - 1.0) * top, mesh.thickest_mm)
        rows: list[float] = []
        while sum(rows) < end - top - SAME_DEPTH_MM:
            rows.append(min(first * mesh.growth ** len(rows), mesh.thickest_mm))
        depths = np.cumsum(rows)
        levels.extend(top + depths * ((end - top) / depths[-1]))
    return np.array(levels)


def response(pad: RoundPad, parity: Parity, depth_mm: float, cutoff: int) -> tuple[Array, Array]:
    """Displacement and strain at depth under pressures of unit norm in each cosine mode of a parity.

    Args:
        pad: the mesh of a quarter.
        parity: of the modes.
        depth_mm: receptor depth.
        cutoff: modes along an axis, of both parities.

    Returns:
        (modes, modes) the displacement in the mode of a row, under the pressure of a column's; and (6, modes,
        modes) the strain in the modes of its components, which are sines along an axis where they are odd.
    """
    loads, felt = _loads_and_response(pad, parity, depth_mm, cutoff)
    modes = loads.shape[-1]
    face, strain = np.empty((modes, modes)), np.empty((COMPONENTS, modes, modes))
    for first in range(0, modes, CHUNK):
        here = slice(first, first + CHUNK)
        face[:, here], strain[..., here] = felt(loads[..., here])
    return face, strain


def flat_response(pad: RoundPad, parity: Parity, depth_mm: float, cutoff: int) -> tuple[Array, Array]:
    """Diagonals (modes,) and (6, modes) of `response`, of a flat pad with even elements along each axis.

    The modes are eigenmodes of the elements: one solution under the sum of all modes gives each response.
    """
    loads, felt = _loads_and_response(pad, parity, depth_mm, cutoff)
    face, strain = felt(loads.sum(axis=-1, keepdims=True))
    return face[:, 0], strain[..., 0]


def _loads_and_response(
    pad: RoundPad, parity: Parity, depth_mm: float, cutoff: int
) -> tuple[Array, Callable[[Array], tuple[Array, Array]]]:
    """Forces (rows, columns, modes) of the modes on the nodes of the skin, and their effect.

    The effect is a map from forces (rows, columns, k) to displacement (modes, k) and strain (6, modes, k).
    """
    rows, columns = (
        _modes_along(ends, odd, cutoff) for ends, odd in zip((pad.rows, pad.columns), parity, strict=True)
    )
    modes = (cutoff // 2) ** 2
    loads = np.einsum("ia,jb->ijab", rows.forces, columns.forces).reshape(*pad.shape[:2], modes)
    free = pad.free(parity)
    matrix = pad.stiffness()[free][:, free]
    solve = factorised(matrix + sp.triu(matrix, 1).T)

    def felt(forces: Array) -> tuple[Array, Array]:
        pushed = np.zeros((*pad.shape, 3, forces.shape[-1]))
        pushed[:, :, 0, 2] = forces
        moved = np.zeros_like(pushed)
        moved.reshape(-1, forces.shape[-1])[free] = solve(pushed.reshape(-1, forces.shape[-1])[free])
        # Four quarters of the skin.
        face = 4.0 * np.tensordot(loads, moved[:, :, 0, 2], axes=((0, 1), (0, 1)))
        strain = np.empty((COMPONENTS, *face.shape))
        fields = pad.strains(moved, depth_mm, (rows.points, columns.points))
        for number, (pair, field) in enumerate(zip(STRAIN_COMPONENTS, fields, strict=True)):
            down, right = (along.read[is_odd(pair, axis)] for axis, along in enumerate((rows, columns)))
            part = np.tensordot(right, np.tensordot(down, field, axes=(0, 0)), axes=(0, 1))
            strain[number] = part.swapaxes(0, 1).reshape(face.shape)
        return face, strain

    return loads, felt


class _ModesAlong(NamedTuple):
    """Modes of a parity along an axis, from the middle of the patch to its side.

    Attributes:
        forces: (nodes, modes) integrals of the hats times the cosines.
        points: (k,) places where strain is taken, mm.
        read: (k, modes) weights by which values there are projected onto cosines, and onto sines.
    """

    forces: Array
    points: Array
    read: tuple[Array, Array]


def _modes_along(ends: Array, odd: bool, cutoff: int) -> _ModesAlong:
    numbers, size = np.arange(odd, cutoff, 2), 2.0 * ends[-1]
    norm = np.sqrt(np.where(numbers == 0, 1.0, 2.0) / size)

    def waves(places: Array, function: Callable[[Array], Array]) -> Array:
        return norm * function(np.pi * np.outer(places / size + 0.5, numbers))

    places, weights = gauss_points(ends, LOAD_POINTS)
    forces = (quadratics(ends, places, False) * weights[:, None]).T @ waves(places, np.cos)
    points, weights = gauss_points(ends, STRAIN_POINTS)
    cosines, sines = (2.0 * weights[:, None] * waves(points, function) for function in (np.cos, np.sin))
    return _ModesAlong(forces, points, (cosines, sines))
