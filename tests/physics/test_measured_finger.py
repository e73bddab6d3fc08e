"""The measured finger: its solvers at exact limits, and its data."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tactile
from benchmarks.shared.common import load
from benchmarks.skin.calibration import MEASURED
from benchmarks.skin.posterior import Axis, finger, log_likelihood, quantile
from benchmarks.skin.quarter import flat_contact, groove_depths, sphere_depths, sphere_forces
from benchmarks.skin.sources import GROOVES, SPHERE
from optimize.settings.skins import load_skin
from tactile.skin import Skin

THICK = Skin(young_modulus_mpa=1.0, thickness_mm=20.0, shape="round", radius_mm=4.0)
PLANE_STRAIN = 1.0 / (1.0 - THICK.poisson_ratio**2)


def test_a_round_pad_on_a_flat_plate_is_hertzian() -> None:
    force = 0.1
    radius = (0.75 * force * 4.0 / PLANE_STRAIN) ** (1.0 / 3.0)
    area, pressure, _ = flat_contact(THICK, force, half_mm=6.0, side=160)
    assert area == pytest.approx(math.pi * radius**2, rel=0.02)
    assert pressure == pytest.approx(1.5 * force / (math.pi * radius**2), rel=0.02)


def test_a_sphere_sinks_in_as_hertz_has_it() -> None:
    effective = 1.0 / (1.0 / 1.5 + 1.0 / 100.0)
    forces = (0.02, 0.04, 0.08)
    depths = sphere_depths(replace(THICK, radius_mm=100.0), 3.0, forces, half_mm=8.0, side=160)
    hertz = [(0.75 * force / PLANE_STRAIN) ** (2.0 / 3.0) / effective ** (1.0 / 3.0) for force in forces]
    assert depths == pytest.approx(hertz, rel=0.04)


@pytest.mark.parametrize("width", [0.25, 0.5])
def test_grooves_of_a_half_plane_have_their_exact_depth(width: float) -> None:
    # Rigid lands as wide as grooves on a half-plane under a mean pressure p: 4 w p arcosh(sqrt 2) / (pi E*).
    flat = Skin(young_modulus_mpa=1.0, thickness_mm=8.0)
    force = 5.0
    exact = 4.0 * width * force / 64.0 * math.acosh(math.sqrt(2.0)) / (math.pi * PLANE_STRAIN)
    coarse, fine = (
        groove_depths(flat, (width,), (force,), half_mm=4.0, samples=(1, count))[0, 0] / exact - 1.0
        for count in (160, 640)
    )
    assert fine == pytest.approx(0.0, abs=0.02)
    # First order in the pitch: a quarter of the pitch has a quarter of the error.
    assert fine / coarse == pytest.approx(0.25, abs=0.08)


def test_forces_on_a_sphere_count_from_the_first_force() -> None:
    forces = np.geomspace(0.01, 1.0, 12)
    depths = (forces / 0.02) ** (2.0 / 3.0)
    found = sphere_forces(depths, forces, (0.5, 1.0), 0.01)
    first = 0.5 ** (2.0 / 3.0)
    assert found == pytest.approx([0.02 * (first + depth) ** 1.5 for depth in (0.5, 1.0)], rel=1e-3)


def test_polynomials_between_nodes_are_exact() -> None:
    axis = Axis(0.5, 8.0, 4)
    values = np.array([0.5, 1.7, axis.nodes[1], 8.0])
    assert axis.weights(values) @ np.log(axis.nodes) ** 3 == pytest.approx(np.log(values) ** 3, abs=1e-9)


def test_a_shift_of_all_values_is_likelier_than_the_same_of_one() -> None:
    shift = math.exp(0.3)
    all_of_them = np.array(SPHERE.values) * shift
    one = np.array(SPHERE.values) * (1.0, shift, 1.0)
    exact, both, single = log_likelihood(SPHERE, np.array([SPHERE.values, all_of_them, one]))
    assert exact == 0.0 > both > single


def test_quantiles_take_weights() -> None:
    assert quantile(np.array([3.0, 1.0, 2.0]), np.array([0.1, 0.2, 0.7]), (0.1, 0.5, 0.95)) == [1.0, 2.0, 3.0]


def test_medians_of_people_lie_among_people() -> None:
    for value, (least, most) in zip(SPHERE.values, SPHERE.people, strict=True):
        assert least < value < most
    assert list(GROOVES.values) == sorted(GROOVES.values)


def test_the_skin_file_is_the_finger_of_the_calibration() -> None:
    calibrated = finger(MEASURED | {"ratio": MEASURED["layer_mpa"] / MEASURED["base_mpa"]})
    skin = load_skin("measured")
    assert skin.numbers() == pytest.approx(calibrated.numbers())
    assert np.allclose(skin.layers, calibrated.layers) and skin.shape == "round"


def test_skin_files_of_the_range_are_those_of_the_results() -> None:
    fingers = load("finger")["calibration"]["fingers"]
    names = ("measured-soft", "measured", "measured-stiff")
    for name in names:
        values, skin = fingers[name]["values"], load_skin(name)
        assert skin.young_modulus_mpa == values["base_mpa"], name
        assert skin.layers == ((values["layer_mm"], values["layer_mpa"]),), name
    least, middle, most = (
        fingers[name]["model"]["sphere"] for name in ("measured-soft", "measured", "measured-stiff")
    )
    assert np.all(np.less(least, middle)) and np.all(np.less(middle, most))


def test_the_patch_and_its_quarter_touch_the_same_flat_plate() -> None:
    skin = load_skin("measured")
    assert skin.patch_mm is not None
    touch = tactile.press(np.zeros((208, 208)), skin.patch_mm, skin)
    area = float((touch.pressure > 0.0).double().mean()) * skin.patch_mm**2
    assert area == pytest.approx(flat_contact(skin, skin.force_n)[0], rel=0.03)
