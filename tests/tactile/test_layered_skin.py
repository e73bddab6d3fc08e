"""A layered skin feels alike by every model, has gradients, and equal layers are the skin without layers."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from benchmarks.touch.bare_elements import discrete_layer
from tactile import Skin, contact_area, press, roughness
from tactile.elements.finite_elements import graded_levels
from tactile.layer.cosine_layer import layer_symbols
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.skin_layers import even_levels, layer_around, levels_within, moduli_of_rows, row_weights
from tactile.skin import Layers, lame
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.pixel_block import PixelBlock
from tests.tactile.coarse_block import quarter_responses
from tests.tactile.folded_block import face_response
from tests.tactile.reliefs import SIZE, bumps, grating, waves
from tests.taylor import gradient, slope_error

pytestmark = pytest.mark.usefixtures("tight_contact")

SAMPLES = 32
STIFF_OVER_SOFT = Skin(young_modulus_mpa=0.4, layers=((0.7, 2.0),))
"""Epidermis over softer tissue, the receptors just below the boundary."""
SOFT_OVER_STIFF = Skin(young_modulus_mpa=2.0, layers=((0.3, 8.0), (0.7, 0.5)))
EVERY_SKIN = pytest.mark.parametrize(
    "skin", [STIFF_OVER_SOFT, SOFT_OVER_STIFF], ids=["two layers", "three layers"]
)
RELIEFS = torch.stack([waves(SAMPLES, 1.2), grating(SAMPLES, 0.6), bumps(SAMPLES, 0.8)])


def relative(found: torch.Tensor, expected: torch.Tensor) -> float:
    return float((found - expected).abs().max() / expected.abs().max())


@pytest.mark.slow
def test_equal_layers_are_the_skin_without_layers() -> None:
    """Up to the rows of elements, which meet boundaries: what the free sides add changes a little."""
    layered = Skin(layers=((0.6, 0.5), (0.9, 0.5)))
    pressure = waves(SAMPLES, 1.0)
    one, several = (elastic_layer_operator(skin, SAMPLES, SIZE, coarse=12) for skin in (Skin(), layered))
    assert relative(several.symbol, one.symbol) < 1e-10
    assert relative(several.strain_symbols, one.strain_symbols) < 1e-10
    assert relative(several.displacement(pressure), one.displacement(pressure)) < 1e-2
    assert relative(several.strain(pressure), one.strain(pressure)) < 2e-2


def test_elements_of_equal_layers_are_those_without_layers() -> None:
    levels = even_levels(2.5, 0.5, ((0.6, 1.0), (0.9, 1.0)))
    one, several = (
        PixelBlock(SIZE / 2.0, 4, levels, 0.75, 0.48, stack) for stack in ((), ((0.6, 1.0), (0.9, 1.0)))
    )
    for function in (
        lambda block: face_response(block, (False, True), np.ones((16, 1))).compliance,
        lambda block: discrete_layer(block).surface,
    ):
        np.testing.assert_allclose(function(several), function(one), rtol=1e-12)


@pytest.mark.slow
def test_moduli_count_in_units_of_the_base() -> None:
    """Force and all moduli doubled change nothing but the pressures."""
    skin = SOFT_OVER_STIFF
    twice = Skin(young_modulus_mpa=4.0, force_n=20.0, layers=((0.3, 16.0), (0.7, 1.0)))
    assert skin.at_unit_modulus() == twice.at_unit_modulus()
    one, other = (press(RELIEFS[0], skin=s) for s in (skin, twice))
    torch.testing.assert_close(other.strain, one.strain)
    torch.testing.assert_close(other.pressure, 2.0 * one.pressure)


@pytest.mark.slow
def test_every_model_feels_a_layered_skin_alike() -> None:
    """Finite elements with 32 nodes a side hardly resolve the grating: 3.4 % off."""
    skin = SOFT_OVER_STIFF
    plain = roughness(press(RELIEFS, skin=Skin(young_modulus_mpa=skin.young_modulus_mpa)).strain)
    layer, quick, fem = (
        roughness(press(RELIEFS, skin=skin, model=model, mesh=SAMPLES).strain)
        for model in ("layer", "quick", "fem")
    )
    assert float((layer / plain - 1.0).abs().min()) > 0.1
    torch.testing.assert_close(layer, fem, rtol=0.04, atol=0.0)
    torch.testing.assert_close(quick, layer, rtol=0.01, atol=0.0)


def test_slopes_of_the_feel_are_those_of_finite_differences() -> None:
    skin = SOFT_OVER_STIFF
    noise = torch.rand(SAMPLES, SAMPLES, dtype=torch.float64)
    heights = RELIEFS[0] + 0.02 * noise  # away from pixels that only just touch
    for function in (
        lambda h: roughness(press(h, skin=skin).strain),
        lambda h: contact_area(press(h, skin=skin).gap),
    ):
        steepest = gradient(function, heights)
        scale = 0.1 * float(steepest.norm())
        for direction in (steepest, torch.randn_like(heights)):
            unit = direction / direction.norm()
            assert slope_error(function, heights, unit, step=1e-5, scale=scale) < 1e-3


@pytest.mark.slow
@EVERY_SKIN
def test_elements_make_of_long_waves_what_the_exact_layers_do(skin: Skin) -> None:
    """With sliding sides, mode by mode: the error falls with the square of the mesh's pitch."""
    surface, strain = (symbol[..., :5, :5] for symbol in layer_symbols(16, SIZE, skin))
    errors = []
    for rows in (1, 2, 4):
        levels = even_levels(skin.thickness_mm, 0.3 / rows, skin.stack)
        mesh = PixelBlock(SIZE / 2.0, 8 * rows, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)
        discrete = discrete_layer(mesh)
        errors.append(
            (
                np.abs(discrete.surface[:5, :5] - surface).max() / surface.max(),
                np.abs(discrete.strain[:, :5, :5] - strain).max() / np.abs(strain).max(),
            )
        )
    assert max(errors[-1]) < 0.08
    assert np.log2(np.array(errors[0]) / np.array(errors[-1])).min() / 2.0 > 1.6


@EVERY_SKIN
def test_uniform_pressure_between_sliding_sides_is_exact(skin: Skin) -> None:
    levels = even_levels(skin.thickness_mm, 0.5, skin.stack)
    even = quarter_responses(SIZE / 2.0, 3, levels, skin, "sliding")[False, False]
    weight = np.full(4, SIZE / 6.0)
    weight[[0, -1]] *= 0.5
    forces = np.outer(weight, weight).ravel()
    lam, mu = lame(1.0, skin.poisson_ratio)
    moduli = moduli_of_rows(levels, skin.stack)
    squeezed = np.sum(np.diff(levels) / moduli) / (lam + 2.0 * mu)
    np.testing.assert_allclose(even.displacement @ forces, squeezed, rtol=1e-9)
    strain = even.strain @ forces
    here = moduli[np.searchsorted(levels, skin.depth_mm) - 1]
    expected = np.zeros_like(strain)
    expected[STRAIN_COMPONENTS.index((2, 2))] = -1.0 / (lam + 2.0 * mu) / here
    np.testing.assert_allclose(strain, expected, atol=1e-9)


@pytest.mark.parametrize("layers", [((0.7, 2.0),), ((0.02, 200.0), (0.3, 1.0)), ((2.0, 1.0), (0.48, 1.0))])
def test_meshes_meet_every_boundary(layers: Layers) -> None:
    skin = Skin(layers=layers)
    faces = np.cumsum([thickness for thickness, _ in layers])
    for levels in (graded_levels(2.5, 0.156, skin.stack), even_levels(2.5, 0.27, skin.stack)):
        assert levels[0] == 0.0 and levels[-1] == pytest.approx(2.5) and np.diff(levels).min() > 0.0
        assert np.diff(levels).max() < 0.28
        assert np.abs(levels[:, None] - faces).min(0).max() < 1e-12
        moduli = np.array([*(modulus for _, modulus in skin.stack), 1.0])
        assert sorted(set(moduli_of_rows(levels, skin.stack))) == sorted(set(moduli))
        for top, bottom in pairwise(np.concatenate(([0.0], faces, [2.5]))):
            for depth in (top + 1e-3, 0.5 * (top + bottom), bottom - 1e-3):
                assert layer_around(depth, 2.5, skin.stack) == pytest.approx((top, bottom))
                inside = levels[levels_within(levels, depth, skin.stack)]
                assert inside[0] == pytest.approx(top) and inside[-1] == pytest.approx(bottom)
                # Strain that is linear along the depth is read exactly, from rows of this layer only.
                rows = row_weights(levels, depth, skin.stack)
                centres = [0.5 * (levels[row] + levels[row + 1]) for row, _ in rows]
                assert all(top < centre < bottom for centre in centres)
                assert sum(weight for _, weight in rows) == pytest.approx(1.0)
                read = sum(weight * centre for (_, weight), centre in zip(rows, centres, strict=True))
                assert read == pytest.approx(depth)


def test_a_depth_on_a_boundary_belongs_to_the_lower_layer() -> None:
    skin = Skin(layers=((0.75, 2.0),))
    assert layer_around(0.75, 2.5, skin.stack) == (0.75, 2.5)
    below = Skin(layers=((0.75 - 1e-6, 2.0),))
    pressure = waves(SAMPLES, 1.0)
    one, other = (elastic_layer_operator(s, SAMPLES, SIZE, coarse=8).strain(pressure) for s in (skin, below))
    assert relative(one, other) < 1e-4


def test_layers_from_a_file_are_lists_and_the_skin_is_hashable() -> None:
    skin = Skin(layers=[[0.7, 2]])  # type: ignore[arg-type]
    assert skin == Skin(layers=((0.7, 2.0),)) and hash(skin) == hash(Skin(layers=((0.7, 2.0),)))
    assert Skin(**skin.described()) == skin
    assert "layers" not in Skin().described()


@pytest.mark.parametrize("modulus", [0.1, 0.3, 0.7, 1.1, 3.7])
def test_the_greatest_ratio_of_moduli_survives_the_unit(modulus: float) -> None:
    for factor in (1000.0, 0.001):
        skin = Skin(young_modulus_mpa=modulus, layers=((0.5, factor * modulus),))
        assert skin.at_unit_modulus().layers[0][1] == pytest.approx(factor)
