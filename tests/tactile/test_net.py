"""A net's touch obeys the built-in laws whatever its weights; other skins and grids are refused."""

import hashlib
from pathlib import Path

import pytest
import torch

import tactile
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import ModelCard, load_net, save_net, weights_bytes
from tactile import Skin
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.truncated import GRADIENT_TOLERANCE
from tactile.model import TouchModel
from tactile.net import (
    CHANNELS,
    KIND,
    TALLEST_MM,
    NetInitialGuess,
    first_steps,
    inputs,
    net_solver,
    pressure,
    solver_of,
    validity,
)
from tests.tactile.reliefs import EIGHT, SIZE, grating, moved, waves

SAMPLES = 32
SKIN = Skin()
MEAN = SKIN.mean_pressure_mpa(SIZE)


def net(noise: float) -> UNet:
    """One that knows nothing, and says so (0) or not."""
    unet = UNet(NetShape(CHANNELS, 1, (4, 6)))
    torch.nn.init.normal_(unet.leave.weight, std=noise)
    return unet.requires_grad_(False)


def model(noise: float, dtype: torch.dtype = torch.float64, skin: Skin = SKIN) -> TouchModel:
    layer = tactile.touch_model(skin, SAMPLES, SIZE, dtype)
    solver = solver_of(net(noise), elastic_layer_operator(skin, SAMPLES, SIZE, torch.float32))
    return TouchModel(skin, layer.operator, layer.flat_strain, solver, GRADIENT_TOLERANCE)


RELIEFS = torch.stack((waves(SAMPLES, 0.3), waves(SAMPLES, 1.5, seed=2), grating(SAMPLES)))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_force_is_exact_and_skin_only_pushes(noise: float, dtype: torch.dtype) -> None:
    touch = model(noise, dtype).press(RELIEFS.to(dtype))
    assert touch.pressure.dtype == touch.strain.dtype == dtype
    assert bool((touch.pressure >= 0.0).all()) and bool((touch.gap >= 0.0).all())
    torch.testing.assert_close(
        touch.pressure.mean((-2, -1)), torch.full((3,), MEAN, dtype=dtype), rtol=4e-6, atol=0.0
    )


def test_where_there_is_pressure_there_is_no_gap() -> None:
    touch = model(0.3).press(RELIEFS)
    assert not (touch.gap * touch.pressure).any()


def test_a_flat_plate_strains_nothing() -> None:
    touch = model(0.0).press(torch.full((SAMPLES, SAMPLES), 0.7, dtype=torch.float64))
    assert float(touch.strain.abs().max()) < 3e-3
    assert float(touch.contact_fraction) == 1.0


def test_an_untrained_net_is_a_solver_cut_short() -> None:
    touch, whole = model(0.0).press(RELIEFS), tactile.press(RELIEFS, SIZE, SKIN)
    rough, wanted = tactile.roughness(touch.strain, SIZE), tactile.roughness(whole.strain, SIZE)
    torch.testing.assert_close(rough, wanted, rtol=0.15, atol=0.0)


def test_heights_count_from_anywhere() -> None:
    learned = model(0.3)
    touch, lifted = learned.press(RELIEFS), learned.press(RELIEFS + 0.25)
    torch.testing.assert_close(touch.pressure, lifted.pressure, rtol=1e-3, atol=1e-5)
    torch.testing.assert_close(
        lifted.approach - touch.approach, torch.full((3,), -0.25).double(), atol=1e-4, rtol=0
    )


def test_twice_the_force_on_twice_the_relief_is_twice_the_strain() -> None:
    strong = Skin(force_n=2.0 * SKIN.force_n)
    once, twice = model(0.0).press(RELIEFS), model(0.0, skin=strong).press(2.0 * RELIEFS)
    torch.testing.assert_close(twice.strain, 2.0 * once.strain, rtol=1e-3, atol=1e-4)


def test_inputs_turn_with_the_relief() -> None:
    operator = elastic_layer_operator(SKIN, SAMPLES, SIZE)
    mean = MEAN / SKIN.young_modulus_mpa
    relief = RELIEFS[1:2]
    seen = inputs(operator, relief, first_steps(operator, relief, mean), mean)
    assert seen.shape == (1, CHANNELS, SAMPLES, SAMPLES) and float(seen.abs().max()) < 10.0
    for turns, mirrored in EIGHT:
        image = moved(relief, turns, mirrored)
        maps = inputs(operator, image, first_steps(operator, image, mean), mean)
        # The distances from the middle, x and y, change places with a quarter turn.
        torch.testing.assert_close(maps[:, :4], moved(seen, turns, mirrored)[:, :4], rtol=1e-5, atol=1e-7)


def test_predicted_pressure_is_positive_and_of_the_given_mean() -> None:
    initial = torch.relu(torch.randn(2, SAMPLES, SAMPLES))
    pressures = pressure(net(1.0), torch.randn(2, CHANNELS, SAMPLES, SAMPLES), initial, 0.2)
    assert bool((pressures >= 0.0).all())
    torch.testing.assert_close(pressures.mean((-2, -1)), torch.full((2,), 0.2))


def test_batches_press_as_each_alone() -> None:
    learned = model(0.3)
    together = learned.press(RELIEFS.view(3, 1, SAMPLES, SAMPLES))
    assert together.approach.shape == together.contact_fraction.shape == (3, 1)
    for number, relief in enumerate(RELIEFS):
        torch.testing.assert_close(
            together.strain[number, 0], learned.press(relief).strain, rtol=1e-3, atol=1e-5
        )


def test_the_gradient_is_close_to_the_layers() -> None:
    relief = waves(SAMPLES, 0.8, seed=5)
    gradients = []
    for touch_model in (model(0.0), tactile.touch_model(SKIN, SAMPLES, SIZE)):
        heights = relief.clone().requires_grad_()
        value = tactile.roughness(touch_model.press(heights).strain, SIZE)
        gradients.append(torch.autograd.grad(value, heights)[0].flatten())
    assert float(torch.cosine_similarity(gradients[0], gradients[1], dim=0)) > 0.9


def test_a_relief_taller_than_any_that_was_seen_is_refused() -> None:
    learned = model(0.0)
    learned.press(waves(SAMPLES, 0.99 * TALLEST_MM))
    with pytest.raises(tactile.InputError, match=r"heights: a relief of 4\.40 mm"):
        learned.press(waves(SAMPLES, 1.1 * TALLEST_MM))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    unet = net(0.1)
    digest = hashlib.sha256(weights_bytes(unet)).hexdigest()
    save_net(
        tmp_path,
        unet,
        ModelCard("touch", unet.shape, digest, validity(SKIN, SAMPLES, SIZE), {}, {}, {}, {}, ()),
    )
    return tmp_path


def test_a_net_is_found_in_its_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    initial = net_solver(SKIN, SAMPLES, SIZE, folder).initial_guess
    assert isinstance(initial, NetInitialGuess) and initial.net.shape == NetShape(CHANNELS, 1, (4, 6))
    # The relation of relief to pressure, in proportion, does not depend on modulus, force and depth.
    layer = elastic_layer_operator(SKIN, SAMPLES, SIZE)
    monkeypatch.setattr("tactile.net.elastic_layer_operator", lambda *_: layer)  # slow for a new depth
    net_solver(Skin(young_modulus_mpa=0.3, force_n=5.0, depth_mm=1.0), SAMPLES, SIZE, folder)


@pytest.mark.parametrize(
    ("skin", "samples", "size", "field"),
    [
        (Skin(poisson_ratio=0.45), SAMPLES, SIZE, "poisson_ratio 0.48, not 0.45"),
        (Skin(thickness_mm=3.0), SAMPLES, SIZE, "thickness_mm"),
        (SKIN, 64, SIZE, "samples"),
        (SKIN, SAMPLES, 12.0, "size_mm"),
    ],
)
def test_a_skin_or_grid_that_it_was_not_trained_for_is_refused(
    folder: Path, skin: Skin, samples: int, size: float, field: str
) -> None:
    with pytest.raises(tactile.InputError, match=rf"touch\.model: the net is trained for {field}"):
        net_solver(skin, samples, size, folder)


def test_a_layered_skin_is_refused_in_one_line(folder: Path) -> None:
    with pytest.raises(tactile.InputError, match=r'skin without layers; use "layer"$'):
        net_solver(Skin(layers=((0.7, 2.0),)), SAMPLES, SIZE, folder)


def test_without_weights_the_model_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(tactile.InputError, match=r"touch\.model: .*retouch train touch"):
        net_solver(SKIN, SAMPLES, SIZE, tmp_path)


def test_the_solver_cut_short_tells_that_it_has_not_converged() -> None:
    state = solver_of(net(0.0), elastic_layer_operator(SKIN, SAMPLES, SIZE, torch.float32))(
        elastic_layer_operator(SKIN, SAMPLES, SIZE), RELIEFS, MEAN / SKIN.young_modulus_mpa, None
    )
    assert not bool(state.converged.all())


def test_the_net_that_is_shipped_makes_of_its_sample_what_its_card_tells() -> None:
    from surrogate.corpus import recipes as corpus

    _, card = load_net(KIND)
    assert card.sample
    for one in card.sample:
        relief = corpus.heights(corpus.recipe(one.seed, one.index, ()))
        touch = tactile.press(relief, model="net")
        assert tactile.roughness(touch.strain, SIZE).item() == pytest.approx(
            one.figures["roughness"], rel=1e-3
        )
        area = tactile.contact_area(touch.gap, SIZE).item()
        assert area == pytest.approx(one.figures["contact_area_mm2"], rel=1e-3)


def test_the_shipped_net_stays_within_its_errors_of_the_layer() -> None:
    for seed in range(3):
        relief = waves(128, 0.5 + 0.5 * seed, seed=seed).float()
        touch, layer = tactile.press(relief, model="net"), tactile.press(relief)
        for measure in (
            lambda t: tactile.roughness(t.strain, SIZE),
            lambda t: tactile.contact_area(t.gap, SIZE),
        ):
            assert float(measure(touch)) == pytest.approx(float(measure(layer)), rel=0.05)


@pytest.mark.slow
def test_the_shipped_net_honours_the_depth_and_refuses_another_thickness() -> None:
    relief, deep = waves(128, 0.5).float(), Skin(depth_mm=1.0)
    touch, layer = tactile.press(relief, skin=deep, model="net"), tactile.press(relief, skin=deep)
    assert float(tactile.roughness(touch.strain)) == pytest.approx(
        float(tactile.roughness(layer.strain)), rel=0.05
    )
    with pytest.raises(tactile.InputError, match=r"thickness_mm 2\.5, not 3"):
        tactile.press(relief, skin=Skin(thickness_mm=3.0), model="net")
