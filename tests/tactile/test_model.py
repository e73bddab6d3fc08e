"""A flat plate feels of nothing, reliefs feel as the reference says, bad input is refused in one line."""

from typing import Any

import numpy as np
import pytest
import torch

from tactile import InputError, Skin, press, roughness, touch_model
from tactile.contact import solve_contact
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.model import ModelName
from tactile.strain import smallest_eigenvalue
from tests.tactile.reliefs import SIZE, bumps, grating, waves

FLAT = torch.zeros(32, 32, dtype=torch.float64)
SOFT = Skin(young_modulus_mpa=0.25)
"""The skin of the anchor values: finite elements, 0.078 mm, nu = 0.48."""


def test_a_flat_plate_has_no_roughness_and_touches_everywhere() -> None:
    touch = press(FLAT)
    assert float(touch.contact_fraction) == 1.0
    torch.testing.assert_close(touch.strain, FLAT, atol=1e-6, rtol=0.0)
    torch.testing.assert_close(touch.gap, FLAT, atol=1e-6, rtol=0.0)
    assert float(roughness(touch.strain)) < 1e-7


def test_taller_reliefs_are_rougher_and_touch_less() -> None:
    touch = press(torch.stack([waves(32, height) for height in (0.2, 0.6, 1.8)]))
    assert bool((roughness(touch.strain).diff() > 0.0).all())
    assert bool((touch.contact_fraction.diff() < 0.0).all())


def test_a_flat_plate_squeezes_the_free_block_as_finite_elements_say() -> None:
    touch = press(torch.zeros(64, 64, dtype=torch.float64), skin=SOFT)
    flat_strain = touch_model(SOFT, 64, SIZE).flat_strain
    assert float(touch.approach) == pytest.approx(0.634, rel=0.01)
    assert float(flat_strain.mean()) == pytest.approx(-0.316, rel=0.01)
    assert float(flat_strain[31:33, 31:33].mean()) == pytest.approx(-0.329, rel=0.01)


def test_sliding_sides_would_hardly_let_the_block_squeeze() -> None:
    operator = elastic_layer_operator(SOFT, 32, SIZE, free_sides=False)
    mean_pressure = SOFT.mean_pressure_mpa(SIZE) / SOFT.young_modulus_mpa
    strain = smallest_eigenvalue(operator.strain(solve_contact(operator, FLAT, mean_pressure).pressure))
    assert float(strain.mean()) == pytest.approx(-0.0455, rel=0.01)


@pytest.mark.parametrize(
    ("heights", "value", "contact"),
    [(grating(128), 0.136, 0.66), (bumps(128), 0.161, 0.98)],
    ids=["grating", "bumps"],
)
def test_roughness_is_that_of_finite_elements(heights: torch.Tensor, value: float, contact: float) -> None:
    touch = press(heights, skin=SOFT)
    assert float(roughness(touch.strain)) == pytest.approx(value, rel=0.02)
    assert float(touch.contact_fraction) == pytest.approx(contact, abs=0.03)


def test_numpy_arrays_of_any_layout_are_taken() -> None:
    heights = waves(32, 0.6).numpy()
    expected = press(heights).strain
    read_only = heights.copy()
    read_only.flags.writeable = False
    for same in (
        np.flipud(np.flipud(heights).copy()),
        np.asfortranarray(heights),
        read_only,
        heights.astype(">f8"),
    ):
        torch.testing.assert_close(press(same).strain, expected)
    assert press(heights.astype(np.float32)).strain.dtype == torch.float32


@pytest.mark.usefixtures("tight_contact")
def test_starting_from_the_last_pressures_gives_the_same_touch() -> None:
    before, after = press(waves(32, 0.6)), waves(32, 0.7)
    cold, warm = press(after), press(after, start=before.pressure)
    torch.testing.assert_close(warm.pressure, cold.pressure, atol=1e-6, rtol=0.0)
    torch.testing.assert_close(warm.strain, cold.strain, atol=1e-7, rtol=0.0)


def test_pressing_leaves_the_heights_alone() -> None:
    heights = waves(32, 0.6)
    before = heights.clone()
    press(heights)
    assert torch.equal(heights, before)


def line_of(*args: Any, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        press(*args, **options)
    message = str(caught.value)
    assert message and "\n" not in message
    return message


@pytest.mark.parametrize(
    ("heights", "word"),
    [
        (torch.zeros(32, 48), "square"),
        (torch.zeros(32), "square"),
        (torch.zeros(1, 1), "samples"),
        (torch.zeros(2048, 2048), "samples"),
        (torch.full((32, 32), float("nan")), "finite"),
        (torch.full((32, 32), float("inf")), "finite"),
        (torch.zeros(32, 32, dtype=torch.int64), "int64"),
        (np.zeros((32, 32), np.float16), "float16"),
    ],
)
def test_bad_heights_are_refused_in_one_line(heights: object, word: str) -> None:
    message = line_of(heights)
    assert message.startswith("heights:")
    assert word in message


@pytest.mark.parametrize("size", [0.0, -10.0, 1e6, float("nan")])
def test_a_bad_size_is_refused_in_one_line(size: float) -> None:
    assert line_of(FLAT, size_mm=size).startswith("size_mm:")


def test_an_unknown_model_is_refused_in_one_line() -> None:
    assert line_of(FLAT, model="fems").startswith("touch.model:")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("force_n", -10.0),
        ("force_n", 0.0),
        ("young_modulus_mpa", 0.0),
        ("young_modulus_mpa", float("nan")),
        ("poisson_ratio", 0.5),
        ("poisson_ratio", -0.1),
        ("thickness_mm", float("inf")),
        ("thickness_mm", 99.0),
        ("depth_mm", 2.5),
        ("depth_mm", 0.0),
        ("layers", ((2.5, 1.0),)),
        ("layers", ((0.4, 1.0), (2.09, 1.0))),
        ("layers", ((0.01, 1.0),)),
        ("layers", ((float("nan"), 1.0),)),
        ("layers", ((float("inf"), 1.0),)),
        ("layers", ((0.7, 501.0),)),
        ("layers", ((0.7, 0.0),)),
        ("layers", ((0.7, float("nan")),)),
        ("layers", ((0.1, 1.0),) * 9),
        ("layers", ((0.7,),)),
        ("layers", (0.7, 2.0)),
        ("layers", (("thin", "stiff"),)),
        ("layers", 3.0),
    ],
)
def test_a_bad_skin_is_refused_in_one_line(field: str, value: Any) -> None:
    with pytest.raises(InputError) as caught:
        Skin(**{field: value})
    message = str(caught.value)
    assert message.startswith(f"skin.{field}:")
    assert "\n" not in message


@pytest.mark.parametrize(
    "skin",
    [Skin(force_n=1e12), Skin(force_n=1e-300), Skin(young_modulus_mpa=1e-4), Skin(young_modulus_mpa=1e9)],
)
def test_a_load_beyond_what_numbers_hold_is_refused_in_one_line(skin: Skin) -> None:
    line = line_of(waves(16, 1.0), skin=skin)
    assert line.startswith(f"skin: force_n {skin.force_n:g} N on a side of 10 mm")
    assert f"young_modulus_mpa {skin.young_modulus_mpa:g}" in line


@pytest.mark.slow
@pytest.mark.parametrize("model", ["layer", "quick", "fem"])
def test_every_model_honours_the_thickness_and_depth_of_the_skin(model: ModelName) -> None:
    relief, thin = bumps(32), Skin(thickness_mm=1.8, depth_mm=0.5)
    usual, touch = (press(relief, skin=skin, model=model, mesh=32) for skin in (Skin(), thin))
    assert touch.approach < 0.9 * usual.approach
    assert float(roughness(touch.strain)) > 1.1 * float(roughness(usual.strain))
    layer = press(relief, skin=thin)
    torch.testing.assert_close(touch.approach, layer.approach, rtol=0.0, atol=1e-3)
    torch.testing.assert_close(roughness(touch.strain), roughness(layer.strain), rtol=0.01, atol=0.0)


@pytest.mark.parametrize("shape", [(16, 16), (2, 16, 16)])
def test_results_and_models_are_shown_in_one_line(shape: tuple[int, ...]) -> None:
    touch = press(torch.zeros(shape, dtype=torch.float64).requires_grad_())
    assert repr(touch).startswith(f"Touch({' x '.join(map(str, shape))} samples, 100 % in contact")
    for model in ("layer", "quick", "fem"):
        shown = touch_model(Skin(), 16, SIZE, torch.float32, model, 16)
        for thing in (touch, shown, shown.operator, shown.solve if model == "quick" else None):
            assert "tensor" not in repr(thing) and "\n" not in repr(thing) and len(repr(thing)) < 250
