"""The whole way of a height map through the program: load, descend, verify, write.

texture -> Problem (touch + sight) -> descend -> verification -> run directory
"""

from __future__ import annotations

import shutil
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactile
from optimize import results
from optimize.adam import AdamDescent
from optimize.baselines import linear_scaling
from optimize.checkpoint import FILE as CHECKPOINT
from optimize.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from optimize.config import Run, Touch, load_run
from optimize.gauss_newton import GaussNewton
from optimize.loop import Descent, Iterate, StopReason, WayDown, descend
from optimize.problem import Problem, Targets
from optimize.progress import Progress, silent, terminal
from optimize.verification import converged_pictures, measure_touch
from visual.errors import InputError
from visual.scene import load_scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Result:
    """What a run gives.

    Attributes:
        heights: (rows, cols) mm.
        stop: why the descent stopped.
        summary: the content of result.json.
        run_dir: where everything lies.
    """

    heights: Array
    stop: StopReason
    summary: dict[str, Any]
    run_dir: Path


def run(
    run: Run | str | Path,
    out: Path | str | None = None,
    *,
    variant: str | None = None,
    force: bool = False,
    quiet: bool = True,
) -> Result:
    """Optimise one texture and write its run directory.

    Args:
        run: a run, or the path of a run file.
        out: the run directory; default `runs/<name of the run file or texture>`.
        variant: Mitsuba's.
        force: replace an earlier run in `out`.
        quiet: show no progress.

    Raises:
        InputError: what is wrong with the input, in one line; nothing is written then.
    """
    name = Path(run).stem if not isinstance(run, Run) else run.texture.stem
    settings = run if isinstance(run, Run) else load_run(run)
    run_dir = Path("runs") / name if out is None else Path(out)
    _check_vacant(run_dir, force)
    began = time.perf_counter()
    problem, way, original = _prepare(settings, variant)
    start = way.begin(0, problem.heights, {})
    _clear(run_dir)
    results.write_settings(run_dir, settings)
    return _descend_and_write(settings, problem, way, original, start, None, run_dir, began, 0.0, quiet)


def resume(run_dir: Path | str, *, variant: str | None = None, quiet: bool = True) -> Result:
    """Go on with a run from its checkpoint; ends as the uninterrupted run would, within tolerance.

    Raises:
        InputError: the directory holds no run or no readable checkpoint.
    """
    run_dir = Path(run_dir)
    settings = load_run(run_dir / results.SETTINGS)
    checkpoint = load_checkpoint(run_dir)
    began = time.perf_counter()
    problem, way, original = _prepare(settings, variant)
    current = checkpoint.current
    if current.heights.shape != problem.heights.shape:
        raise InputError(
            f"{run_dir}: checkpoint: {current.heights.shape} heights, the texture has {problem.heights.shape}"
        )
    start = way.begin(current.step, current.heights, current.memory)
    best, spent = checkpoint.best, checkpoint.seconds
    return _descend_and_write(settings, problem, way, original, start, best, run_dir, began, spent, quiet)


def _prepare(settings: Run, variant: str | None) -> tuple[Problem, WayDown, tuple[float, float]]:
    """The problem of a run, its way down, and the original's roughness and contact area."""
    scene = load_scene(
        settings.scene,
        settings.define,
        variant,
        texture=settings.texture,
        size_mm=settings.size_mm,
        relief_mm=settings.relief_mm,
    )
    touch = settings.touch
    if touch.model != "layer":
        raise InputError(
            f'touch.model: the "{touch.model}" model is not shipped in this version; use "layer"'
        )
    if np.ptp(scene.heights) == 0.0:
        raise InputError(
            f"{settings.texture}: {_asked(touch)}: the texture is flat; there is no relief to change"
        )
    skin = tactile.Skin(touch.young_modulus_mpa, touch.poisson_ratio, touch.force_n)
    pressed = tactile.press(scene.heights, settings.size_mm, skin)
    roughness = float(tactile.roughness(pressed.strain, settings.size_mm))
    area = float(tactile.contact_area(pressed.gap, settings.size_mm))
    problem = Problem(
        scene.heights,
        settings.size_mm,
        skin,
        _targets(settings, roughness, area),
        scene,
        regularisation=settings.descent.regularisation,
        look_weight=settings.look.weight,
        shadow_edges=settings.descent.shadow_edges,
        samples=settings.look.samples or ADAM_SAMPLES,
        seed=settings.seed,
    )
    glimpse = converged_pictures(problem, problem.heights, samples=1, seed=settings.seed)
    if glimpse.mean() < BLACK * scene.white:
        raise InputError(f"{settings.scene}: its pictures are black; no light reaches the plate from above")
    steps = settings.descent.steps
    way: WayDown
    if settings.descent.method == "adam":
        way = AdamDescent(problem, steps, settings.descent.learning_rate)
    else:
        way = GaussNewton(problem)
    return problem, way, (roughness, area)


ADAM_SAMPLES = 16
"""A pixel, of the pictures that Adam's gradient comes from."""
BLACK = 1e-3
"""Of white: above what reaches the rim of a plate that is lit from below only."""


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


def _descend_and_write(
    settings: Run,
    problem: Problem,
    way: WayDown,
    original: tuple[float, float],
    start: Iterate,
    best: Iterate | None,
    run_dir: Path,
    began: float,
    spent: float,
    quiet: bool,
) -> Result:
    show: Progress
    steps = settings.descent.steps
    with silent() if quiet else terminal(problem.targets, steps) as show:
        history = results.History(run_dir, problem.targets, after=start.step)
        descent_began = time.perf_counter()

        def on_step(current: Iterate, best: Iterate, seconds: float) -> None:
            total = spent + time.perf_counter() - descent_began
            history.add(current, total)
            save_checkpoint(run_dir, Checkpoint(current, best, total))
            show.step(current, seconds)

        if best is None:
            history.add(start, spent)
            save_checkpoint(run_dir, Checkpoint(start, start, spent))
        with _kill_as_interrupt():
            descent = descend(way, problem.targets, start, steps, best, on_step, history.trace())
        descent_seconds = spent + time.perf_counter() - descent_began
        show.note("verifying")
        verify_began = time.perf_counter()
        outcome = _measure(settings, problem, original, descent)
        finished = time.perf_counter()
        times = {
            "total": spent + finished - began,
            "set_up": descent_began - began,
            "descent": descent_seconds,
            "verify": finished - verify_began,
        }
        show.note("writing")
        summary = results.write(run_dir, settings, problem, outcome, times, history.rows)
    return Result(descent.best.heights, descent.reason, summary, run_dir)


def _measure(
    settings: Run, problem: Problem, original: tuple[float, float], descent: Descent
) -> results.Outcome:
    # The same random numbers before and after: what differs between the pictures is the relief, not noise.
    samples, seed = settings.verify.samples, settings.seed + 1
    before = converged_pictures(problem, problem.heights, samples, seed)
    after = converged_pictures(problem, descent.best.heights, samples, seed)
    scaled = linear_scaling(problem)
    baseline = None if scaled is None else converged_pictures(problem, scaled, samples, seed)
    touch_after = measure_touch(problem, descent.best.heights, "layer")
    return results.Outcome(
        descent=descent,
        initial_roughness=original[0],
        initial_contact_area_mm2=original[1],
        touch_before=measure_touch(problem, problem.heights, "layer"),
        touch_after=touch_after,
        verified=None if settings.verify.model == "none" else touch_after,
        pictures_before=before,
        pictures_after=after,
        baseline_heights=scaled,
        baseline_pictures=baseline,
    )


def _check_vacant(run_dir: Path, force: bool) -> None:
    if run_dir.exists() and not run_dir.is_dir():
        raise InputError(f"{run_dir}: is a file; a run writes a folder")
    if not run_dir.is_dir() or not any(run_dir.iterdir()):
        return
    if not force:
        raise InputError(f"{run_dir}: holds an earlier run; give --force to replace it, or another -o")
    if not (run_dir / CHECKPOINT).is_file():
        raise InputError(f"{run_dir}: holds files that are not a run's; they are not replaced")


def _clear(run_dir: Path) -> None:
    """Take away what an earlier run has left, and nothing else."""
    run_dir.mkdir(parents=True, exist_ok=True)
    for name in results.WRITTEN:
        path = run_dir / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


@contextmanager
def _kill_as_interrupt() -> Iterator[None]:
    """A polite kill ends the descent as Ctrl-C does; only the main thread may say so."""

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
