"""Preparation of a run: scene loaded, original pressed, targets in numbers; nothing is written yet."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from optimize.descent.correction import STEPS_AN_ITERATION, Plan, first_surrogate_targets
from optimize.descent.driver import DescentMethod
from optimize.descent.gauss_newton.windows import MOST_AT_ONCE
from optimize.descent.methods import METHODS
from optimize.descent.problem import FingerRange, Problem
from optimize.descent.targets import Target, Targets
from optimize.run_directory.finished_run import holds_run
from optimize.runs.feel_of import Other, OtherFeel, feel, read_other
from optimize.runs.goal_bounds import check_counted, check_distance, telling_reach
from optimize.runs.goal_maps import GoalMap, RunGoals, goal_maps
from optimize.runs.memory import check_memory_of
from optimize.settings.run_file import Run
from optimize.settings.touch import too_large
from optimize.verification.converged import MOST_SAMPLES
from optimize.verification.jod import jod_obstacle
from optimize.verification.measuring import Original
from optimize.verification.steps_seen import StepsSeen
from optimize.verification.tilt import warn_of_tilt
from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError, naming
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.ground.progress import say, stage
from relief.maps import means_under
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName, check_model
from tactile.pair_variation import check_patch
from tactile.quantities import FLAT_SHARE, ROUGHNESS, GoalKey, Quantity, Values
from visual.looks import AUTO, EXACT, FAST
from visual.scene import Scene, load_scene, plate_size_mm

_log = logging.getLogger(__name__)

BLACK = 1e-3
"""Mean radiance, in units of white, of a black picture at most; a plate lit from below has a brighter rim."""


@dataclass(frozen=True, kw_only=True)
class Prepared(Original):
    """A run that is ready to begin.

    Attributes:
        plan: of the outer iterations.
    """

    plan: Plan


def checked_scene(settings: Run, variant: str | None) -> tuple[Scene, str, tuple[GoalMap, ...], Other | None]:
    """The scene of a run, checked as far as it can be without pressing.

    Returns:
        The scene, the look that steers, the goals that vary over the surface, and the relief whose feel is
        the target, if one is.

    Raises:
        InputError: what is wrong with scene, texture or targets, in one line.
    """
    scene = scene_of(settings, variant)
    look = steering_look(settings, scene)
    if scene.colour:
        _log.warning("%s: has colour; the descent keeps luminance", settings.scene)
    maps, other = checked_goals(settings, scene)
    with stage("rendering a first picture"):
        glimpse = scene.render(samples=1, seed=settings.seed)
    if float(glimpse.mean()) < BLACK * scene.white:
        raise InputError(f"{settings.scene}: its pictures are black; no light reaches the plate from above")
    return scene, look, maps, other


def scene_of(settings: Run, variant: str | None = None) -> Scene:
    """The scene of a run with its relief.

    Raises:
        InputError: what is wrong with scene or texture, or the run takes more memory than there is.
    """
    plate_mm = plate_size_mm(settings.scene, settings.define)
    relief = settings.relief(plate_mm)
    # Before the scene is loaded, which takes 20 s for 4096 x 4096 samples.
    locations = len(places(relief.surface, settings.touch.spacing_mm))
    check_memory_of(settings.texture, relief.surface.shape, locations)
    return load_scene(settings.scene, settings.define, variant, relief=relief)


def checked_goals(settings: Run, scene: Scene) -> tuple[tuple[GoalMap, ...], Other | None]:
    """The goals of a run, checked in milliseconds: nothing is pressed or rendered.

    Args:
        settings: of the run.
        scene: its `scene_of`.

    Returns:
        The goals that vary over the surface, and the relief whose feel is the target, if one is.

    Raises:
        InputError: what is wrong with texture, targets, or the models of touch and the samples of pictures
            that these need.
    """
    surface, touch = scene.surface, settings.touch
    lattice = places(surface, touch.spacing_mm)
    patches = Patches(surface, lattice, side_mm=touch.finger.patch_mm)
    for quantity, goal_key, number in touch.goals():
        if not goal_key.relative:
            # Before the operators of the skin are built, which can take many seconds.
            _check_goal(settings, quantity, goal_key, number, patches.size_mm)
    if np.ptp(scene.heights) == 0.0:
        key = next(iter(touch.stated().values()))
        raise InputError(
            f"{settings.texture}: touch.{key}: the texture is flat; there is no relief to change"
        )
    with naming(settings.texture):
        check_model(touch.finger, patches.samples, patches.size_mm, touch.model)
        if settings.verify.model == "fem":
            check_model(touch.finger, patches.samples, patches.size_mm, "fem", settings.verify.resolution)
        check_patch(patches.plate_mm)
    if touch.fingers != "one" and scene.heights.size > MOST_AT_ONCE:
        across = f"{surface.shape[1]} x {surface.shape[0]} samples"
        raise InputError(
            f"{settings.texture}: touch.fingers: {across} are more than 512 x 512; steer one finger"
        )
    maps = goal_maps(touch, surface, lattice)
    with naming(settings.texture):
        other = read_other(settings, scene.relief)
    # Refused now, not after the descent.
    if settings.verify.jod and (obstacle := jod_obstacle()):
        raise InputError(f"verify.jod: {obstacle}")
    scene.check_samples(max(settings.verify.samples or MOST_SAMPLES, settings.look.samples or 1))
    return maps, other


def prepare(settings: Run, variant: str | None) -> Prepared:
    """Load and check everything that a run needs, and press on the original.

    Raises:
        InputError: what is wrong with the input, in one line.
    """
    touch, descent = settings.touch, settings.descent
    method = METHODS[descent.method]
    scene, look, maps, other = checked_scene(settings, variant)
    seen = StepsSeen.of(settings, scene, look)
    with naming(settings.texture):
        untargeted = Problem(
            scene.relief,
            touch.finger,
            Targets(),
            scene,
            regularisation=descent.regularisation,
            look_weight=method.look_weight if settings.look.weight is None else settings.look.weight,
            masking=settings.look.masking,
            shape=settings.look.shape,
            broad=settings.look.broad if "look.broad" in method.takes else 0.0,
            shadow_edges=descent.shadow_edges,
            samples=settings.look.samples,
            seed=settings.seed,
            touch=touch.model,
            look=look,
            spacing_mm=touch.spacing_mm,
        )
    steered, verifier = untargeted.patches.places, _verifier(settings)
    original, targets, felt = press_original(settings, scene.relief, maps, other)

    def press(heights: Array, model: ModelName, at: Index) -> TouchMeasures:
        relief = replace(scene.relief, heights=heights)
        return measure_touch(relief, untargeted.skin, model, settings.verify.resolution, at=at)

    if untargeted.frozen is not None:
        below = f"more than {HEIGHT_LIMIT_MM:g} mm below the top, where no finger reaches"
        say(f"{100.0 * untargeted.frozen.mean():.3g} % of the area lies {below}, and stays as it is")
    problem = replace(untargeted, targets=targets, fingers=_fingers(settings, targets, original))

    def method_for(surrogate: Targets, steps: int) -> DescentMethod:
        return method.load().of_run(replace(problem, targets=surrogate), steps, descent)

    def verify(heights: Array) -> TouchMeasures:
        return press(heights, verifier or "layer", steered)

    # In single precision, as a descent by Gauss-Newton and the scaling for comparison are.
    single = replace(untargeted, precision=torch.float32)
    steering = single.press(scene.heights, _start(untargeted, original), gradients=False)
    return Prepared(
        settings=settings,
        problem=problem,
        plan=Plan(
            targets,
            method.own_steps or descent.steps,
            settings.verify.corrections if verifier else 0,
            method_for,
            None if settings.verify.model == "none" else verify,
            method.own_steps or STEPS_AN_ITERATION,
        ),
        steering=steering,
        touch_before=original,
        goals=RunGoals(targets, original.values, maps),
        press=press,
        surrogate_targets=first_surrogate_targets(targets, steering.values, original.values),
        feel_of=None if felt is None else felt.described(),
        steps_seen=seen,
    )


def press_original(
    settings: Run, relief: Relief, maps: Sequence[GoalMap], other: Other | None
) -> tuple[TouchMeasures, Targets, OtherFeel | None]:
    """Press on the original of a run, and on another relief whose feel is the target, by the verifying model.

    Returns:
        What the original feels like, the targets, and the feel of the other relief, if there is one.

    Raises:
        InputError: a goal is farther from the original than any run goes.
        ContactError: the contact on the original does not converge.
    """
    touch, model = settings.touch, _verifier(settings) or settings.touch.model
    lattice = places(relief.surface, touch.spacing_mm)
    with naming(settings.texture), stage("pressing on the original"):
        original = measure_touch(relief, touch.finger, model, settings.verify.resolution, at=lattice)
    if not holds_run(settings.texture.parent):
        warn_of_tilt(relief, touch.finger, original.means[ROUGHNESS.name])
    side_mm = Patches(relief.surface, lattice, side_mm=touch.finger.patch_mm).size_mm
    targets = _targets(settings, side_mm, original.values, maps, lattice)
    if other is None:
        return original, targets, None
    felt = feel(other, settings, model)
    with telling_reach(settings, ROUGHNESS, original.values[ROUGHNESS.name]):
        targets = Targets((*felt.targets(original.values, settings.descent.tolerance), *targets.each))
    return original, targets, felt


def known_in_reach(settings: Run, maps: Sequence[GoalMap]) -> bool:
    """Whether all goals are just-noticeable differences, of which a run file takes no more than a run."""
    goals = [(quantity, key) for quantity, key, _ in settings.touch.goals()]
    goals += [(varied.quantity, part.key) for varied in maps for part in varied.parts]
    return settings.touch.feel_of is None and all(one.in_jnd and key.relative for one, key in goals)


def _verifier(settings: Run) -> ModelName | None:
    return "fem" if settings.verify.model == "fem" else None


def _fingers(settings: Run, targets: Targets, original: TouchMeasures) -> FingerRange | None:
    """What the other fingers of a run are to feel: as great a change of roughness as the steered finger."""
    if settings.touch.fingers == "one":
        return None
    (goals,) = (target.goal for target in targets.each if target.quantity is ROUGHNESS)
    own = original.values[ROUGHNESS.name]
    factors = goals / np.maximum(own, FLAT_SHARE * own.mean())
    return FingerRange(factors, settings.touch.fingers_weight)


def _start(problem: Problem, touch: TouchMeasures) -> Array | None:
    """Pressures to start the first press of a descent from; None where its patches have another grid."""
    side = problem.patches.samples
    return touch.pressure if touch.pressure.shape == (problem.patches.count, side, side) else None


def check_look(settings: Run, scene: Scene) -> None:
    """Raise InputError if the look that is asked for cannot show the scene, or has no gradients of it."""
    look = settings.look.model
    if "look.model" not in METHODS[settings.descent.method].takes:
        return
    # What the fast look can show, exact pictures can.
    if look in (AUTO, EXACT):
        scene.check_model("exact")
    else:
        scene.look(look).check()


def steering_look(settings: Run, scene: Scene) -> str:
    """The name of the look that steers, checked before anything is pressed.

    A warning is logged where "auto" becomes "exact".

    Raises:
        InputError: as `check_look`.
    """
    check_look(settings, scene)
    look = settings.look.model
    if look != AUTO:
        return look
    try:
        scene.look(FAST).check()
    except InputError as obstacle:
        _log.warning("steps take exact light: %s", str(obstacle).partition("; use look.model")[0])
        return EXACT
    return FAST


def _targets(settings: Run, size_mm: float, original: Values, maps: Sequence[GoalMap], at: Index) -> Targets:
    """The targets of a run at places (k, 2), by the original's own values (k,). Raises InputError."""
    targets = []
    for quantity, key, number in settings.touch.goals():
        own = original[quantity.name]
        goals = key.goals(number, own)
        _check_goal(settings, quantity, key, float(goals.max()), size_mm)
        with telling_reach(settings, quantity, own), naming(f"touch.{key.key}"):
            # A change by 0 JND keeps the original's roughness, however small that is.
            if number:
                check_counted(quantity, key, own)
            check_distance(quantity, float(goals.mean()), float(own.mean()))
        targets.append(Target(quantity, goals, settings.descent.tolerance))
    for varied in maps:
        own = original[varied.quantity.name]
        with telling_reach(settings, varied.quantity, own):
            with naming(f"touch.{varied.name}"):
                for part in varied.parts:
                    inside = means_under(part.shares, varied.surface, at) > 0.0
                    check_counted(varied.quantity, part.key, own[inside] if inside.any() else own)
            varied.check(at, own)
        targets.append(Target(varied.quantity, varied.goals(at, own), settings.descent.tolerance))
    return Targets(tuple(targets))


def _check_goal(settings: Run, quantity: Quantity, key: GoalKey, goal: float, size_mm: float) -> None:
    """Raise InputError if a patch of this side has no room for a goal."""
    if goal > quantity.largest(size_mm):
        number = settings.touch.numbers()[key.key]
        fault = too_large(quantity, goal, size_mm)
        raise InputError(f"{settings.texture}: touch.{key.key}: {number:g}: {fault}")
