"""Other fingers of a descent: a relief is drawn toward the same change for softer, stiffer and other skin.

The steered finger is a constraint of every step. The others (`tactile.fingers`) are least squares beside the
look: a step minimises

    look + 1/2 pixels (weight / 100)² mean of r_j²

with r_j the distance of finger j to its goal in just-noticeable differences, so that `weight` is the picture
change, rms in % of the mean, that counts as much as one just-noticeable difference. Contact is homogeneous:
skin c times as stiff feels of a relief what the given skin feels of c times its heights, divided by c. All
fingers are therefore one batch of the model that steers.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

from optimize.descent.problem import FingerRange, Problem
from relief.common.arrays import Array
from relief.common.threads import one_torch_thread
from relief.patches import STEERING_SAMPLES, Patches
from tactile import jnd_scaled, roughness, touch_model
from tactile.fingers import at_depth, fingers
from tactile.jnd import SMOOTH
from tactile.layer.elastic_layer import ElasticLayerOperator
from tactile.pressing import Press

MOST_PLACES = 4
"""Most places where other fingers press: their mean over the places is drawn to a goal, not each of them."""
LARGEST_SHARE = 0.2
"""Largest change of a finger's roughness that a step is to make, as a share of its value."""
JND = float(np.log(jnd_scaled(1.0, 1.0)))
"""Just-noticeable difference of roughness, as a logarithm."""


class SoftTargets(NamedTuple):
    """Targets as terms of the sum that a step minimises: the step approaches them, but need not meet them.

    Attributes:
        gradients: (m, heights) of the values.
        wanted: (m,) change of the values.
        stiffness: (m,) second derivative of the sum that is minimised, by each value.
    """

    gradients: Array
    wanted: Array
    stiffness: Array


@dataclass(frozen=True)
class FingersFelt:
    """What the other fingers feel of a relief.

    Attributes:
        values: (m,) roughness to each finger, mean over the places.
        goals: (m,) of the values.
        gradients: (m, heights) of the values.
        weight: as in `FingerRange`.
        stiffness: second derivative of the sum by the distance of all fingers in just-noticeable differences.
        pressure: (loads * places, n, n) MPa, to start the press of a similar relief from.
    """

    values: Array
    goals: Array
    gradients: Array
    weight: float
    stiffness: float
    pressure: Array

    @property
    def jnd_off(self) -> Array:
        """(m,) distance to the goals in just-noticeable differences; positive is too rough."""
        return np.asarray(np.log(np.maximum(self.values, SMOOTH) / np.maximum(self.goals, SMOOTH)) / JND)

    @property
    def percent(self) -> float:
        """Distance to the goals, rms over the fingers, in the % of picture change that it counts as."""
        return self.weight * float(np.sqrt(np.square(self.jnd_off).mean()))

    def soft_targets(self) -> SoftTargets:
        """The goals as soft targets of a step."""
        values = np.maximum(self.values, SMOOTH)
        unit, most = JND * values, LARGEST_SHARE * values
        wanted = np.clip(-self.jnd_off * unit, -most, most)
        return SoftTargets(self.gradients, wanted, self.stiffness / len(unit) / unit**2)


class OtherFingers:
    """The fingers about the steered one, by the model that steers.

    Args:
        problem: with the steered finger; its heights are the original.
        wanted: of the other fingers.
        pixels: number of pixels of the look, with their weights, that count as a whole.
    """

    def __init__(self, problem: Problem, wanted: FingerRange, pixels: float) -> None:
        skin, patches = problem.skin, problem.patches
        spread = np.linspace(0, patches.count - 1, min(patches.count, MOST_PLACES)).round().astype(int)
        self._free = problem.free
        self._patches = Patches(problem.surface, patches.places[spread], STEERING_SAMPLES, skin.patch_mm)
        model = problem.model
        if problem.touch == "net":
            # The net has not seen reliefs as tall as those of stiff skin become.
            grid = patches.samples, patches.size_mm, model.flat_strain.dtype
            model = touch_model(skin, *grid, "quick")
        self._model = model
        self._fingers = fingers(skin)[1:]
        stiffness = [finger.skin.young_modulus_mpa / skin.young_modulus_mpa for finger in self._fingers]
        self._loads = sorted(set(stiffness))
        self._load_of = [self._loads.index(factor) for factor in stiffness]
        assert isinstance(model.operator, ElasticLayerOperator)
        presses = {
            finger.skin.depth_mm: Press.of(skin, at_depth(model.operator, finger.skin))
            for finger in self._fingers
        }
        flat = Press.of(skin, model.operator).pressure(torch.zeros_like(model.flat_strain))
        self._at_depth = {depth: (press, press.felt(flat)) for depth, press in presses.items()}
        self._weight, self._stiffness = wanted.weight, pixels * (wanted.weight / 100.0) ** 2
        self._first: torch.Tensor | None = None
        values, _, self._first = self._press(problem.heights, None)
        each = np.stack([value.detach().double().numpy() for value in values])
        self._goals = (wanted.factors[spread] * each).mean(axis=1)

    @one_torch_thread()
    def press(self, heights: Array, start: Array | None = None) -> FingersFelt:
        """Press on a relief with every other finger.

        Args:
            heights: (rows, cols) mm.
            start: pressure of a similar relief, as in `FingersFelt`; of another shape or None, that of the
                original takes its place.

        Raises:
            ContactError: a contact does not converge.
        """
        each, scaled, pressure = self._press(heights, start)
        values = [value.mean() for value in each]
        pairs = zip(values, self._load_of, strict=True)
        rows = np.stack([self._row(value, scaled, load) for value, load in pairs])
        felt = np.array([float(value.detach()) for value in values])
        kept = pressure.double().numpy()
        return FingersFelt(felt, self._goals, rows, self._weight, self._stiffness, kept)

    def _press(
        self, heights: Array, start: Array | None
    ) -> tuple[list[torch.Tensor], torch.Tensor, torch.Tensor]:
        """Roughness (places,) to each finger, the scaled patches (loads * places, n, n) it depends on, and
        their pressure."""
        model, modulus = self._model, self._model.skin.young_modulus_mpa
        patches = torch.as_tensor(self._patches.within_reach(heights), dtype=model.flat_strain.dtype)
        scaled = torch.cat([factor * patches for factor in self._loads]).requires_grad_()
        begin = self._first
        if start is not None and start.shape == tuple(scaled.shape):
            begin = torch.as_tensor(start, dtype=scaled.dtype)
        touch = model.press(scaled, begin)
        pressures = (touch.pressure / modulus).unflatten(0, (len(self._loads), len(patches)))
        values = []
        for finger, load in zip(self._fingers, self._load_of, strict=True):
            press, flat = self._at_depth[finger.skin.depth_mm]
            strain = (press.felt(pressures[load]) - flat) / self._loads[load]
            values.append(roughness(strain, self._patches.size_mm, "polar", touch.receptors))
        return values, scaled, touch.pressure.detach()

    def _row(self, value: torch.Tensor, scaled: torch.Tensor, load: int) -> Array:
        """(heights,) gradient of a value by the relief."""
        (gradient,) = torch.autograd.grad(value, scaled, retain_graph=True)
        of_load = gradient.unflatten(0, (len(self._loads), self._patches.count))[load]
        row = self._loads[load] * self._patches.back(of_load.double().numpy()).reshape(1, -1)
        return self._free(row)[0]
