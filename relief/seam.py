"""Seams: whether a height map is continuous across its borders, so that it may repeat."""

import shlex
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.errors import InputError

LARGEST_SEAM = 1.2
"""Largest step across the border of a tile, in the largest step inside.

Tiles that Retouch makes of the bundled textures have 0.08 to 0.87, the textures themselves 1.3 to 8 on at
least one axis.
"""
_AXES = ("y", "x")


def seams(heights: ArrayLike) -> tuple[float, float]:
    """Steps across the borders of a height map.

    Args:
        heights: (rows, cols).

    Returns:
        Along y (from the last row to the first) and along x (from the last column to the first): the root
        mean square of the step across the border, in the largest that any two neighbouring rows or columns
        have inside. 0 if neither has steps, infinite if only the border has.
    """
    heights = np.asarray(heights, dtype=np.float64)
    ratios = []
    for along in (heights, heights.T):
        across = np.mean((along[0] - along[-1]) ** 2)
        inside = np.mean(np.diff(along, axis=0) ** 2, axis=1).max()
        ratios.append(float(np.sqrt(across / inside)) if inside > 0 else np.inf if across > 0 else 0.0)
    return ratios[0], ratios[1]


def misfit(heights: ArrayLike, repeats: tuple[bool, bool] = (True, True)) -> str | None:
    """The fault by which a height map cannot repeat, as a sentence with a number; None if its sides fit.

    Args:
        heights: (rows, cols).
        repeats: Whether the height map is to repeat along y and along x.
    """
    if not any(repeats):
        return None
    for axis, seam, does in zip(_AXES, seams(heights), repeats, strict=True):
        if does and seam > LARGEST_SEAM:
            return (
                f"the sides do not fit along {axis}, where the step across the border is {seam:.1f} times "
                f"the largest inside (at most {LARGEST_SEAM:g})"
            )
    return None


def check_seams(heights: ArrayLike, repeats: tuple[bool, bool], name: object) -> None:
    """Refuse a repeat whose sides do not fit.

    Args:
        heights: (rows, cols).
        repeats: Whether the height map repeats along y and along x.
        name: Its file, for the message.

    Raises:
        InputError: `misfit` finds something; the line repeats it with the command that makes a tile.
    """
    sentence = misfit(heights, repeats)
    if sentence is not None:
        refusal = f"{name}: repeats: {sentence}; make a tile of it with: "
        path = Path(str(name))
        # In the working directory: the height map may lie among those of the package.
        out = f"{path.stem}-tile.png"
        for_python = f"{refusal}retouch.prepare({str(path)!r}, tile='auto').save({out!r})"
        for_command = f"{refusal}retouch prepare {shlex.quote(str(path))} -o {shlex.quote(out)} --tile"
        raise InputError(for_python, for_command)
