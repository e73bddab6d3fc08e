"""Response of one elastic layer by the constants of exponentials, which shares nothing with the product's."""

import numpy as np

from relief.ground.arrays import Array
from tactile.layer.layer_response import LayerResponse
from tactile.skin import lame


def by_exponentials(
    wavenumbers: Array, poisson_ratio: float, thickness_mm: float, depth_mm: float
) -> LayerResponse:
    """Surface displacement and displacements at depth of a bonded layer under unit cosine pressure.

    Per wavenumber the displacements are W = sum_s (a_s + b_s k w) e^{s k w} and
    U = sum_s (c_s - s b_s k w) e^{s k w} with s = -1, +1 and c_s = -s a_s - (3 - 4 nu) b_s (Navier's
    equations); the four constants follow from no shear and unit pressure at w = 0 and no displacement at
    w = t. The growing exponential is scaled by e^{-k t}, so that every wavenumber is well conditioned.

    Args:
        wavenumbers: k in 1/mm, any shape, k >= 0.
        poisson_ratio: nu.
        thickness_mm: t.
        depth_mm: depth w at which displacements are returned, in [0, t].

    Returns:
        Amplitudes with the shape of `wavenumbers`.
    """
    lam, mu = lame(1.0, poisson_ratio)
    k = np.where(wavenumbers > 0.0, wavenumbers, 1.0).ravel()
    kappa = 3.0 - 4.0 * poisson_ratio

    def rows(w: float) -> tuple[Array, Array, Array, Array]:
        """Coefficients of (a-, b-, a+, b+) in W, dW/dw, U, dU/dw at depth w: each (wavenumbers, 4)."""
        columns: tuple[list[Array], ...] = ([], [], [], [])
        for s in (-1, +1):
            e = np.exp(-k * w) if s < 0 else np.exp(k * (w - thickness_mm))
            columns[0].extend((e, k * w * e))
            columns[1].extend((s * k * e, (k + s * k * k * w) * e))
            columns[2].extend((-s * e, (-kappa - s * k * w) * e))
            columns[3].extend((-k * e, (-s * k * kappa - k * k * w - s * k) * e))
        w_, dw_, u_, du_ = (np.stack(c, axis=1) for c in columns)
        return w_, dw_, u_, du_

    w0, dw0, u0, du0 = rows(0.0)
    wt, _, ut, _ = rows(thickness_mm)
    normal_stress = (lam + 2.0 * mu) * dw0 + lam * k[:, None] * u0
    shear = du0 - k[:, None] * w0
    system = np.stack((normal_stress, shear, wt, ut), axis=1)
    load = np.zeros((k.size, 4, 1))
    load[:, 0, 0] = -1.0
    # Row scaling: the stress rows grow with k, the displacement rows do not.
    norm = np.abs(system).max(axis=2, keepdims=True)
    constants = np.linalg.solve(system / norm, load / norm)[..., 0]

    wd, dwd, ud, dud = rows(depth_mm)
    values = [np.sum(r * constants, axis=1) for r in (w0, wd, dwd, ud, dud)]
    # k = 0: uniaxial strain.
    uniform = 1.0 / (lam + 2.0 * mu)
    at_zero = (uniform * thickness_mm, uniform * (thickness_mm - depth_mm), -uniform, 0.0, 0.0)
    shape = np.shape(wavenumbers)
    flat = np.asarray(wavenumbers).ravel()
    out = [np.where(flat > 0.0, v, z).reshape(shape) for v, z in zip(values, at_zero, strict=True)]
    return LayerResponse(*out)
