"""Forecast of a run: its input is checked, and its time, memory and disk are estimated; nothing is written.

The seconds were measured on gravel in the studio, 128 samples over 10 mm and 256, and on plates of 25 and 80
mm, on two cores of an AMD EPYC, the memory on 64 to 256 samples a side. They are
proportional to the samples or pixels; another machine or another scene may take half or twice as much.
"""

import math
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from optimize.descent.gauss_newton.other_fingers import MOST_PLACES
from optimize.descent.methods import METHODS, PIXEL_S, Effort
from optimize.runs.memory import WINDOW, machine_gib, needed_gib
from optimize.runs.preparation import checked_scene, known_in_reach, press_original
from optimize.settings.run_file import Run
from optimize.verification.felt_places import MOST_BETWEEN
from optimize.verification.steps_seen import StepsSeen
from relief.ground.errors import InputError
from relief.ground.formatting import duration, number
from relief.patches import Patches
from relief.places import places
from tactile.elements import finite_elements, round_pad
from tactile.layer import elastic_layer
from tactile.touch_limits import FEM_MESH, model_name
from visual.looks import AUTO, FAST, look_model

START_S = 6.0
"""Seconds to import, load and compile, to press on the original, and for the baseline and the report."""
RENDERED, UNTIL_KNOWN = 2, 64
"""Reliefs whose final pictures are rendered, and about how many samples a pixel make their change known."""
VERIFIED_S = 6e-6
"""Seconds for each sample of a patch beyond the first, pressed by finite elements before and after. About as
many patches lie between the places, `MOST_BETWEEN` at most."""
PLACE_S = 1.5e-4
"""Seconds of a step for each place of the finger beyond the first, and for each sample along a side of what
is solved at once: the whole surface, or a window of at most `WINDOW` samples in all."""
LAYER_BUILT_S, ELEMENTS_BUILT_S, NODES_POWER, LAYERED, PAD_BUILT_S = 0.4, 3.5, 3.7, 3.3, 43.0
"""Seconds to build the elastic layer, and the finite elements with `FEM_MESH` nodes a side, for a skin that
is not in the cache; the power of the nodes by which the elements grow, the factor of a layered skin, and
seconds of the elements of a round finger."""
FROM_SIDES = 2
"""Steps with views from the side, in units of those without: gravel and leather at +2 JND take 5 and 7 in the
scene `in-hand`, 3 in the studio."""
FOLDER_MIB, SAMPLE_MIB, PIXEL_MIB = 0.2, 1.7e-4, 1.6e-5
"""Size of the run's folder, MiB: of any, for each height sample, and for each pixel of each condition."""


@dataclass(frozen=True)
class Forecast:
    """Size of a run, and estimates of its time, memory and disk.

    Attributes:
        samples, rows: height samples along the width and along the height.
        places: of the finger.
        size_mm, relief_mm: width and relief of the plate.
        resolution: (rows, cols) of the pictures.
        conditions: their names.
        targets: in words.
        touch, look, verify: models that steer and verify.
        steps: about how many.
        most_steps: at most, as `descent.steps` says.
        seconds, memory_gib, disk_mib: about.
        most_seconds: with `most_steps`, about.
        building_seconds: of these seconds, to build operators that the cache does not hold yet.
        from_sides_seconds: of these seconds, for views from the side.
        free_mib: on the disk of the run's folder.
        machine_gib: memory of this machine.
    """

    samples: int
    rows: int
    places: int
    size_mm: float
    relief_mm: float
    resolution: tuple[int, int]
    conditions: tuple[str, ...]
    targets: tuple[str, ...]
    touch: str
    look: str
    verify: str
    steps: int
    most_steps: int
    seconds: float
    most_seconds: float
    building_seconds: float
    from_sides_seconds: float
    memory_gib: float
    disk_mib: float
    free_mib: float
    machine_gib: float

    def as_json(self) -> dict[str, Any]:
        """Everything by name."""
        return asdict(self)

    def lines(self) -> Iterator[tuple[str, str]]:
        """Lines of the screen: a word and a sentence each."""
        rows, cols = self.resolution
        height_mm = self.size_mm * self.rows / self.samples
        yield "texture", f"{self.samples} x {self.rows} samples"
        yield "plate", f"{self.size_mm:g} x {height_mm:g} mm, relief {number(self.relief_mm)} mm"
        if self.places > 1:
            yield "finger", f"lands at {self.places} places"
        yield "pictures", f"{', '.join(self.conditions)}; {cols} x {rows} pixels"
        yield "target", "; ".join(self.targets)
        verified = "nothing verifies" if self.verify == "none" else f"verified by {model_name(self.verify)}"
        yield "models", f"touch {model_name(self.touch)}, look {self.look}; {verified}"
        steps = f"{self.steps} step{'s' * (self.steps > 1)}"
        yield "time", f"about {duration(self.seconds)}, for about {steps} (two cores)"
        if self.most_steps > self.steps:
            most = duration(self.most_seconds)
            yield "", f"a target that is hard to reach takes up to {self.most_steps} steps, {most}"
        if self.from_sides_seconds:
            views = f"{duration(self.from_sides_seconds)} of it are for the views from the side"
            yield "", f"{views}; the scene studio has none"
        if self.building_seconds:
            built = f"{duration(self.building_seconds)} of it build the models of this finger"
            yield "", f"{built}, which are kept for later runs"
        machine = f"this machine has {number(self.machine_gib)} GiB"
        yield "memory", f"about {number(self.memory_gib, 2)} GiB; {machine}"
        yield "disk", f"about {number(self.disk_mib, 2)} MiB; {number(self.free_mib)} MiB are free"


def forecast(settings: Run, run_dir: Path, variant: str | None) -> Forecast:
    """Check the input of a run as its beginning would, and estimate its time, memory and disk.

    Args:
        settings: of the run.
        run_dir: its folder, which has been checked (`optimize.run_directory.directory.check_vacant`).
        variant: Mitsuba's.

    Raises:
        InputError: what is wrong with the input, in one line; or there is no room on the disk.
        ContactError: the contact on the original does not converge, if it is pressed to check the goals.
    """
    scene, look, maps, other = checked_scene(settings, variant)
    surface = replace(scene.surface, repeats=settings.axes_repeat)
    patches = Patches(
        surface, places(surface, settings.touch.spacing_mm), side_mm=settings.touch.finger.patch_mm
    )
    StepsSeen.of(settings, scene, look)  # For what it refuses, and its warning.
    if not known_in_reach(settings, maps):
        press_original(settings, scene.relief, maps, other)
    heights, pixels = scene.heights.size, scene.resolution[0] * scene.resolution[1]
    from_sides = scene.passes_from_sides
    overhead_steps = expected_steps(settings)
    steps = min(FROM_SIDES * overhead_steps, settings.descent.steps) if from_sides else overhead_steps
    building = _building_seconds(settings, patches.size_mm)
    pressed = patches.count - 1 + min(patches.count - 1, MOST_BETWEEN)
    presses = patches.count - 1 + _other_fingers(settings, patches.count)
    side = math.sqrt(min(heights, WINDOW))

    def seconds(steps: int, from_sides: int = from_sides) -> float:
        shown = pixels * (scene.passes - scene.passes_from_sides + from_sides)
        alone = _seconds(settings, look, steps, heights, shown, from_sides)
        verified = VERIFIED_S * pressed * patches.samples**2
        return alone + building + verified + PLACE_S * side * steps * presses

    disk = FOLDER_MIB + SAMPLE_MIB * heights + PIXEL_MIB * pixels * len(scene.conditions)
    place = next(path for path in (run_dir, *run_dir.absolute().parents) if path.exists())
    free = shutil.disk_usage(place).free / 2**20
    if free < disk:
        raise InputError(f"{run_dir}: needs about {disk:.0f} MiB, {free:.0f} MiB are free")
    return Forecast(
        samples=surface.shape[1],
        rows=surface.shape[0],
        places=patches.count,
        size_mm=scene.size_mm,
        relief_mm=float(scene.heights.max() - scene.heights.min()),
        resolution=scene.resolution,
        conditions=scene.conditions,
        targets=(
            *(f"{key} {number(value)}" for key, value in settings.touch.numbers().items()),
            *(varied.words(settings.touch.spacing_mm) for varied in maps),
            *(f"{one.label}: the feel of {other.name}" for one in settings.touch.feel_of_quantities if other),
        ),
        touch=settings.touch.model,
        look=look,
        verify=settings.verify.model,
        steps=steps,
        most_steps=settings.descent.steps,
        seconds=seconds(steps),
        most_seconds=seconds(settings.descent.steps),
        building_seconds=building,
        from_sides_seconds=seconds(steps) - seconds(overhead_steps, 0) if from_sides else 0.0,
        memory_gib=needed_gib(heights, patches.count),
        disk_mib=disk,
        free_mib=free,
        machine_gib=machine_gib(),
    )


def _other_fingers(settings: Run, places: int) -> int:
    """Number of presses of a step by other fingers: of three loads at a few places."""
    return 3 * min(MOST_PLACES, places) if settings.touch.fingers == "range" else 0


def _building_seconds(settings: Run, size_mm: float) -> float:
    """Seconds to build the operators of a run that the cache does not hold.

    Args:
        settings: of the run.
        size_mm: side of the patch under a finger.
    """
    skin, verify = settings.touch.finger, settings.verify
    # Other fingers share the operators of the steered finger.
    if skin.shape == "round":
        # The layer under it needs nothing that is kept.
        unbuilt = verify.model == "fem" and not round_pad.is_built(skin, size_mm)
        return PAD_BUILT_S if unbuilt else 0.0
    seconds = 0.0 if elastic_layer.is_built(skin, size_mm) else LAYER_BUILT_S
    if verify.model == "fem" and not finite_elements.is_built(skin, verify.resolution, size_mm):
        finer = (verify.resolution / FEM_MESH) ** NODES_POWER
        seconds += ELEMENTS_BUILT_S * finer * (LAYERED if skin.layers else 1.0)
    return seconds


def rough_seconds(settings: Run) -> float:
    """Estimated seconds of a run of 128 x 128 samples and four pictures; nothing is read."""
    look = FAST if settings.look.model == AUTO else settings.look.model
    return _seconds(settings, look, expected_steps(settings), 128**2, 4 * 128**2)


def expected_steps(settings: Run) -> int:
    """Estimated number of steps of a run, corrections among them."""
    method = METHODS[settings.descent.method]
    return method.own_steps or method.expected_steps(
        settings.descent.steps, settings.touch.numbers().get("jnd")
    )


def _seconds(settings: Run, look: str, steps: int, heights: int, rendered: int, from_sides: int = 0) -> float:
    """Estimated seconds of a run.

    Args:
        settings: of the run.
        look: model of the pictures that steers.
        steps: number of steps.
        heights: number of height samples.
        rendered: number of pixels of all pictures that show one relief.
        from_sides: number of these pictures that do not look straight down.
    """
    final = RENDERED * PIXEL_S * rendered * (settings.verify.samples or UNTIL_KNOWN)
    model = look_model(look)
    samples = settings.look.samples if model.sampled else None
    effort = Effort(steps, heights, rendered, samples, model.step_s, model.side_s, from_sides)
    return START_S + final + METHODS[settings.descent.method].seconds(effort)
