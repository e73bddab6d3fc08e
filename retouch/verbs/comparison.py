"""Comparison of two reliefs: how each feels, how far apart the two feel, and how unlike the two look."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_scenes import find_file
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.runs.preparation import BLACK
from optimize.settings.skins import described_skin, load_skin
from optimize.verification import picture_metrics as metrics
from optimize.verification.converged import colour_pictures, converged
from optimize.verification.felt_places import place_spread
from optimize.verification.other_fingers import felt_by_fingers
from optimize.verification.verification import Fingers, PictureChange
from relief.common.arrays import Array
from relief.common.errors import InputError, naming
from relief.common.limits import EYE_DISTANCE_CM, FARTHEST_EYE_CM, NEAREST_EYE_CM
from relief.common.progress import stage
from relief.relief import Relief
from relief.seam import check_seams
from relief.surface import Repeats, axes
from retouch.pages.comparison import write_comparison
from retouch.pages.content import Compared, ComparedSide, Comparison, sides
from retouch.verbs.progress_display import followed
from retouch.verbs.subjects import RESULT, Subject, read_subjects
from tactile.jnd import discrimination_probability, jnd_unless_smooth
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from visual.noise import Batches, batched
from visual.scene import Scene, load_scene, plate_size_mm

SCENE = "studio"
"""Scene of the pictures where neither the caller nor a run names one."""
SAMPLES = 256
"""Samples a pixel where none are given and the grids differ: the most that a run takes for its pictures."""


def compare(
    first: str | Path,
    second: str | Path | None = None,
    page: str | Path | None = None,
    *,
    scene: str | Path | None = None,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    model: ModelName = "layer",
    skin: str | Path | None = None,
    repeats: Repeats | None = None,
    samples: int | None = None,
    seed: int | None = None,
    distance_cm: float = EYE_DISTANCE_CM,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    quiet: bool | None = None,
) -> dict[str, Any]:
    """Compare two reliefs, and write a page that shows them side by side.

    Args:
        first, second: each a height map, the name of a bundled one, or a run directory, which stands for its
            result. Without `second`, `first` is a run directory whose original is compared with its result.
        page: file to write; none by default.
        scene: of the pictures; by default that of the run, if one is a run, else the studio.
        defines: values of the scene's parameters.
        variant: Mitsuba's.
        model: of touch.
        skin: name of a bundled skin, or a skin file; by default that of the run, if one is a run, else the
            default skin.
        repeats: whether the reliefs are tiles, along both axes, "x" or "y"; by default as the run, if one is.
        samples: a pixel; by default as many as the change of the pictures needs, or 256 if the grids differ.
        seed: of the pictures; by default that of the run's own pictures, else 0.
        distance_cm: from the eye to the plate, for FLIP.
        size_mm, relief_mm, height_scale: of the height maps, as in `load_height_map`; not of runs.
        quiet: as in `optimize.runs.job.run`.

    Returns:
        What `retouch compare --json` prints; docs/python.md says what each key means.

    Raises:
        InputError: what is wrong with the input, in one line.
        ContactError: a contact does not converge.
    """
    if not NEAREST_EYE_CM <= distance_cm <= FARTHEST_EYE_CM:
        raise InputError(
            f"distance_cm: {distance_cm:g} is not a number from {NEAREST_EYE_CM:g} to {FARTHEST_EYE_CM:g}"
        )
    lengths = {"size_mm": size_mm, "relief_mm": relief_mm, "height_scale": height_scale}
    one, other = read_subjects(first, second, lengths)
    run = one.run or other.run
    if skin is not None or run is None:
        skin_name = str(skin or DEFAULT_SKIN)
        finger = load_skin(skin_name)
    else:
        finger, skin_name = run.touch.finger, run.touch.skin
    if seed is None:
        # The seed of a run's own pictures, so that the numbers are those of its report.
        seed = 0 if run is None else run.seed + 1
    own = run is not None and scene is None
    scene_file = find_file(run.scene if run is not None and own else scene or SCENE, ".xml")
    own_defines = dict(run.define) if run is not None and own else {}
    ends = axes(repeats) if repeats is not None or run is None else run.axes_repeat
    for subject in (one, other):
        check_seams(subject.read.heights, ends, subject.file)
    look = _Look(scene_file, own_defines | dict(defines or {}), variant, samples, seed, distance_cm, ends)
    with followed(None, quiet):
        touches = []
        for subject in (one, other):
            with naming(subject.file), stage(f"pressing on {subject.name}"):
                heights, size = subject.read.heights, subject.size_mm
                touches.append(measure_touch(Relief(heights, size, ends), finger, model))
        surfaces = (replace(one.surface, repeats=ends), replace(other.surface, repeats=ends))
        fingers = felt_by_fingers(one.read.heights, other.read.heights, surfaces, finger)
        seen = look.of(one, other)
    numbers = _numbers((one, other), touches, seen, fingers, described_skin(finger, skin_name), scene_file)
    if page is not None:
        write_comparison(Path(page), _content(one, other, touches, seen, numbers))
        numbers = numbers.model_copy(update={"page": str(page)})
    return numbers.as_json()


@dataclass(frozen=True)
class Seen:
    """Pictures of both reliefs, or why there are none.

    Attributes:
        scene: of the first relief.
        pictures: of both, with the same random numbers.
        colours: the same pictures in linear RGB; None if the scene is grey or the grids differ.
        change: of the pictures.
        reason: why there are no pictures; empty if there are.
    """

    scene: Scene | None = None
    pictures: tuple[Batches, Batches] | None = None
    colours: tuple[Array, Array] | None = None
    change: PictureChange | None = None
    reason: str = ""


@dataclass(frozen=True)
class _Look:
    """How the pictures are made; the fields are those of `compare`."""

    scene: Path
    defines: Mapping[str, str]
    variant: str | None
    samples: int | None
    seed: int
    distance_cm: float
    repeats: tuple[bool, bool]

    def of(self, one: Subject, other: Subject) -> Seen:
        """Render both reliefs under the scene's conditions. Raises InputError."""
        if not _alike(one.size_mm, other.size_mm):
            sizes = f"{one.name} is {one.size_mm:g} mm wide and {other.name} {other.size_mm:g} mm"
            return Seen(reason=f"{sizes}; pictures are compared of plates of one size.")
        plate_mm = plate_size_mm(self.scene, self.defines, one.size_mm)
        if not _alike(plate_mm, one.size_mm):
            fault = f"the plate of {self.scene.name} is {plate_mm:g} mm wide, the reliefs are"
            return Seen(reason=f"{fault} {one.size_mm:g} mm; --scene names another scene.")
        scene = self._loaded(one)
        heights = (one.read.heights, other.read.heights)
        same_grid = heights[0].shape == heights[1].shape
        if same_grid and self.samples is None:
            before, after = converged(scene, *heights, metrics.known(scene), self.seed)
        else:
            scenes = (scene, scene if same_grid else self._loaded(other))
            samples = self.samples or SAMPLES
            before, after = (batched(*each, samples, self.seed) for each in zip(scenes, heights, strict=True))
        if before.mean.mean() < BLACK * scene.white:
            raise InputError(f"{self.scene}: its pictures are black; no light reaches the plate from above")
        plate = scene.plate_weights()
        change = metrics.look(
            before, after, scene.white, plate, scene.weights, scene.pixels_per_mm(), self.distance_cm
        )
        in_colour = scene.colour and same_grid
        colours = colour_pictures(scene, *heights, self.seed) if in_colour else None
        change = change.model_copy(update={"conditions": tuple(scene.conditions)})
        return Seen(scene, (before, after), colours, change)

    def _loaded(self, subject: Subject) -> Scene:
        relief = Relief(subject.read.heights, subject.size_mm, self.repeats, str(subject.file))
        return load_scene(self.scene, self.defines, self.variant, relief=relief)


def _numbers(
    subjects: tuple[Subject, Subject],
    touches: Sequence[TouchMeasures],
    seen: Seen,
    fingers: Fingers | None,
    skin: Mapping[str, Any],
    scene: Path,
) -> Compared:
    """The numbers of both reliefs and of what differs between them."""
    first, second = (_side(*each) for each in zip(subjects, touches, strict=True))
    one, other = (touch.means[ROUGHNESS.name] for touch in touches)
    jnd = jnd_unless_smooth(other, one)
    return Compared(
        first=first,
        second=second,
        jnd_apart=jnd,
        places=place_spread(*touches),
        told_apart_probability=None if jnd is None else discrimination_probability(jnd),
        look=seen.change,
        no_look=seen.reason or None,
        scene=None if seen.change is None else str(scene),
        skin=skin,
        model=touches[0].model,
        fingers=fingers,
    )


def _side(subject: Subject, touch: TouchMeasures) -> ComparedSide:
    heights = subject.read.heights
    return ComparedSide(
        name=subject.name,
        file=str(subject.file),
        size_mm=subject.size_mm,
        samples=heights.shape[1],
        rows=heights.shape[0],
        relief_mm=float(np.ptp(heights)),
        values=touch.means,
        contact_fraction=touch.contact_fraction,
    )


def _content(
    one: Subject, other: Subject, touches: Sequence[TouchMeasures], seen: Seen, numbers: Compared
) -> Comparison:
    """The content of the page."""
    # Sizes that agree but for rounding are one.
    size_after_mm = one.size_mm if _alike(one.size_mm, other.size_mm) else other.size_mm
    before, after = sides(
        (one.name, other.name),
        (one.read.heights, other.read.heights),
        (one.size_mm, size_after_mm),
        (touches[0], touches[1]),
        seen.pictures,
        seen.colours,
    )
    scene = seen.scene
    return Comparison(
        title=_title(one, other),
        before=before,
        after=after,
        conditions=() if scene is None else scene.conditions,
        white=1.0 if scene is None else scene.white,
        plate=None if scene is None else scene.plate_weights(),
        cameras=None if scene is None else scene.weights,
        numbers=numbers,
    )


def _alike(one_mm: float, other_mm: float) -> bool:
    return math.isclose(one_mm, other_mm, rel_tol=1e-6)


def _title(one: Subject, other: Subject) -> str:
    """The names of both files; of a run's result, the run."""
    names = [s.file.parent.name if s.file.name == RESULT else s.file.stem for s in (one, other)]
    return f"{names[1]}: original and result" if one.name == "original" else " and ".join(names)
