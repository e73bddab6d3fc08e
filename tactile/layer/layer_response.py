"""Response of an elastic layer, or a stack of bonded ones, to normal pressure, exact for every wavenumber.

A cosine pressure on a laterally unbounded (or, by mirror images, laterally sliding) layer causes cosine
displacements and strains of the same wavenumber. Depth w runs from the loaded face (w = 0) to the bonded face
(w = t); a positive normal displacement points into the layer. Young's modulus is 1 in the base; displacements
and strains are to be divided by E.

Each layer is a 4 x 4 stiffness from the displacements of its two faces to the forces on them, and the layers
are assembled like elements (Kausel and Roesset, Bull. Seism. Soc. Am. 71, 1981, here without inertia). All
entries are quotients of hyperbolic functions by the square of the cosine, so that they stay finite for every
wavenumber, where products of transfer matrices overflow.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from relief.ground.arrays import Array
from tactile.layer.skin_layers import SAME_DEPTH_MM, Stack, boundaries, layer_around, moduli_of_rows
from tactile.skin import lame

LATERAL, NORMAL = 0, 1
"""Places of the two displacements, and of the two forces, at a face."""
LONG_WAVE = 350.0
"""Half the product of wavenumber and thickness beyond which the two faces of a layer do not feel each other:
the square of the hyperbolic cosine is near the largest number of double precision there."""


@dataclass(frozen=True)
class LayerResponse:
    """Amplitudes per unit pressure amplitude, unit modulus, for each wavenumber k (1/mm).

    Attributes:
        surface: normal displacement at the loaded face, mm/MPa at E = 1 MPa.
        normal: normal displacement W at depth.
        normal_slope: dW/dw at depth (the normal strain).
        lateral: displacement U along the wave vector at depth; phase sin where the pressure is cos.
        lateral_slope: dU/dw at depth.
    """

    surface: Array
    normal: Array
    normal_slope: Array
    lateral: Array
    lateral_slope: Array


def layer_response(
    wavenumbers: Array, poisson_ratio: float, thickness_mm: float, depth_mm: float, stack: Stack = ()
) -> LayerResponse:
    """Surface displacement and displacements at depth of bonded layers under unit cosine pressure.

    The receptors' depth is made a face of its own. Slopes follow from the displacements there and from the
    forces on the part of the layer below, so that on a boundary between layers the slopes are the lower
    layer's.

    Args:
        wavenumbers: k in 1/mm, any shape, k >= 0.
        poisson_ratio: nu of all layers.
        thickness_mm: t of the whole.
        depth_mm: depth w at which displacements are returned, in (0, t).
        stack: layers above the base, whose modulus is 1.

    Returns:
        Amplitudes with the shape of `wavenumbers`, at unit modulus of the base.
    """
    lam, mu = lame(1.0, poisson_ratio)
    # Waves of the same length in several directions are solved once.
    each, place = np.unique(wavenumbers, return_inverse=True)
    k = np.where(each > 0.0, each, 1.0)
    top, _ = layer_around(depth_mm, thickness_mm, stack)
    depth = top if abs(depth_mm - top) <= SAME_DEPTH_MM else depth_mm
    faces = np.unique([0.0, *boundaries(stack), depth, thickness_mm])
    moduli = moduli_of_rows(faces, stack)
    stiffness = [
        modulus * _layer_stiffness(k, mu, poisson_ratio, lower - upper)
        for (upper, lower), modulus in zip(pairwise(faces), moduli, strict=True)
    ]
    unknowns = 2 * len(moduli)
    system = np.zeros((k.size, unknowns + 2, unknowns + 2))
    for layer, matrix in enumerate(stiffness):
        here = slice(2 * layer, 2 * layer + 4)
        system[:, here, here] += matrix
    load = np.zeros((k.size, unknowns, 1))
    load[:, NORMAL] = 1.0
    field = np.zeros((k.size, unknowns + 2))
    # The bonded face does not move.
    field[:, :-2] = np.linalg.solve(system[:, :-2, :-2], load)[..., 0]

    below = int(np.searchsorted(faces, depth))
    forces = np.einsum("kij,kj->ki", stiffness[below], field[:, 2 * below : 2 * below + 4])
    lateral, normal = field[:, 2 * below + LATERAL], field[:, 2 * below + NORMAL]
    # Forces on an upper face are minus the stresses.
    shear, normal_stress = (-forces[:, axis] / moduli[below] for axis in (LATERAL, NORMAL))
    normal_slope = (normal_stress - lam * k * lateral) / (lam + 2.0 * mu)
    lateral_slope = shear / mu + k * normal

    uniform = 1.0 / (lam + 2.0 * mu)
    squeezed = uniform * np.diff(faces) / moduli
    at_zero = (squeezed.sum(), squeezed[below:].sum(), -uniform / moduli[below], 0.0, 0.0)
    values = (field[:, NORMAL], normal, normal_slope, lateral, lateral_slope)
    found = (np.where(each > 0.0, v, z) for v, z in zip(values, at_zero, strict=True))
    return LayerResponse(*(value[place].reshape(np.shape(wavenumbers)) for value in found))


def _layer_stiffness(k: Array, mu: float, poisson_ratio: float, thickness_mm: float) -> Array:
    """(wavenumbers, 4, 4): forces on a layer's faces by their displacements (lateral, normal; upper, lower).

    Motions symmetric about the layer's middle plane (squeeze) and antisymmetric ones (bending) do not mix.
    With x = k thickness / 2 and kappa = 3 - 4 nu, Navier's equations give for the tractions of the lower face

        symmetric:      mu k / (kappa S C - x) [[(kappa + 1) S², 2 x - (kappa - 1) S C], [., (kappa + 1) C²]]
        antisymmetric:  mu k / (kappa S C + x) [[(kappa + 1) C², -2 x - (kappa - 1) S C], [., (kappa + 1) S²]]

    with S = sinh x and C = cosh x; here divided by C².
    """
    kappa = 3.0 - 4.0 * poisson_ratio
    x = np.minimum(0.5 * k * thickness_mm, LONG_WAVE)
    tanh, over_cosh2 = np.tanh(x), x / np.cosh(x) ** 2
    matrix = np.zeros((k.size, 4, 4))
    for sign, lateral, normal in ((-1.0, tanh**2, np.ones_like(x)), (1.0, np.ones_like(x), tanh**2)):
        scale = 0.5 * mu * k / (kappa * tanh + sign * over_cosh2)
        mixed = -sign * 2.0 * over_cosh2 - (kappa - 1.0) * tanh
        # The upper face moves like the mirror image of the lower one: (lateral, normal) by these signs.
        mirror = np.array([-sign, sign])
        lower = np.stack(((kappa + 1.0) * lateral, mixed, mixed, (kappa + 1.0) * normal), axis=1)
        lower = scale[:, None, None] * lower.reshape(-1, 2, 2)
        both = np.concatenate((mirror, np.ones(2)))
        matrix += np.tile(lower, (1, 2, 2)) * both[:, None] * both[None, :]
    return matrix
