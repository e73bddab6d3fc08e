"""Bounds of goals: how far from the original a run goes at most, and how to see how far the look is kept."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from optimize.settings.run_file import Run
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formatting import number
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW, jnd_unless_smooth, smooth_clause
from tactile.quantities import LARGEST_JND, GoalKey, Quantity

ROUNDING = 1e-9
"""Relative rounding error of a goal that lies on a bound."""


def nearest_goals(quantity: Quantity, goals: Array, original: Array, side_mm: float) -> Array:
    """Goals (k,) moved into the bounds of a run, by the original's own values (k,) and the side of a patch.

    A goal within the bounds comes back as it is.
    """
    nearest = np.minimum(goals, quantity.largest(side_mm))
    if quantity.in_jnd:
        farthest = ROUGHNESS_JND**LARGEST_JND
        # Factors count from where just-noticeable differences do; nothing at all stays flat.
        most = np.where(original > 0.0, np.maximum(original, SMOOTH_BELOW), 0.0)
        nearest = np.clip(nearest, original / farthest, most * farthest)
    return np.where(np.abs(nearest - goals) <= ROUNDING * goals, goals, nearest)


def check_distance(quantity: Quantity, goal: float, original: float) -> None:
    """Raise InputError if a mean goal is farther from the original's mean than any run goes."""
    (nearest,) = nearest_goals(quantity, np.array([goal]), np.array([original]), np.inf)
    if nearest == goal:
        return
    apart = "out of reach of"
    if (jnd := jnd_unless_smooth(goal, original)) is not None:
        apart = f"{jnd:+.1f} just-noticeable differences from"
    raise InputError(
        f"{quantity.label} {number(goal)} is {apart} this texture's {number(original)}; "
        f"the nearest that a run takes is {number(nearest)} (touch.{quantity.goals[0].key})"
    )


def check_counted(quantity: Quantity, key: GoalKey, original: Array) -> None:
    """Raise InputError if a goal counts just-noticeable differences from a smooth original.

    Args:
        quantity, key: of the goal.
        original: (k,) the original's own values where the goal holds.
    """
    mean = float(original.mean())
    if quantity.in_jnd and key.relative and mean < SMOOTH_BELOW:
        line = f"{smooth_clause(mean)}, and no just-noticeable differences count from there; "
        raise InputError(
            f"{line}give touch.roughness or touch.feel_of", f"{line}give --roughness or --feel-of"
        )


@contextmanager
def telling_reach(settings: Run, quantity: Quantity, original: Array) -> Iterator[None]:
    """Prefix errors of the block with the texture, and append the command that estimates the reach.

    Of a smooth original, of which there is no reach in just-noticeable differences, nothing is appended.

    Args:
        settings: of the run.
        quantity: of the goal.
        original: the original's own values (k,).
    """
    texture, relief_mm = settings.texture, settings.relief_mm
    try:
        yield
    except InputError as error:
        in_python = in_command = ""
        if quantity.in_jnd and original.mean() >= SMOOTH_BELOW:
            argument, option = f", relief_mm={relief_mm}", f" --relief-mm {relief_mm}"
            if relief_mm is None:
                argument = option = ""
            purpose = "estimates how far its look is kept"
            in_python = f'; retouch.evaluate("{texture}"{argument}, reach="studio") {purpose}'
            in_command = f"; retouch evaluate {texture}{option} --reach {purpose}"
        line, for_command = f"{error}{in_python}", f"{error.for_command}{in_command}"
        raise InputError(f"{texture}: {line}", f"{texture}: {for_command}") from error
