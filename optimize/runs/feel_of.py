"""The feel of another relief as a target: `touch.feel_of` of a run, read, checked and pressed."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from optimize.descent.targets import Target
from optimize.run_directory.finished_run import name_of
from optimize.runs.goal_bounds import check_distance
from optimize.runs.memory import check_memory_of
from optimize.settings.run_file import Run
from optimize.verification.verification import FeelOf
from relief.ground.arrays import Index
from relief.ground.errors import InputError, naming
from relief.ground.progress import say, stage
from relief.heightmap import holds_mm
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from relief.seam import check_seams
from relief.surface import Repeats, axes
from tactile import ContactError
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import Quantity, Values

KEY = "touch.feel_of"
LARGEST_MISFIT = 0.01
"""Largest relative difference of the sides of two patches whose contact areas compare: 2 % of area."""


@dataclass(frozen=True, eq=False)
class Other:
    """Another relief whose feel is the target.

    Attributes:
        name: the file's, or that of the run whose result it is.
        relief: as read from its file.
        at: (k, 2) places where fingers land.
    """

    name: str
    relief: Relief
    at: Index


@dataclass(frozen=True, eq=False)
class OtherFeel:
    """What a finger gets from the other relief.

    Attributes:
        quantities: those that are targets.
        touch: of the other relief, by the model that verifies.
    """

    other: Other
    quantities: tuple[Quantity, ...]
    touch: TouchMeasures

    def targets(self, original: Values, tolerance: float) -> tuple[Target, ...]:
        """The means over the other relief's places as targets; goals keep the proportions of the original's.

        Args:
            original: values (k,) of this relief at its places, by the names of quantities.
            tolerance: of the targets.

        Raises:
            InputError: the other relief feels farther from this one than any run goes.
        """
        means, name = self.touch.means, self.other.relief.name
        for one in self.quantities:
            own = float(original[one.name].mean())
            if one.in_jnd and min(own, means[one.name]) <= 0.0:
                raise InputError(f"{KEY}: {name}: feels of nothing; there is no {one.label} to reach")
            with naming(f"{KEY}: {name}"):
                check_distance(one, means[one.name], own)
        return tuple(
            Target(one, one.goals[0].goals(means[one.name], original[one.name]), tolerance, self.other.name)
            for one in self.quantities
        )

    def described(self) -> FeelOf:
        """Whose feel, its values, and which of them are targets."""
        return FeelOf(
            name=self.other.name,
            quantities=tuple(quantity.name for quantity in self.quantities),
            model=self.touch.model,
            values=self.touch.means,
            places=self.touch.ends,
        )


def read_other(settings: Run, own: Relief) -> Other | None:
    """The other relief of a run, read and checked; None if its target is no other's feel.

    Args:
        settings: of the run.
        own: the run's own relief.

    Raises:
        InputError: one line that names the key and the file.
    """
    touch = settings.touch
    if touch.feel_of is None:
        return None
    file, relief_mm = touch.feel_of, touch.feel_of_relief_mm
    if relief_mm is not None and holds_mm(file):
        raise InputError(f"{KEY}_relief_mm: is for pictures; {file} holds mm")
    with naming(KEY):
        plate = _read(file, relief_mm, None if touch.feel_of_repeats is None else False)
        if np.ptp(plate.heights) == 0.0:
            raise InputError(f"{file}: is flat; there is no feel to take over")
    repeats = axes(touch.feel_of_repeats)
    if touch.feel_of_repeats is None:
        repeats = plate.repeats if any(plate.repeats) else settings.axes_repeat
    with naming(f"{KEY}_repeats"):
        check_seams(plate.heights, repeats, file)
    other = replace(plate, repeats=repeats)
    at = places(other.surface)
    with naming(KEY):
        check_memory_of(file, other.surface.shape, len(at))
    sides = [Patches(each.surface, places(each.surface)).size_mm for each in (other, own)]
    if abs(sides[0] / sides[1] - 1.0) > LARGEST_MISFIT:
        raise InputError(
            f"{KEY}: {file}: a finger presses on {sides[0]:g} mm of it and on {sides[1]:g} mm of this "
            "texture; give both the same size_mm"
        )
    if repeats == own.repeats and np.array_equal(other.heights, own.heights):
        raise InputError(f"{KEY}: {file}: is this texture itself; there is nothing to change")
    return Other(name_of(file), other, at)


def _read(file: Path, relief_mm: float | None, repeats: Repeats | None) -> Relief:
    """The other relief; the refusal of a picture of unknown relief names the key that is for this one."""
    try:
        return Relief.read(file, relief_mm=relief_mm, repeats=repeats)
    except InputError as error:
        line = str(error).replace(": relief_mm: missing", ": feel_of_relief_mm: missing")
        for_command = error.for_command.replace(": --relief-mm: missing", ": --feel-of-relief-mm: missing")
        raise InputError(line, for_command) from error


def feel(other: Other, settings: Run, model: ModelName) -> OtherFeel:
    """Press on the other relief with the skin of a run, everywhere, and say what is felt.

    Raises:
        InputError: heights or size are out of range, or the contact does not converge.
    """
    touch, mesh = settings.touch, settings.verify.resolution
    with naming(KEY), naming(other.relief.name), stage(f"pressing on {other.name}"):
        try:
            felt = measure_touch(other.relief, touch.finger, model, mesh, at=other.at)
        except ContactError as error:
            raise InputError(str(error)) from error
    result = OtherFeel(other, touch.feel_of_quantities, felt)
    values = ", ".join(f"{one.label} {one.text(felt.means[one.name])}" for one in result.quantities)
    average = f", the mean of {len(other.at)} places" if len(other.at) > 1 else ""
    say(f"the feel of {other.name}: {values}{average}")
    return result
