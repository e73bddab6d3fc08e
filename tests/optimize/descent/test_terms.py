"""Terms of a step: what they add to its equations is the slope of what they cost; no weight, no term."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from optimize.descent.driver import Iterate, descend
from optimize.descent.gauss_newton.equations import ROUGHENING, System
from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.gauss_newton.step_look import Look, StepLook
from optimize.descent.gauss_newton.terms import (
    TERMS,
    BroadTerm,
    FingersTerm,
    LayerTerm,
    PictureTerm,
    ShapeTerm,
    Term,
)
from optimize.descent.problem import FingerRange, Problem
from optimize.descent.targets import Targets
from relief.ground.arrays import Array
from relief.printed import printed
from relief.printers import Printer
from tactile import jnd_scaled
from tactile.measures import TouchMeasures
from tests.optimize.conftest import ProblemWith

TARGETS = Targets.of(0.01, roughness=0.1)


def nearby(problem: Problem, seed: int) -> Array:
    """A relief (rows, cols) mm near the original, with the same mean."""
    rise = np.random.default_rng(seed).normal(size=problem.heights.shape)
    return np.asarray(problem.heights + 0.01 * (rise - rise.mean()))


def system_of(terms: Sequence[Term], problem: Problem, step_look: StepLook, look: Look) -> System:
    """The equations of a step from `nearby(problem, 0)`, with the pictures of any relief."""
    heights = nearby(problem, 0)
    differences = laplacian(heights.shape, problem.relief.repeats)
    system = System.of_bending(heights - problem.heights, differences, step_look.precision)
    for residual in step_look.residuals(look):
        for term in terms:
            term.add_residual(system, residual)
    for term in terms:
        term.add(system, heights, Iterate(0, heights, {}, 0.0, 0.0, 0.0, {}))
    system.finish(problem.frozen)
    return system


@pytest.mark.parametrize("kind", [kind for kind in TERMS if kind.predictable])
def test_what_a_term_adds_is_the_slope_of_what_it_costs(problem_with: ProblemWith, kind: type[Term]) -> None:
    """Bending apart; of pictures, the unit of the sum has the squared mean original."""
    problem = replace(problem_with(TARGETS), broad=10.0, shape=30.0, regularisation=0.0, look="fast")
    step_look = StepLook(problem)
    term, way = kind(problem, step_look), nearby(problem, 1) - problem.heights
    heights = nearby(problem, 0)
    look = step_look.evaluate(heights)
    weights = problem.scene.weights
    (field,) = term.costs(heights, step_look.pictures(look)).keys() - {"picture_mean"}
    unit = 0.5 * problem.heights.size
    if field in ("picture_rms", "broad"):
        shares = (weights / weights.mean())[:, None, None]
        unit *= weights.sum() * (step_look.plate * shares * step_look.original).mean() ** 2

    def energy(share: float) -> float:
        moved = share * way
        cost = term.costs(heights + moved, step_look.predicted(look, moved.ravel()))[field]
        return unit * (cost / 100.0) ** 2

    slope = (energy(1e-3) - energy(-1e-3)) / 2e-3
    loads = [system_of(terms, problem, step_look, look).load for terms in ([term], [])]
    assert -float((loads[0] - loads[1]) @ way.ravel()) == pytest.approx(slope, rel=1e-4)


def test_the_load_of_a_step_is_the_slope_of_all_that_it_minimises(problem_with: ProblemWith) -> None:
    """Of pixels, masked, broad cells and shape together, by central differences over the linear pictures."""
    problem = replace(problem_with(TARGETS), broad=10.0, shape=30.0, masking=2.0)
    step_look = StepLook(problem)
    broad, picture = BroadTerm(problem, step_look), PictureTerm(problem, step_look)
    # Pictures of another relief than the one that is bent and shaped.
    look = step_look.evaluate(nearby(problem, 2))
    system = system_of([broad, picture, ShapeTerm(problem, step_look)], problem, step_look, look)
    assert len(system.low_rank) == 1
    way = (nearby(problem, 1) - problem.heights).ravel()
    differences = laplacian(problem.heights.shape, problem.relief.repeats)
    change = (nearby(problem, 0) - problem.heights).ravel()

    def least_squares(share: float) -> float:
        moved = change + share * way
        # The bending, which `ROUGHENING` weighs, and the shape beside the pictures.
        total = ROUGHENING * float(np.square(differences @ moved).sum()) + 0.5 * 30.0**2 * float(
            moved @ moved
        )
        for jacobian, difference, root in step_look.residuals(look):
            off = difference + share * (jacobian @ way)
            masked = root * off
            total += 0.5 * float(masked @ (picture.weight @ masked) + np.square(broad.cells @ off).sum())
        return total

    slope = (least_squares(1e-3) - least_squares(-1e-3)) / 2e-3
    assert -float(system.load @ way) == pytest.approx(slope, rel=1e-4)


def test_a_term_counts_where_it_has_a_weight(problem_with: ProblemWith) -> None:
    plain = problem_with(TARGETS)
    printer = Printer("own", pixel_um=312.5, layer_um=60.0, min_feature_um=937.5)
    prints = replace(plain.relief, heights=printed(plain.heights, 0.3125, printer), printer=printer)

    def counted(problem: Problem) -> set[type[Term]]:
        return {term for term, counts in TERMS.items() if counts(problem)}

    optional = {BroadTerm, LayerTerm, ShapeTerm, FingersTerm}
    assert PictureTerm in counted(plain) and not counted(plain) & optional
    for problem, own in (
        (replace(plain, broad=1.0), {BroadTerm}),
        (replace(plain, relief=prints), {LayerTerm}),
        (replace(plain, shape=1.0), {ShapeTerm}),
        (replace(plain, fingers=FingerRange(np.ones(1), 1.0)), {FingersTerm}),
    ):
        assert counted(problem) & optional == own


def test_a_descent_that_keeps_the_shape_changes_it_less(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    targets = Targets.of(0.01, roughness=jnd_scaled(original.means["roughness"], 2.0))
    problem = replace(problem_with(targets), look="fast")
    changes, percent = [], []
    for shape in (0.0, 20.0):
        method = GaussNewton(replace(problem, shape=shape))
        best = descend(method, targets, method.begin(0, problem.heights, {}), 15).best
        assert targets.met(best.values)
        changes.append(float((best.heights - problem.heights).std()))
        percent.append(best.picture_rms)
        assert best.shape == pytest.approx(100.0 * shape * changes[-1])
    assert changes[1] < 0.8 * changes[0] and percent[1] < 3.0 * percent[0]
