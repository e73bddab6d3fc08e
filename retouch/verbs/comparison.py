"""Comparison of two reliefs: how each feels, how far apart the two feel, and how unlike the two look."""

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from mitsuba_scenes import DEFAULT_SCENE, find_file
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.run_directory.finished_run import name_of
from optimize.runs.preparation import BLACK
from optimize.settings.run_file import Run
from optimize.settings.skins import described_skin, load_skin
from optimize.verification import picture_metrics as metrics
from optimize.verification.converged import colour_pictures, converged
from optimize.verification.felt_places import FeltPlaces, place_spread
from optimize.verification.other_fingers import felt_by_fingers, felt_by_measured
from optimize.verification.skin_surface import skin_bands
from optimize.verification.verification import PictureChange
from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.lengths import Lengths
from relief.ground.limits import EYE_DISTANCE_CM, FARTHEST_EYE_CM, NEAREST_EYE_CM
from relief.ground.progress import Progress, stage
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from relief.surface import Repeats
from retouch.pages.compared import Compared, ComparedSide
from retouch.pages.comparison import write_comparison
from retouch.pages.content import Comparison, Side
from retouch.verbs.progress_display import followed
from retouch.verbs.subjects import Subject, read_subjects
from tactile.jnd import discrimination_probability, jnd_unless_smooth
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin
from visual.matte import matte_scene
from visual.picture_noise import Batches, batched
from visual.scene import Scene, load_scene, plate_size_mm
from visual.scene_file.plate_fitting import film_of

SAME_WIDTH = 1e-6
"""Relative difference of the sides of two plates of one size, at most: rounding."""
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
    progress: Callable[[Progress], None] | None = None,
) -> dict[str, Any]:
    """Compare two reliefs, and write a page that shows them side by side.

    Args:
        first, second: each a height map, the name of a bundled one, or a run directory, which stands for its
            result. Without `second`, `first` is a run directory whose original is compared with its result,
            both as printed if the run has a printer.
        page: file to write; none by default.
        scene: of the pictures; by default that of the run, if one is a run, else the studio.
        defines: values of the scene's parameters.
        variant: Mitsuba's.
        model: of touch.
        skin: name of a bundled skin, or a skin file; by default that of the run, if one is a run, else the
            default skin.
        repeats: whether the reliefs are tiles, along both axes, "x" or "y"; by default as the run, if one is
            a run, else where the headers of both say so.
        samples: a pixel; by default as many as the change of the pictures needs, or 256 if the grids differ.
        seed: of the pictures; by default that of the run's own pictures, else 0.
        distance_cm: from the eye to the plate, for FLIP.
        size_mm, relief_mm, height_scale: of the height maps, as in `load_height_map`; not of runs.
        quiet, progress: as in `optimize`.

    Returns:
        What `retouch compare --json` prints.

    Raises:
        InputError: what is wrong with the input, in one line.
        ContactError: a contact does not converge.
    """
    lengths = Lengths(size_mm=size_mm, relief_mm=relief_mm, height_scale=height_scale)
    options = CompareOptions(
        scene=scene,
        defines=defines or {},
        variant=variant,
        model=model,
        skin=skin,
        samples=samples,
        seed=seed,
        distance_cm=distance_cm,
    )
    with followed(progress, quiet):
        return compared(read_subjects(first, second, lengths, repeats), options, page).as_json()


@dataclass(frozen=True, kw_only=True)
class CompareOptions:
    """How two reliefs are pressed and rendered; the attributes are arguments of `compare`.

    Raises:
        InputError: the distance of the eye is out of range.
    """

    scene: str | os.PathLike[str] | None = None
    defines: Mapping[str, str] = field(default_factory=dict)
    variant: str | None = None
    model: ModelName = "layer"
    skin: str | os.PathLike[str] | None = None
    samples: int | None = None
    seed: int | None = None
    distance_cm: float = EYE_DISTANCE_CM

    def __post_init__(self) -> None:
        if not NEAREST_EYE_CM <= self.distance_cm <= FARTHEST_EYE_CM:
            ends = f"{NEAREST_EYE_CM:g} to {FARTHEST_EYE_CM:g}"
            raise InputError(f"distance_cm: {self.distance_cm:g} is not a number from {ends}")

    def finger(self, run: Run | None) -> tuple[Skin, str]:
        """The skin and its name: the one given, that of the run, or the default one. Raises InputError."""
        if self.skin is None and run is not None:
            return run.touch.finger, run.touch.skin
        name = str(DEFAULT_SKIN if self.skin is None else self.skin)
        return load_skin(name), name

    def for_run(self, run: Run | None) -> Self:
        """The same options with scene and seed: those given, those of the run, or the studio and 0.

        Raises:
            InputError: there is no such scene.
        """
        own = run if self.scene is None else None
        scene = find_file(own.scene if own is not None else self.scene or DEFAULT_SCENE, ".xml")
        defines = {**({} if own is None else own.define), **self.defines}
        # The seed of a run's own pictures gives the numbers of its report.
        seed = 0 if run is None else run.seed + 1
        return replace(self, scene=scene, defines=defines, seed=seed if self.seed is None else self.seed)


def compared(
    subjects: tuple[Subject, Subject], options: CompareOptions, page: str | Path | None = None
) -> Compared:
    """Compare two reliefs, and write the page if it is named. Raises InputError and ContactError."""
    one, other = subjects
    run = next((subject.run for subject in subjects if subject.run is not None), None)
    (finger, skin_name), options = options.finger(run), options.for_run(run)
    scene = Path(options.scene or DEFAULT_SCENE)
    touches = []
    for subject in subjects:
        with naming(subject.file), stage(f"pressing on {subject.name}"):
            touches.append(measure_touch(subject.relief, finger, options.model))
    surface = one.relief.surface
    touch = FeltPlaces(places(surface), touches[0], touches[1])
    seen = _seen(one, other, scene, options)
    first, second = (_side(*each) for each in zip(subjects, touches, strict=True))
    jnd = jnd_unless_smooth(*(touch.means[ROUGHNESS.name] for touch in reversed(touches)))
    numbers = Compared(
        first=first,
        second=second,
        jnd_apart=jnd,
        places=place_spread(*touches),
        told_apart_probability=None if jnd is None else discrimination_probability(jnd),
        look=seen.change,
        no_look=seen.reason or None,
        scene=None if seen.change is None else str(scene),
        skin=described_skin(finger, skin_name),
        model=touches[0].model,
    )
    more: dict[str, Any] = {"fingers": felt_by_fingers(one.relief, other.relief, finger)}
    if surface == other.relief.surface:
        smooth = touch.mean_jnd is None
        more["measured"] = felt_by_measured(one.relief, other.relief, touch.places, smooth)
        if jnd is None:
            patches = Patches(surface, touch.places, side_mm=finger.patch_mm)
            more["surface_bands"] = skin_bands(touch, finger, patches.size_mm)
    numbers = numbers.model_copy(update=more)
    if page is None:
        return numbers
    write_comparison(Path(page), _content(one, other, touches, seen, numbers))
    return numbers.model_copy(update={"page": str(page)})


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


def _seen(one: Subject, other: Subject, file: Path, options: CompareOptions) -> Seen:
    """Render both reliefs under the scene's conditions. Raises InputError."""
    width_mm, seed = one.relief.width_mm, options.seed or 0
    if not _alike(one, other):
        sizes = " and ".join(f"{each.name} is {_size(each.relief)}" for each in (one, other))
        return Seen(reason=f"{sizes}; pictures are compared of plates of one size.")
    plate_mm = plate_size_mm(file, options.defines, width_mm)
    if not math.isclose(plate_mm, width_mm, rel_tol=SAME_WIDTH):
        fault = f"the plate of {file.name} is {plate_mm:g} mm wide, the reliefs are"
        return Seen(reason=f"{fault} {width_mm:g} mm; --scene names another scene.")
    # Pictures of one film: that of the finer grid.
    finest = max(one.relief.heights.shape, other.relief.heights.shape)
    film = film_of(file, options.defines, finest, width_mm)
    scene = _loaded(one, file, film, options)
    heights = (one.relief.heights, other.relief.heights)
    same_grid = heights[0].shape == heights[1].shape
    if same_grid and options.samples is None:
        before, after = converged(scene, *heights, metrics.known(scene), seed)
    else:
        scenes = (scene, scene if same_grid else _loaded(other, file, film, options))
        samples = options.samples or SAMPLES
        before, after = (
            batched(each, scene.levelled(relief), samples, seed)
            for each, relief in zip(scenes, heights, strict=True)
        )
    if before.mean.mean() < BLACK * scene.white:
        raise InputError(f"{file}: its pictures are black; no light reaches the plate from above")
    change = metrics.look(before, after, scene, options.distance_cm)
    in_colour = scene.colour and same_grid
    colours = colour_pictures(scene, *heights, seed) if in_colour else None
    change = change.model_copy(update={"conditions": tuple(scene.conditions)})
    return Seen(scene, (before, after), colours, change)


def _loaded(subject: Subject, file: Path, film: Mapping[str, str], options: CompareOptions) -> Scene:
    return load_scene(file, {**options.defines, **film}, options.variant, relief=subject.relief)


def _side(subject: Subject, touch: TouchMeasures) -> ComparedSide:
    rows, samples = subject.relief.heights.shape
    return ComparedSide(
        name=subject.name,
        file=str(subject.file),
        size_mm=subject.relief.width_mm,
        samples=samples,
        rows=rows,
        relief_mm=float(np.ptp(subject.relief.heights)),
        printer=subject.printer,
        values=touch.means,
        contact_fraction=touch.contact_fraction,
    )


def _content(
    one: Subject, other: Subject, touches: Sequence[TouchMeasures], seen: Seen, numbers: Compared
) -> Comparison:
    """The content of the page."""
    # Sizes that agree but for rounding are one.
    relief = replace(other.relief, width_mm=one.relief.width_mm) if _alike(one, other) else other.relief
    pictures, colours, scene = seen.pictures or (None, None), seen.colours or (None, None), seen.scene
    return Comparison(
        title=_title(one, other),
        before=Side.of(one.name, one.relief, touches[0], pictures[0], colours[0]),
        after=Side.of(other.name, relief, touches[1], pictures[1], colours[1]),
        conditions=() if scene is None else scene.conditions,
        white=1.0 if scene is None else scene.white,
        plate=None if scene is None else scene.plate_weights(),
        cameras=None if scene is None else scene.weights,
        matte=None if scene is None else matte_scene(scene),
        numbers=numbers,
    )


def _alike(one: Subject, other: Subject) -> bool:
    """Whether the plates are of one size."""
    sizes = (each.relief.surface.size_mm for each in (one, other))
    return all(math.isclose(*sides, rel_tol=SAME_WIDTH) for sides in zip(*sizes, strict=True))


def _size(relief: Relief) -> str:
    """Width and depth of the plate."""
    surface = relief.surface
    return f"{surface.width_mm:g} x {surface.height_mm:g} mm"


def _title(one: Subject, other: Subject) -> str:
    """The names of both files; of a run's result, the run."""
    names = [name_of(subject.file) for subject in (one, other)]
    return f"{names[1]}: original and result" if one.name == "original" else " and ".join(names)
