"""Adam on the sum of the energies: the paper's method.

One optimiser takes both gradients: torch's through touch, and Mitsuba's through the pictures (plus shadow
edges), which arrives as the gradient of a torch function. The energy |r - V| has no curvature at its minimum,
so that steps overshoot the target; cosine decay of the learning rate makes the overshoot small.
"""

import math
from collections.abc import Mapping

import torch
from torch import Tensor

from optimize.descent import energies
from optimize.descent.driver import Iterate, Remembered
from optimize.descent.problem import Problem, change_percent
from relief.arrays import Array
from relief.limits import HEIGHT_LIMIT_MM

DECAY_FLOOR = 0.02
"""Learning rate of the last step as a share of the first step's."""


class AdamDescent:
    """Adam as a descent method (`optimize.descent.driver.DescentMethod`)."""

    patience: int | None = None

    def __init__(self, problem: Problem, steps: int, learning_rate: float) -> None:
        self._problem, self._steps, self._rate = problem, steps, learning_rate
        self._unit = 1.0 / problem.scene.white
        # Target and current pictures share their random numbers, so that most of the noise cancels.
        self._target = self._pictures(torch.as_tensor(problem.heights))
        self._plate = problem.plate_weights(self._target.numpy())
        self._heights = torch.nn.Parameter(torch.as_tensor(problem.heights).clone())
        self._adam = torch.optim.Adam([self._heights], lr=learning_rate)
        self._energy: Tensor | None = None

    @staticmethod
    def remembered(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, Remembered]:
        """The pressure, and after the first step the means of gradient and square; see the protocol."""
        pressure, mean, square = (Remembered(heights.shape, low, math.inf) for low in (0.0, -math.inf, 0.0))
        begun = {"mean": mean, "square": square} if {"mean", "square"} & memory.keys() else {}
        return {"pressure": pressure, **begun}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights; see the protocol."""
        self._heights = torch.nn.Parameter(torch.as_tensor(heights).clone())
        self._adam = torch.optim.Adam([self._heights], lr=self._rate)
        if "mean" in memory:
            self._adam.state[self._heights] = {
                "step": torch.tensor(float(step)),
                "exp_avg": torch.as_tensor(memory["mean"]).clone(),
                "exp_avg_sq": torch.as_tensor(memory["square"]).clone(),
            }
        return self._stand(step, memory.get("pressure"))

    def advance(self, iterate: Iterate) -> Iterate:
        """The iterate after one more step of Adam."""
        assert self._energy is not None
        progress = iterate.step / self._steps
        decay = DECAY_FLOOR + (1.0 - DECAY_FLOOR) * 0.5 * (1.0 + math.cos(math.pi * progress))
        self._adam.param_groups[0]["lr"] = self._rate * decay
        self._adam.zero_grad()
        self._energy.backward()
        self._adam.step()
        with torch.no_grad():
            # The paper's penalty lets heights stray a little; a printed plate cannot.
            self._heights.clamp_(0.0, HEIGHT_LIMIT_MM)
        return self._stand(iterate.step + 1, iterate.memory["pressure"])

    def _pictures(self, heights: Tensor) -> Tensor:
        problem = self._problem
        pictures = problem.scene.render(
            heights,
            samples=problem.samples,
            seed=problem.seed,
            model=problem.look,
            shadow_edges=problem.shadow_edges,
        )
        return pictures * self._unit

    def _stand(self, step: int, pressure: Array | None) -> Iterate:
        problem, targets, heights = self._problem, self._problem.targets, self._heights
        touch = problem.model.press(heights, None if pressure is None else torch.as_tensor(pressure))
        values = {quantity.name: quantity.value(touch, problem.size_mm) for quantity in targets.quantities}
        pictures = self._pictures(heights)
        # The other weights grow with the unit of the target; of several, with the smallest.
        scale = min((target.quantity.energy_unit for target in targets.each), default=1.0)
        energy = torch.zeros((), dtype=heights.dtype)
        for target in targets.each:
            distance = energies.target_energy(values[target.quantity.name], target.goal)
            energy = energy + distance / (target.quantity.energy_unit / scale)
        weights = torch.as_tensor(problem.scene.weights)
        look = problem.look_weight * energies.visual_energy(pictures, self._target, weights)
        look = look + problem.regularisation * energies.regularisation_energy(pictures, self._target, weights)
        clamp = energies.CLAMP_WEIGHT * energies.clamp_energy(heights, HEIGHT_LIMIT_MM)
        self._energy = energy + scale * (look + clamp)

        moments = self._adam.state.get(self._heights, {})
        memory = {"pressure": touch.pressure.detach().numpy().copy()}
        if moments:
            memory["mean"] = moments["exp_avg"].numpy().copy()
            memory["square"] = moments["exp_avg_sq"].numpy().copy()
        return Iterate(
            step,
            heights.detach().numpy().copy(),
            {name: float(value.detach()) for name, value in values.items()},
            float(touch.contact_fraction),
            *change_percent(
                pictures.detach().numpy(), self._target.numpy(), self._plate, problem.scene.weights
            ),
            memory,
        )
