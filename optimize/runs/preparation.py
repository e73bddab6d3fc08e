"""A run made ready: its scene loaded, its original pressed, its targets in numbers, nothing written yet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.correction import Plan, first_aim
from optimize.descent.driver import WayDown
from optimize.descent.gauss_newton import GaussNewton
from optimize.descent.problem import Problem, Targets
from optimize.descent.verification import TouchMeasured, measure_touch
from optimize.runs.config import Run, Touch
from optimize.runs.progress import Progress
from relief.errors import InputError, naming
from visual.scene import load_scene

Array = NDArray[np.float64]

ADAM_SAMPLES = 16
"""A pixel, of the pictures that Adam's gradient comes from."""
BLACK = 1e-3
"""Of white: above what reaches the rim of a plate that is lit from below only."""


@dataclass(frozen=True)
class Prepared:
    """A run made ready.

    Attributes:
        problem: its targets are those that the truth is to meet.
        believed: roughness and contact area of the original by the model that steers.
        touch_before: of the original, by the verification if there is one.
        first_aim: what the model that steers is to go for.
    """

    settings: Run
    problem: Problem
    plan: Plan
    believed: tuple[float, float]
    touch_before: TouchMeasured
    first_aim: Targets


def prepare(settings: Run, variant: str | None, show: Progress) -> Prepared:
    """Load and check everything that a run needs, and press on the original.

    Raises:
        InputError: what is wrong with the input, in one line.
    """
    scene = load_scene(
        settings.scene,
        settings.define,
        variant,
        texture=settings.texture,
        size_mm=settings.size_mm,
        relief_mm=settings.relief_mm,
    )
    touch, descent = settings.touch, settings.descent
    if np.ptp(scene.heights) == 0.0:
        raise InputError(
            f"{settings.texture}: {_asked(touch)}: the texture is flat; there is no relief to change"
        )
    with naming(settings.texture):
        untargeted = Problem(
            scene.heights,
            settings.size_mm,
            tactile.Skin(touch.young_modulus_mpa, touch.poisson_ratio, touch.force_n),
            Targets(None, None, descent.tolerance),
            scene,
            regularisation=descent.regularisation,
            look_weight=settings.look.weight,
            shadow_edges=descent.shadow_edges,
            samples=settings.look.samples or ADAM_SAMPLES,
            seed=settings.seed,
            touch=touch.model,
            look=settings.look.model,
        )
    glimpse = scene.render(samples=1, seed=settings.seed)
    if float(glimpse.mean()) < BLACK * scene.white:
        raise InputError(f"{settings.scene}: its pictures are black; no light reaches the plate from above")
    truth = None
    if settings.verify.model == "fem":
        show.note(
            f"pressing on the original with finite elements, {settings.verify.resolution} nodes a side "
            "(built once per skin, then kept)"
        )
    with naming(settings.texture):
        if settings.verify.model == "fem":
            truth = measure_touch(untargeted, scene.heights, "fem", settings.verify.resolution)
        original = truth or measure_touch(untargeted, scene.heights, touch.model)
    targets = _targets(settings, original.roughness, original.contact_area_mm2)
    problem = replace(untargeted, targets=targets)

    def way_toward(aim: Targets, steps: int) -> WayDown:
        aiming = replace(problem, targets=aim)
        if descent.method == "adam":
            return AdamDescent(aiming, steps, descent.learning_rate)
        return GaussNewton(aiming)

    def verify(heights: Array) -> TouchMeasured:
        if truth is None:
            return measure_touch(problem, heights, "layer")
        return measure_touch(problem, heights, "fem", settings.verify.resolution)

    steering = untargeted.feel(scene.heights, gradients=False)
    believed = steering.roughness, steering.contact_area_mm2
    return Prepared(
        settings,
        problem,
        Plan(
            targets,
            descent.steps,
            settings.verify.corrections if truth else 0,
            way_toward,
            None if settings.verify.model == "none" else verify,
        ),
        believed,
        original,
        first_aim(targets, believed, (original.roughness, original.contact_area_mm2)),
    )


def _asked(touch: Touch) -> str:
    """The key of the first target that is given."""
    keys = ("roughness", "jnd", "contact_area_mm2", "contact_area_scale")
    return next(f"touch.{key}" for key in keys if getattr(touch, key) is not None)


def _targets(settings: Run, roughness: float, area: float) -> Targets:
    touch = settings.touch
    wanted = touch.roughness
    if touch.jnd is not None:
        wanted = tactile.jnd_scaled(roughness, touch.jnd)
    wanted_area = touch.contact_area_mm2
    if touch.contact_area_scale is not None:
        wanted_area = area * touch.contact_area_scale
        if wanted_area > settings.size_mm**2:
            raise InputError(
                f"touch.contact_area_scale: {touch.contact_area_scale:g} x {area:.1f} mm2 exceeds the plate"
            )
    return Targets(wanted, wanted_area, settings.descent.tolerance)
