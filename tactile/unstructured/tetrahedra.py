"""Tetrahedra: skin of any shape as an operator on pressures, an independent check of the structured block.

Elasticity is linear, with the base's Young's modulus as the unit; the flat top is bonded to the bone, the
sides are free. Pressure is vertical, per horizontal area, bilinear between the pixel centres and constant
beyond the outermost, with its short waves raised so that they are as compliant as waves of the sample grid
(`_sharpening`), and applied by integration over the contact face. The displacement of a pixel is the mean
that the pixel's pressure works on, so that the compliance is symmetric. Pressing a curved skin on a relief h
is, in small-strain theory and with vertical pressure, pressing a flat one on h minus `rise_mm`, the skin's
height over its lowest point.

Mesh axes are (x, y, z) as in `tactile.unstructured.surface`; strains have axes (row, column, depth) = (-y,
x, z).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
import scipy.sparse as sp
import skfem
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from tactile.contact import TIGHT, Compliance, solve_contact
from tactile.elements.condensation import condensed_onto_loads
from tactile.layer.layer_response import layer_response
from tactile.skin import Skin
from tactile.strain import STRAIN_COMPONENTS, principal_strain
from tactile.touch import Touch, share_in_contact
from tactile.unstructured.meshing import Tetrahedra
from tactile.unstructured.quadratic import gradients_at, pixel_forces, stiffness
from tactile.unstructured.surface import height_over, locate, lower_face

Solve = Callable[[Array], Array]

MESH_AXES = (1, 0, 2)
"""Mesh axis (x, y, z) along which each of row, column, depth lies."""
SIGNS = (-1.0, 1.0, 1.0)
"""Direction of row, column, depth along the mesh axis."""


@dataclass(frozen=True)
class TetrahedralOperator(Compliance):
    """Normal displacement and strain at depth of a meshed skin under pressures on an n x n grid.

    A `tactile.model.SkinOperator` without gradients of the strain. Pressures have shape (..., n, n) and are
    in units of Young's modulus.

    Attributes:
        samples: n.
        size_mm: side of the touched square.
        rise_mm: (n, n) height of the skin above its lowest point at the pixel centres.
        unknowns: number of displacements that the elements solve for.
        forces: (face, n²) vertical forces on the nodes of the contact face per pressure.
        work: from pressures (n², m) to each pixel's mean displacement times area.
        solution: all displacements (3 * nodes, m), component by component, under pressures (n², m).
        gradient: for x, y and z, (n², nodes): derivative at the receptors of a nodal field.
        symbol: (n, n) compliance per cosine mode of a flat layer, for the preconditioner only.
    """

    samples: int
    size_mm: float
    rise_mm: Tensor
    unknowns: int
    forces: sp.csr_matrix
    work: Solve
    solution: Solve
    gradient: tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]
    symbol: Array

    def __repr__(self) -> str:
        grid = f"{self.samples} x {self.samples} samples of {self.size_mm:g} mm"
        return f"TetrahedralOperator({grid}, {self.unknowns} unknowns)"

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement of the skin, mm, away from the texture: C p."""
        moved = self.work(self._columns(pressure)) * (self.samples / self.size_mm) ** 2
        return _band_limited(torch.as_tensor(moved.T.copy()).view(pressure.shape))

    def precondition(self, residual: Tensor) -> Tensor:
        """Inverse of the compliance of a flat layer with sliding sides."""
        modes = scipy.fft.dctn(residual.detach().numpy(), axes=(-2, -1), norm="ortho")
        return torch.as_tensor(scipy.fft.idctn(modes / self.symbol, axes=(-2, -1), norm="ortho"))

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain at receptor depth: (..., 6, n, n), components as in `tactile.strain.STRAIN_COMPONENTS`.

        The strain is zero where the receptors' depth lies above the bonded face.
        """
        moved = self.solution(self._columns(pressure))
        fields = moved.reshape(3, -1, moved.shape[1])

        def derivative(component: int, by: int) -> Array:
            sign = SIGNS[component] * SIGNS[by]
            return np.asarray(sign * (self.gradient[MESH_AXES[by]] @ fields[MESH_AXES[component]]))

        strains = [0.5 * (derivative(a, b) + derivative(b, a)) for a, b in STRAIN_COMPONENTS]
        ordered = torch.as_tensor(np.moveaxis(np.stack(strains), 2, 0).copy())
        return ordered.view(*pressure.shape[:-2], 6, self.samples, self.samples)

    def _columns(self, pressure: Tensor) -> Array:
        """(n², items)."""
        return np.asarray(_band_limited(pressure.detach()).reshape(-1, self.samples**2).numpy().T)


def _band_limited(fields: Tensor) -> Tensor:
    """Fields (..., n, n) whose bilinear hats are as compliant, wave by wave, as waves of the grid are."""
    modes = scipy.fft.dctn(fields.numpy(), axes=(-2, -1), norm="ortho") * _sharpening(fields.shape[-1])
    return torch.as_tensor(scipy.fft.idctn(modes, axes=(-2, -1), norm="ortho"))


@lru_cache
def _sharpening(samples: int) -> Array:
    """(n, n) factors of cosine modes, which undo what hats and their averages take from short waves.

    The compliance of a half-space is inverse to the wavenumber; hats also hold waves shorter than the grid's.
    """
    wave = np.pi * np.arange(samples)[:, None] / samples + 2.0 * np.pi * np.arange(-1, 2)
    share = np.sinc(wave / (2.0 * np.pi)) ** 4
    length = np.maximum(np.hypot(wave[:, None, :, None], wave[None, :, None, :]), 1e-9)
    felt = (share[:, None, :, None] * share[None, :, None, :] / length).sum(axis=(2, 3))
    return np.asarray(1.0 / np.sqrt(felt * length[:, :, 1, 1]))


def tetrahedral_operator(skin: Skin, mesh: Tetrahedra, samples: int, size_mm: float) -> TetrahedralOperator:
    """Assemble and factorise the operator of a meshed skin. The result is not cached.

    Args:
        skin: Poisson's ratio and the receptor depth matter here, and the thickness to the preconditioner.
        mesh: its contact face must cover the square of side `size_mm` around x = y = 0.
        samples: n.

    Raises:
        InputError: the contact face does not cover the square, or there is no bonded face.
    """
    tetrahedra = skfem.MeshTet(np.ascontiguousarray(mesh.vertices.T), np.ascontiguousarray(mesh.cells.T))
    basis = skfem.Basis(tetrahedra, skfem.ElementTetP2(), intorder=2)
    face = lower_face(mesh.vertices, mesh.boundary())
    y, x = _centres(samples, size_mm)
    where, _ = locate(mesh.vertices[face][..., :2], np.stack((x.ravel(), y.ravel()), axis=1))
    if len(face) == 0 or (where < 0).any():
        raise InputError(f"size_mm: the skin's lower face does not cover a square of {size_mm} mm")
    height = height_over(mesh.vertices, face, x, y)

    nodes = basis.N
    top = mesh.vertices[:, 2].max()
    bonded = np.flatnonzero(np.isclose(basis.doflocs[2], top, rtol=0.0, atol=1e-9 * size_mm))
    if bonded.size < 3:
        raise InputError("surface.vertices: no flat top to bond")
    free = np.setdiff1d(np.arange(3 * nodes), (bonded[:, None] + nodes * np.arange(3)).ravel())
    number = np.full(3 * nodes, -1)
    number[free] = np.arange(free.size)
    spread = pixel_forces(basis, face, samples, size_mm)
    spread.eliminate_zeros()
    loaded = np.flatnonzero(np.diff(spread.indptr))
    loaded = loaded[number[2 * nodes + loaded] >= 0]
    matrix = stiffness(basis, skin.poisson_ratio, _modulus(basis, skin, mesh, face))[free][:, free]
    place = spread[loaded].tocoo()
    rows = number[2 * nodes + loaded][place.row]
    loads = sp.csr_matrix((place.data, (rows, place.col)), shape=(free.size, samples**2))
    body = condensed_onto_loads(matrix, loads)

    def solution(pressure: Array) -> Array:
        result = np.zeros((3 * nodes, pressure.shape[1]))
        result[free] = body.solution(pressure)
        return result

    receptors = np.stack((x.ravel(), y.ravel(), height.ravel() + skin.depth_mm), axis=1)
    wavenumber = np.pi * np.arange(samples) / size_mm
    waves = np.hypot(wavenumber[:, None], wavenumber)
    symbol = layer_response(waves, skin.poisson_ratio, skin.thickness_mm, skin.depth_mm).surface
    return TetrahedralOperator(
        samples,
        size_mm,
        torch.as_tensor(height - mesh.vertices[face, 2].min()),
        free.size,
        spread[loaded],
        lambda pressure: body.compliance @ pressure,
        solution,
        gradients_at(basis, receptors),
        symbol,
    )


def _modulus(basis: skfem.Basis, skin: Skin, mesh: Tetrahedra, face: NDArray[np.int64]) -> Array | None:
    """(cells, points) modulus over that of the base, by the depth below the contact face; None: all alike."""
    if not skin.layers:
        return None
    x, y, z = np.asarray(basis.global_coordinates())
    ends, moduli = np.cumsum([thickness for thickness, _ in skin.stack]), [each for _, each in skin.stack]
    depth = z - height_over(mesh.vertices, face, x, y)
    return np.asarray([*moduli, 1.0])[np.searchsorted(ends, depth, side="right")]


def press_tetrahedra(heights: Tensor, skin: Skin, operator: TetrahedralOperator) -> Touch:
    """Press a skin of any shape on reliefs, like `tactile.press`, in double precision without gradients.

    Strain is relative to that of the same skin on a flat plate. The approach is counted from the first touch
    of the skin's lowest point with the plane z = 0.

    Args:
        heights: (..., n, n) mm, float64.
        skin: its force and modulus.
        operator: of the skin. With pixels finer than facets several pressures deform the mesh alike, and
            contact converges slowly.

    Raises:
        ContactError: the contact does not converge.
    """
    mean = skin.mean_pressure_mpa(operator.size_mm) / skin.young_modulus_mpa
    state = solve_contact(operator, heights - operator.rise_mm, mean, stop=TIGHT)
    flat = solve_contact(operator, -operator.rise_mm, mean, stop=TIGHT)
    strains = [principal_strain(operator, contact.pressure) for contact in (state, flat)]
    return Touch(
        strains[0] - strains[1],
        state.gap,
        state.pressure * skin.young_modulus_mpa,
        state.approach,
        share_in_contact(state.pressure),
        operator.size_mm,
        state.bound,
    )


def _centres(samples: int, size_mm: float) -> tuple[Array, Array]:
    """(y, x) of the pixel centres, (n, n) each."""
    line = (np.arange(samples) + 0.5) * (size_mm / samples) - 0.5 * size_mm
    y, x = np.meshgrid(-line, line, indexing="ij")
    return y, x
