"""Keys, options, results and the report follow from the table of targets; a new quantity takes one file."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import tactile
from optimize.descent.driver import descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.targets import Target, Targets
from optimize.settings.touch import Touch
from retouch.commands.main import parse
from tactile.quantities import CONTACT_AREA, QUANTITIES, ROUGHNESS, Quantity
from tests.optimize.conftest import ProblemWith

TOLERANCE = 0.01

MEAN_STRAIN = Quantity(
    name="mean_strain",
    label="mean strain",
    symbol="S",
    unit="",
    decimals=4,
    value=lambda touch: touch.strain.abs().mean(),
)
"""Mean magnitude of the strain map: a quantity that the table does not have."""


def test_every_goal_key_is_a_key_of_the_run_file_and_an_option() -> None:
    keys = [key for quantity in QUANTITIES.values() for key in quantity.goals]
    for key in keys:
        assert key.key in Touch.model_fields
        option = f"--{key.key.replace('_', '-')}"
        assert getattr(parse(["optimize", "scene.xml", option, "1"]), key.key) == 1.0
    assert [key.key for key in keys] == ["roughness", "jnd", "contact_area_mm2", "contact_area_scale"]


def test_goals_count_from_the_original_where_they_are_relative() -> None:
    roughness, jnd = ROUGHNESS.goals
    assert roughness.goal(0.07, 0.05) == 0.07
    assert jnd.goal(2, 0.05) == pytest.approx(0.05 * 1.19**2)
    area, scale = CONTACT_AREA.goals
    assert area.goal(40.0, 30.0) == 40.0
    assert scale.goal(0.8, 30.0) == pytest.approx(24.0)


def test_a_target_says_what_it_is() -> None:
    both = Targets.of(0.01, roughness=0.0689, contact_area_mm2=45.0)
    assert both.sentence == "roughness 0.0689 within 1 % and contact area 45.0 mm² within 1 %"


def test_each_target_has_its_own_tolerance() -> None:
    loose = replace(Targets.of(0.01, contact_area_mm2=45.0).each[0], tolerance=0.2)
    targets = Targets((*Targets.of(0.01, roughness=0.1).each, loose))
    assert targets.met({"roughness": 0.1, "contact_area_mm2": 50.0})
    assert not targets.met({"roughness": 0.102, "contact_area_mm2": 45.0})


@pytest.mark.usefixtures("tight_contact")
def test_the_gradient_of_a_third_quantity_is_right(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets((Target(MEAN_STRAIN, 0.05, TOLERANCE),)))
    direction = np.random.default_rng(0).standard_normal(problem.heights.shape)
    slope = float(problem.press(problem.heights).gradients[0] @ direction.ravel())

    def value(step: float) -> float:
        return problem.press(problem.heights + step * direction, gradients=False).means["mean_strain"]

    step = 1e-5
    assert slope == pytest.approx((value(step) - value(-step)) / (2.0 * step), rel=2e-3)


@pytest.mark.parametrize("factor", [1.15, 0.9])
def test_a_third_quantity_is_steered(problem_with: ProblemWith, factor: float) -> None:
    start = problem_with(Targets((Target(MEAN_STRAIN, 1.0, TOLERANCE),)))
    original = start.press(start.heights, gradients=False).means["mean_strain"]
    targets = Targets((Target(MEAN_STRAIN, factor * original, TOLERANCE),))
    problem = problem_with(targets)
    method = GaussNewton(problem)
    descent = descend(method, targets, method.begin(0, problem.heights, {}), 12)
    assert descent.reason.met
    touch = tactile.press(torch.as_tensor(descent.best.heights), problem.relief.width_mm, problem.skin)
    assert float(touch.strain.abs().mean()) == pytest.approx(factor * original, rel=TOLERANCE)
    assert descent.best.values.keys() == {"roughness", "contact_area_mm2", "mean_strain"}
