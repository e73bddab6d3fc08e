"""Matrices of quadratic tetrahedra: stiffness, derivatives at points, nodal forces of pixels' pressures."""

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray

from relief.ground.arrays import Array
from tactile.skin import lame
from tactile.unstructured.surface import locate


def stiffness(basis: skfem.Basis, poisson_ratio: float, modulus: Array | None = None) -> sp.csr_matrix:
    """(3 * nodes, 3 * nodes) stiffness, component by component.

    Args:
        basis: of scalar elements, as one matrix for each pair of derivatives takes a ninth of the memory of
            vector elements.
        poisson_ratio: nu.
        modulus: (cells, points) at the points of the basis's quadrature; None: 1 everywhere.
    """
    lam, mu = lame(1.0, poisson_ratio)
    stiff = np.ones_like(basis.dx) if modulus is None else modulus

    def integral(a: int, b: int) -> sp.csr_matrix:
        @skfem.BilinearForm
        def product(u, v, w):  # type: ignore[no-untyped-def]
            return w["stiff"] * v.grad[a] * u.grad[b]

        return sp.csr_matrix(product.assemble(basis, stiff=stiff))

    pairs = {(a, b): integral(a, b) for a in range(3) for b in range(a, 3)}
    pairs |= {(b, a): matrix.T for (a, b), matrix in pairs.items() if a != b}
    laplace = pairs[0, 0] + pairs[1, 1] + pairs[2, 2]
    blocks = [
        [lam * pairs[c, d] + mu * pairs[d, c] + (mu * laplace if c == d else 0.0 * laplace) for d in range(3)]
        for c in range(3)
    ]
    return sp.csr_matrix(sp.bmat(blocks, format="csr"))


def gradients_at(basis: skfem.Basis, points: Array) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Matrices (k, nodes) of the derivatives by x, y and z at points (k, 3), zero outside the mesh."""
    mesh = basis.mesh
    cell, _ = locate(mesh.p.T[mesh.t.T], points)
    inside = np.flatnonzero(cell >= 0)
    here = cell[inside]
    local = basis.mapping.invF(np.ascontiguousarray(points[inside].T)[:, :, None], tind=here)
    rows, columns, values = [], [], []
    for i in range(basis.Nbfun):
        slope = basis.elem.gbasis(basis.mapping, local, i, tind=here)[0].grad[..., 0]
        rows.append(inside)
        columns.append(basis.element_dofs[i, here])
        values.append(slope)
    row, column, value = np.concatenate(rows), np.concatenate(columns), np.concatenate(values, axis=1)
    x, y, z = (sp.csr_matrix((value[axis], (row, column)), shape=(len(points), basis.N)) for axis in range(3))
    return x, y, z


def pixel_forces(basis: skfem.Basis, face: NDArray[np.int64], samples: int, size_mm: float) -> sp.csr_matrix:
    """(nodes, n²) vertical forces per pressure: the integral of each node's function times each pixel's hat.

    Every column is scaled to the pixel's area. Forces then add up, and a rigid shift moves every pixel by as
    much, in spite of the quadrature's errors at the kinks of the hats.

    Args:
        basis: of scalar elements.
        face: (k, 3) vertices of the triangles of the contact face.
        samples: n.
        size_mm: side of the touched square.
    """
    mesh = basis.mesh
    pitch = size_mm / samples
    indices = {tuple(corners): index for index, corners in enumerate(mesh.facets.T)}
    facets = np.array([indices[tuple(corners)] for corners in np.sort(face, axis=1)])
    corners = mesh.p[:2, mesh.facets[:, facets]]
    longest = max(np.linalg.norm(corners[:, i] - corners[:, i - 1], axis=0).max() for i in range(3))
    on_face = skfem.FacetBasis(
        mesh, basis.elem, facets=facets, quadrature=_split_triangle(int(np.ceil(2.0 * longest / pitch)))
    )
    x, y, _ = on_face.global_coordinates()
    area = on_face.dx * -on_face.normals[2]
    hats = _hats(np.stack((-y, x)).reshape(2, -1), samples, size_mm)
    points = np.arange(area.size)
    values, rows = [], []
    for i in range(basis.Nbfun):
        value = np.broadcast_to(np.asarray(on_face.basis[i][0]), area.shape)
        values.append((value * area).ravel())
        rows.append(np.broadcast_to(on_face.element_dofs[i][:, None], area.shape).ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.tile(points, basis.Nbfun)))
    tested = sp.csr_matrix(entries, shape=(basis.N, area.size))
    forces = tested @ hats
    scale = pitch**2 / np.asarray(forces.sum(axis=0)).ravel()
    return sp.csr_matrix(forces @ sp.diags(scale))


def _split_triangle(parts: int) -> tuple[Array, Array]:
    """Quadrature on the unit triangle cut into parts² equal ones, each with its three-point rule."""
    inner = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]]) / 6.0
    points = []
    for i in range(parts):
        for j in range(parts - i):
            points.append(np.array([i, j]) + inner)
            if i + j < parts - 1:
                points.append(np.array([i + 1, j + 1]) - inner)
    where = np.concatenate(points).T / parts
    return where, np.full(where.shape[1], 0.5 / where.shape[1])


def _hats(places: Array, samples: int, size_mm: float) -> sp.csr_matrix:
    """(points, n²) weights of the pixels in a bilinear field at points (2, k) along rows and columns.

    Points outside the touched square have none.
    """
    position = np.clip((places + 0.5 * size_mm) * (samples / size_mm) - 0.5, 0.0, samples - 1.0)
    low = np.minimum(position.astype(np.intp), samples - 2)
    high = position - low
    touched = (np.abs(places) <= 0.5 * size_mm * (1.0 + 1e-9)).all(axis=0)
    entries = [
        (
            touched * np.abs(1 - i - high[0]) * np.abs(1 - j - high[1]),
            (np.arange(places.shape[1]), (low[0] + i) * samples + low[1] + j),
        )
        for i in (0, 1)
        for j in (0, 1)
    ]
    value = np.concatenate([entry[0] for entry in entries])
    row, column = (np.concatenate([entry[1][axis] for entry in entries]) for axis in (0, 1))
    return sp.csr_matrix((value, (row, column)), shape=(places.shape[1], samples**2))
