"""The equations of a step, solved window by window, against one factorisation."""

import numpy as np
import pytest
import scipy.sparse as sp

from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.windows import windowed_response, windows
from relief.ground.arrays import Array
from relief.patches import Patches
from relief.places import places
from relief.surface import Surface
from tactile.sparse import factorised

SHAPES = ((70, 113), (128, 40))


@pytest.mark.parametrize("repeats", [(False, False), (True, True), (False, True)])
@pytest.mark.parametrize("shape", SHAPES)
def test_cores_share_out_the_surface(shape: tuple[int, int], repeats: tuple[bool, bool]) -> None:
    owners = np.zeros(shape, dtype=int).ravel()
    for window in windows(shape, repeats, core=32, margin=9):
        assert len(np.unique(window.samples)) == len(window.samples)
        owners[window.samples[window.core]] += 1
    assert (owners == 1).all()


@pytest.mark.parametrize("repeats", [False, True])
def test_a_margin_goes_beyond_the_core_on_every_side(repeats: bool) -> None:
    shape, margin = (96, 96), 8
    for window in windows(shape, (repeats, repeats), core=24, margin=margin):
        held = np.zeros(shape, dtype=bool).ravel()
        held[window.samples] = True
        core = np.zeros(shape, dtype=bool).ravel()
        core[window.samples[window.core]] = True
        held, core = held.reshape(shape), core.reshape(shape)
        for axis in (0, 1):
            for shift in (-margin, margin):
                moved = np.roll(core, shift, axis)
                if not repeats:
                    # What left on one side does not come back on the other.
                    lost = slice(shift) if shift > 0 else slice(shift, None)
                    np.moveaxis(moved, axis, 0)[lost] = False
                assert held[moved].all()


def _equations(surface: Surface, seed: int) -> tuple[sp.csr_matrix, Array, sp.csr_matrix, Patches]:
    """A least squares problem like that of a step, on a small surface with many places."""
    rng = np.random.default_rng(seed)
    patches = Patches(surface, places(surface, 6.0))
    smooth = laplacian(surface.shape, surface.repeats)
    data = sp.diags(rng.uniform(2.0, 4.0, smooth.shape[0]))
    matrix = sp.csr_matrix(data @ data + 6.0 * (smooth.T @ smooth) + 2.0 * smooth)
    gradients = patches.rows(rng.normal(size=(patches.count, patches.samples, patches.samples)))
    return matrix, rng.normal(size=matrix.shape[0]), gradients, patches


@pytest.mark.parametrize("repeats", [False, True])
@pytest.mark.parametrize("targets", [1, 2])
def test_windows_agree_with_one_factorisation(
    repeats: bool, targets: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The margin is many times as wide as these equations reach."""
    monkeypatch.setattr("optimize.descent.gauss_newton.windows.MARGIN", 16)
    surface = Surface((72, 78), 39.0, (repeats, repeats))
    matrix, load, gradients, patches = _equations(surface, 3)
    gradients = sp.vstack([gradients] * targets, format="csr")
    unconstrained, responses = windowed_response(matrix, load, gradients, patches, core=18)
    solved = factorised(matrix)(np.column_stack((load, gradients.toarray().T)))
    assert np.abs(unconstrained - solved[:, 0]).max() < 1e-5 * np.abs(solved[:, 0]).max()
    each = np.stack([responses @ unit for unit in np.identity(responses.shape[1])], axis=1)
    assert np.abs(each - solved[:, 1:]).max() < 1e-5 * np.abs(solved[:, 1:]).max()
    assert np.count_nonzero(each) < each.size
    slopes, expected = responses.under(gradients), gradients @ solved[:, 1:]
    assert np.abs(slopes - expected).max() < 1e-5 * np.abs(expected).max()


def test_a_window_that_holds_all_is_one_factorisation() -> None:
    surface = Surface((60, 60), 15.0)
    matrix, load, gradients, patches = _equations(surface, 4)
    unconstrained, responses = windowed_response(matrix, load, gradients, patches, core=60)
    solved = factorised(matrix)(np.column_stack((load, gradients.toarray().T)))
    # Windows take factors in single precision.
    assert np.abs(unconstrained - solved[:, 0]).max() < 1e-5 * np.abs(unconstrained).max()
    each = np.stack([responses @ unit for unit in np.identity(responses.shape[1])], axis=1)
    assert np.abs(each - solved[:, 1:]).max() < 1e-5 * np.abs(solved[:, 1:]).max()
