"""What free sides add, by modes, is the difference of two factorised blocks."""

import numpy as np
import pytest
import torch

from benchmarks.touch.bare_elements import discrete_layer
from tactile.layer.cosine_layer import PARITIES, CosineLayer, Parity, modes_at_centres
from tactile.layer.skin_layers import Stack
from tactile.skin import Skin
from tactile.structured.block import CoarseBlock, depth_levels
from tactile.structured.pixel_block import PixelBlock
from tactile.structured.side_release import release
from tests.tactile.coarse_block import quarter_responses
from tests.tactile.folded_block import face_response
from tests.tactile.whole_block import PARITY_NAMES

EVERY_PARITY = pytest.mark.parametrize("parity", PARITIES, ids=PARITY_NAMES.get)
LEVELS = np.array([0.0, 0.3, 0.6, 1.0, 1.6, 2.5])
EXACT = 1e-13


def agree(one: np.ndarray, other: np.ndarray, of: np.ndarray, tolerance: float = 1e-10) -> None:
    np.testing.assert_allclose(one, other, rtol=0.0, atol=tolerance * np.abs(of).max())


@EVERY_PARITY
@pytest.mark.parametrize("stack", [(), ((0.3, 4.0), (0.7, 0.1))], ids=["one layer", "three layers"])
@pytest.mark.parametrize("half", [1, 4])
def test_the_face_moves_as_that_of_the_factorised_block(half: int, stack: Stack, parity: Parity) -> None:
    block, pixels = PixelBlock(5.0, half, LEVELS, 0.75, 0.48, stack), half**2
    n, layer = 2 * half, discrete_layer(block)
    sliding = CosineLayer(n, 10.0, *map(torch.as_tensor, (*modes_at_centres(n), layer.surface, layer.strain)))
    forces = np.eye(pixels).reshape(pixels, half, half)
    for axis, odd in zip((1, 2), parity, strict=True):
        mirrored = np.flip(forces, axis)
        forces = np.concatenate((-mirrored if odd else mirrored, forces), axis=axis)
    between = sliding.displacement(torch.as_tensor(forces / block.pitch_mm**2))[:, half:, half:].numpy()
    expected = face_response(block, parity, np.eye(pixels)).compliance - between.reshape(pixels, pixels)
    added = release(block, parity, np.eye(pixels), EXACT)
    agree(added.face.T @ added.face, expected, between)


@EVERY_PARITY
@pytest.mark.parametrize("layers", [(), ((0.4, 2.0),)], ids=["one layer", "two layers"])
def test_face_and_receptors_move_as_those_of_the_factorised_coarse_block(
    layers: Stack, parity: Parity
) -> None:
    skin, quarter = Skin(young_modulus_mpa=1.0, layers=layers), 3
    levels = np.array([0.0, 0.4, 0.9, 1.5, 2.5]) if layers else depth_levels(0.75, 2.5, 0.5)
    free, sliding = (
        quarter_responses(5.0, quarter, levels, skin, sides)[parity] for sides in ("free", "sliding")
    )
    block = CoarseBlock(5.0, quarter, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)
    added = release(block, parity, np.eye((quarter + 1) ** 2), EXACT)
    agree(added.face.T @ added.face, free.displacement - sliding.displacement, free.displacement)
    agree(added.strain_out @ added.strain_in, free.strain - sliding.strain, free.strain, 1e-6)


@EVERY_PARITY
def test_what_is_left_out_is_small(parity: Parity) -> None:
    block = PixelBlock(5.0, 6, LEVELS, 0.75, 0.48)
    every = np.eye(36)
    exact, rough = (release(block, parity, every, accuracy) for accuracy in (EXACT, 1e-3))
    assert rough.face.shape[0] < exact.face.shape[0]
    whole, part = (added.face.T @ added.face for added in (exact, rough))
    assert 0.0 < np.linalg.norm(whole - part, 2) < 1e-3 * np.linalg.norm(whole, 2)
    strain, near = ((added.strain_out @ added.strain_in).reshape(-1, 36) for added in (exact, rough))
    assert np.linalg.norm(strain - near, 2) < 1e-3 * np.linalg.norm(strain, 2)
