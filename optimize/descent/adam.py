"""Adam on the sum of the energies: the paper's method.

    E = E_rough + w1 E_vis + w2 E_reg    (`optimize.descent.energies`; contact areas likewise)

with E_rough summed over the places of the finger.

One optimiser takes both gradients: torch's through touch, and the pictures', which arrives as the gradient
of a torch function. The energy |r - V| has no curvature at its minimum, so that steps overshoot the target;
cosine decay of the learning rate makes the overshoot small. With constant weights the minimum of the sum may
lie off the target; the weight of E_rough therefore grows over the steps, unless `growth` is 1. With constant
weights E_vis may grow faster than E_rough falls, and the descent ends short of its target: brick two
just-noticeable differences smoother stays 11 % off with w1 = 0.1, gravel 14 % with w1 = 1.

The paper's third weight keeps heights from 0 to 3 mm by a penalty. Here each step ends on a relief within
the limits: the plate is lifted where it would go below 0, which neither eye nor finger notices, and cut off
at 3 mm. E_clamp is therefore 0 at every step.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np
import torch
from torch import Tensor

from optimize.descent import energies
from optimize.descent.driver import PRESSURES, ArraySchema, Iterate
from optimize.descent.methods import MethodSettings
from optimize.descent.problem import Problem, change_percent
from optimize.descent.smoothing import smoothed
from optimize.descent.stop_reason import StopReason
from relief.ground.arrays import Array
from tactile.measures import each
from visual.exact.discontinuities import EdgeSamples
from visual.looks import STEP_BLUR, FixedSamples, StepView, look_model
from visual.step_pictures import fixed_pictures

DECAY_FLOOR = 0.02
"""Learning rate of the last step as a share of the first step's."""
MEAN_DECAY, SQUARE_DECAY, LEAST_ROOT = 0.9, 0.999, 1e-8
"""Adam's usual decays of the means of gradient and square, and the least root that it divides by."""
STRATA, EDGE_SAMPLES = 4, EdgeSamples(shadows=2, visibility=4)
"""Samples along a pixel's side, and along moving edges, of pictures with fixed samples. Gauss-Newton takes as
many rays for twice the resolution; norms, which are not squared, take the noise of such pixels for change."""
DIRECTIONS = 16
"""Parallel lights that stand for each light that is not parallel."""


class Moments(NamedTuple):
    """Running means of the gradient and of its square, (rows, cols)."""

    mean: Array
    square: Array

    def after(self, gradient: Array) -> "Moments":
        """The means with one more gradient."""
        return Moments(
            MEAN_DECAY * self.mean + (1.0 - MEAN_DECAY) * gradient,
            SQUARE_DECAY * self.square + (1.0 - SQUARE_DECAY) * gradient**2,
        )

    def direction(self, number: int) -> Array:
        """Adam's direction after so many gradients, at each sample about -1 to 1."""
        root = np.sqrt(self.square / (1.0 - SQUARE_DECAY**number))
        return self.mean / (1.0 - MEAN_DECAY**number) / (root + LEAST_ROOT)


class AdamDescent:
    """Adam as a descent method (`optimize.descent.driver.DescentMethod`)."""

    patience: int | None = None

    def __init__(self, problem: Problem, steps: int, settings: MethodSettings) -> None:
        self._problem, self._steps, self._settings = problem, steps, settings
        self._unit = 1.0 / problem.scene.white
        self._weights = torch.as_tensor(problem.scene.weights)
        self._views: tuple[StepView, ...] = ()
        if look_model(problem.look).sampled and problem.samples is None:
            samples = FixedSamples(None, problem.seed, STRATA, EDGE_SAMPLES, DIRECTIONS, blur=STEP_BLUR)
            self._views = problem.scene.look(problem.look).views(samples)
        # Target and current pictures share their samples, so that most or all of the noise cancels.
        self._target = self._pictures(torch.as_tensor(problem.heights))
        self._plate = problem.plate_weights(self._target.numpy())

    @classmethod
    def of_run(cls, problem: Problem, steps: int, settings: MethodSettings) -> Self:
        """The method by the settings of a run; see `MethodClass`."""
        return cls(problem, steps, settings)

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        """The pressure, and after the first step the means of gradient and square; see `MethodClass`."""
        mean, square = (ArraySchema(heights.shape, low, math.inf) for low in (-math.inf, 0.0))
        begun = {"mean": mean, "square": square} if {"mean", "square"} & memory.keys() else {}
        return {"pressure": PRESSURES, **begun}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights; see the protocol."""
        return self._iterate_at(step, heights, memory)

    def advance(self, iterate: Iterate) -> Iterate:
        """The iterate after one more step of Adam."""
        (slope,) = torch.autograd.grad(self._energy, self._heights)
        smoothing, number = self._settings.smoothing, iterate.step + 1
        still = np.zeros_like(iterate.heights)
        before = Moments(iterate.memory.get("mean", still), iterate.memory.get("square", still))
        moments = before.after(smoothed(slope.numpy(), smoothing))
        direction = moments.direction(number)
        progress = iterate.step / self._steps
        decay = DECAY_FLOOR + (1.0 - DECAY_FLOOR) * 0.5 * (1.0 + math.cos(math.pi * progress))
        change = -self._settings.learning_rate * decay * smoothed(direction, smoothing)
        heights = self._problem.placed(iterate.heights + change)
        memory = {"pressure": iterate.memory["pressure"], **moments._asdict()}
        return self._iterate_at(number, heights, memory)

    def reason_to_stop(self, iterate: Iterate) -> StopReason | None:
        """The paper's stopping rule, where it is wanted and holds; see the protocol."""
        met = self._settings.stop == "paper" and self._problem.targets.met(iterate.values)
        within = iterate.energies["visual"] < energies.visual_bound(self._weights)
        return StopReason.WITHIN_BOUNDS if met and within else None

    def _pictures(self, heights: Tensor) -> Tensor:
        problem = self._problem
        heights = problem.scene.levelled(heights)
        if self._views:
            return fixed_pictures(heights, self._views, problem.shadow_edges) * self._unit
        pictures = problem.scene.render(
            heights,
            samples=problem.samples,
            seed=problem.seed,
            model=problem.look,
            shadow_edges=problem.shadow_edges,
        )
        return pictures * self._unit

    def _iterate_at(self, step: int, heights: Array, memory: Mapping[str, Array]) -> Iterate:
        problem, targets = self._problem, self._problem.targets
        self._heights = torch.tensor(heights, requires_grad=True)
        # The fast models of touch are in single precision, heights always in double.
        dtype, pressure = problem.model.flat_strain.dtype, memory.get("pressure")
        fields = problem.fields(self._heights).to(dtype)
        begin = None if pressure is None else torch.as_tensor(pressure, dtype=dtype).reshape(fields.shape)
        touch = problem.model.press(fields, begin)
        values = {quantity.name: quantity.value(touch) for quantity in targets.quantities}
        pictures = self._pictures(self._heights)
        # The other weights grow with the unit of the target; of several, with the smallest.
        scale = min((target.quantity.energy_unit for target in targets.each), default=1.0)
        terms = {
            t.quantity.name: energies.target_energy(values[t.quantity.name], t.goal) for t in targets.each
        }
        visual = energies.visual_energy(pictures, self._target, self._weights)
        regularisation = energies.regularisation_energy(pictures, self._target, self._weights)
        self._energy = scale * (problem.look_weight * visual + problem.regularisation * regularisation)
        grown = scale * self._settings.growth ** (step / self._steps)
        for target in targets.each:
            self._energy = self._energy + grown / target.quantity.energy_unit * terms[target.quantity.name]
        pressures = touch.pressure.detach().reshape(-1, *fields.shape[-2:])
        terms |= {"visual": visual, "regularisation": regularisation}
        shown, weights = pictures.detach().numpy(), problem.scene.weights
        return Iterate(
            step,
            heights,
            {name: each(value) for name, value in values.items()},
            float(touch.contact_fraction.mean()),
            *change_percent(shown, self._target.numpy(), self._plate, weights),
            {**memory, "pressure": pressures.double().numpy().copy()},
            {name: float(term.detach()) for name, term in terms.items()},
        )
