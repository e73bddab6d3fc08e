"""Other fingers of a descent: soft targets for the same change of roughness to softer and stiffer skin.

The steered finger is a constraint of every step. Other fingers (`tactile.fingers`) are least squares beside
the look: a step minimises

    look + 1/2 pixels (weight / 100)² mean of r_j²

with r_j the distance of finger j to its goal in just-noticeable differences, so that `weight` is the picture
change, rms in % of the mean, that counts as much as one just-noticeable difference. Fingers of one modulus
press once, whatever the depth of their receptors.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from optimize.descent.problem import Problem
from relief.ground.arrays import Array
from relief.ground.threads import one_torch_thread
from relief.patches import STEERING_SAMPLES, Patches
from tactile import jnd_scaled, roughness, touch_model
from tactile.fingers import at_depth, fingers
from tactile.jnd import SMOOTH_BELOW
from tactile.layer.elastic_layer import ElasticLayerOperator
from tactile.pressing import Press

MOST_PLACES = 4
"""Most places where other fingers press: the goal of a finger is a mean over the places."""
LARGEST_SHARE = 0.2
"""Largest change of a finger's roughness that a step is to make, as a share of its value."""
JND = float(np.log(jnd_scaled(1.0, 1.0)))
"""Just-noticeable difference of roughness, as a logarithm."""


class SoftTargets(NamedTuple):
    """Targets as terms of the sum that a step minimises, which the step approaches and need not meet.

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
    """Roughness of a relief to the other fingers.

    Attributes:
        values: (m,) roughness to each finger, mean over the places.
        goals: (m,) of the values.
        gradients: (m, heights) of the values.
        weight: as in `FingerRange`.
        stiffness: second derivative of the sum by the distance of all fingers in just-noticeable differences.
        pressure: (moduli * places, n, n) MPa, to start the press of a similar relief from.
    """

    values: Array
    goals: Array
    gradients: Array
    weight: float
    stiffness: float
    pressure: Array

    @property
    def _counted(self) -> Array:
        """(m,) roughness, or that from which just-noticeable differences count."""
        return np.maximum(self.values, SMOOTH_BELOW)

    @property
    def jnd_off(self) -> Array:
        """(m,) distance to the goals in just-noticeable differences; positive is too rough."""
        return np.asarray(np.log(self._counted / np.maximum(self.goals, SMOOTH_BELOW)) / JND)

    @property
    def percent(self) -> float:
        """Distance to the goals, rms over the fingers, in the % of picture change that it counts as."""
        return self.weight * float(np.sqrt(np.square(self.jnd_off).mean()))

    def soft_targets(self) -> SoftTargets:
        """The goals as soft targets of a step."""
        unit, most = JND * self._counted, LARGEST_SHARE * self._counted
        wanted = np.clip(-self.jnd_off * unit, -most, most)
        return SoftTargets(self.gradients, wanted, self.stiffness / len(unit) / unit**2)


class OtherFingers:
    """The fingers other than the steered one, by the model that steers.

    Args:
        problem: with the steered finger and the range of the others; its heights are the original.
        pixels: number of pixels of the look, with their weights, that count as a whole.
    """

    def __init__(self, problem: Problem, pixels: float) -> None:
        skin, patches, wanted = problem.skin, problem.patches, problem.fingers
        assert wanted is not None
        spread = np.linspace(0, patches.count - 1, min(patches.count, MOST_PLACES)).round().astype(int)
        self._free = problem.free
        self._patches = Patches(problem.surface, patches.places[spread], STEERING_SAMPLES, skin.patch_mm)
        # The net has not seen contacts as sparse as those of stiff skin become.
        kind = "quick" if problem.touch == "net" else problem.touch
        grid = patches.samples, patches.size_mm, problem.model.flat_strain.dtype, kind
        self._fingers = fingers(skin)[1:]
        pressed = [replace(finger.skin, depth_mm=skin.depth_mm) for finger in self._fingers]
        skins = list(dict.fromkeys(pressed))
        self._models = [touch_model(one, *grid) for one in skins]
        self._model_of = [skins.index(one) for one in pressed]
        self._felt = list[tuple[Press, torch.Tensor]]()
        for finger, number in zip(self._fingers, self._model_of, strict=True):
            model = self._models[number]
            assert isinstance(model.operator, ElasticLayerOperator)
            flat = Press.of(model.skin, model.operator).pressure(torch.zeros_like(model.flat_strain))
            press = Press.of(finger.skin, at_depth(model.operator, finger.skin))
            self._felt.append((press, press.felt(flat)))
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
        each, patches, pressure = self._press(heights, start)
        values = [value.mean() for value in each]
        rows = np.stack([self._row(value, patches) for value in values])
        felt = np.array([float(value.detach()) for value in values])
        kept = pressure.double().numpy()
        return FingersFelt(felt, self._goals, rows, self._weight, self._stiffness, kept)

    def _press(
        self, heights: Array, start: Array | None
    ) -> tuple[list[torch.Tensor], torch.Tensor, torch.Tensor]:
        """Roughness (places,) to each finger, the patches (places, n, n) it depends on, and the pressures."""
        dtype = self._models[0].flat_strain.dtype
        patches = torch.as_tensor(self._patches.within_reach(heights), dtype=dtype).requires_grad_()
        shape = (len(self._models) * len(patches), *patches.shape[1:])
        begin = self._first
        if start is not None and start.shape == shape:
            begin = torch.as_tensor(start, dtype=dtype)
        begins = [None] * len(self._models) if begin is None else begin.chunk(len(self._models))
        touches = [model.press(patches, one) for model, one in zip(self._models, begins, strict=True)]
        values = []
        for number, (press, flat) in zip(self._model_of, self._felt, strict=True):
            touch = touches[number]
            strain = press.felt(touch.pressure / self._models[number].skin.young_modulus_mpa) - flat
            values.append(roughness(strain, self._patches.size_mm, "polar", touch.receptors))
        return values, patches, torch.cat([touch.pressure.detach() for touch in touches])

    def _row(self, value: torch.Tensor, patches: torch.Tensor) -> Array:
        """(heights,) gradient of a value by the relief."""
        (gradient,) = torch.autograd.grad(value, patches, retain_graph=True)
        return self._free(self._patches.back(gradient.double().numpy()).reshape(1, -1))[0]
