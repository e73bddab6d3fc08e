"""Comparison of two reliefs: how each feels, how far apart the two feel, and how unlike the two look."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import tactile
from mitsuba_scenes import DEFAULT_SCENE, find_file
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.runs.preparation import BLACK
from optimize.settings.skins import described_skin, load_skin
from optimize.verification import picture_metrics as metrics
from optimize.verification.converged import colour_pictures, converged
from optimize.verification.felt_places import place_spread
from optimize.verification.other_fingers import felt_by_fingers
from relief.common.arrays import Array
from relief.common.errors import InputError, naming
from relief.common.limits import EYE_DISTANCE_CM, FARTHEST_EYE_CM, NEAREST_EYE_CM
from relief.common.progress import stage
from relief.relief import Relief
from relief.seam import check_seams
from relief.surface import Repeats, axes
from retouch.pages.comparison import write_comparison
from retouch.pages.content import Comparison
from retouch.verbs.progress_display import followed
from retouch.verbs.subjects import RESULT, Subject, read_subjects
from tactile.jnd import SMOOTH
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin
from visual.noise import Batches, batched
from visual.scene import Scene, load_scene, plate_size_mm

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
    scene_file = find_file(run.scene if run is not None and own else scene or DEFAULT_SCENE, ".xml")
    known = dict(run.define) if run is not None and own else {}
    ends = axes(repeats) if repeats is not None or run is None else run.axes_repeat
    for subject in (one, other):
        check_seams(subject.read.heights, ends, subject.file)
    look = _Look(scene_file, known | dict(defines or {}), variant, samples, seed, distance_cm, ends)
    with followed(None, quiet):
        touches = []
        for subject in (one, other):
            with naming(subject.file), stage(f"pressing on {subject.name}"):
                heights, size = subject.read.heights, subject.size_mm
                touches.append(measure_touch(Relief(heights, size, ends), finger, model))
        surfaces = (replace(one.surface, repeats=ends), replace(other.surface, repeats=ends))
        fingers = felt_by_fingers(one.read.heights, other.read.heights, surfaces, finger)
        seen = look.of(one, other)
    found = _summary(one, other, touches, seen, (finger, skin_name), model, scene_file)
    found["fingers"] = fingers
    if page is not None:
        write_comparison(Path(page), _content(one, other, touches, seen, found))
        found["page"] = str(page)
    return found


@dataclass(frozen=True)
class Seen:
    """Pictures of both reliefs, or why there are none.

    Attributes:
        scene: of the first relief.
        before, after: pictures with the same random numbers.
        colours: the same pictures in linear RGB; None if the scene is grey or the grids differ.
        numbers: their change, as the section `look` of a run's result.json.
        reason: why there are no pictures; empty if there are.
    """

    scene: Scene | None = None
    before: Batches | None = None
    after: Batches | None = None
    colours: tuple[Array, Array] | None = None
    numbers: Mapping[str, Any] | None = None
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
            before, after = (
                batched(*shown, samples, self.seed) for shown in zip(scenes, heights, strict=True)
            )
        if before.mean.mean() < BLACK * scene.white:
            raise InputError(f"{self.scene}: its pictures are black; no light reaches the plate from above")
        plate = scene.plate_weights()
        numbers = metrics.look(
            before, after, scene.white, plate, scene.weights, scene.pixels_per_mm(), self.distance_cm
        )
        in_colour = scene.colour and same_grid
        colours = colour_pictures(scene, *heights, self.seed) if in_colour else None
        return Seen(scene, before, after, colours, {"conditions": list(scene.conditions)} | numbers)

    def _loaded(self, subject: Subject) -> Scene:
        relief = Relief(subject.read.heights, subject.size_mm, self.repeats, str(subject.file))
        return load_scene(self.scene, self.defines, self.variant, relief=relief)


def _summary(
    one: Subject,
    other: Subject,
    touches: list[TouchMeasures],
    seen: Seen,
    skin: tuple[Skin, str],
    model: ModelName,
    scene: Path,
) -> dict[str, Any]:
    """What `compare` returns, less the page."""
    entries = []
    for subject, touch in zip((one, other), touches, strict=True):
        heights = subject.read.heights
        entries.append(
            {
                "name": subject.name,
                "file": str(subject.file),
                "size_mm": subject.size_mm,
                "samples": heights.shape[1],
                "rows": heights.shape[0],
                "relief_mm": float(np.ptp(heights)),
                **touch.means,
                "contact_fraction": touch.contact_fraction,
            }
        )
    roughness = [touch.means[ROUGHNESS.name] for touch in touches]
    jnd = None if min(roughness) < SMOOTH else tactile.jnd_apart(roughness[1], roughness[0])
    return {
        "first": entries[0],
        "second": entries[1],
        "jnd_apart": jnd,
        "places": place_spread(*touches),
        "told_apart_probability": None if jnd is None else tactile.discrimination_probability(jnd),
        "look": seen.numbers,
        "no_look": seen.reason or None,
        "scene": None if seen.numbers is None else str(scene),
        "skin": described_skin(*skin),
        "model": model,
    }


def _content(
    one: Subject, other: Subject, touches: list[TouchMeasures], seen: Seen, found: Mapping[str, Any]
) -> Comparison:
    """The content of the page."""
    none = np.zeros((0, 1, 1))
    first, second = touches
    return Comparison(
        title=_title(one, other),
        names=(one.name, other.name),
        conditions=() if seen.scene is None else seen.scene.conditions,
        pictures_before=none if seen.before is None else seen.before.mean,
        pictures_after=none if seen.after is None else seen.after.mean,
        white=1.0 if seen.scene is None else seen.scene.white,
        strain_before=first.strain[0],
        strain_after=second.strain[0],
        heights_before=one.read.heights,
        heights_after=other.read.heights,
        size_mm=one.size_mm,
        size_after_mm=None if _alike(one.size_mm, other.size_mm) else other.size_mm,
        pressure_before=first.pressure[0],
        pressure_after=second.pressure[0],
        colours_before=None if seen.colours is None else seen.colours[0],
        colours_after=None if seen.colours is None else seen.colours[1],
        plate=None if seen.scene is None else seen.scene.plate_weights(),
        cameras=None if seen.scene is None else seen.scene.weights,
        result=found,
    )


def _alike(one_mm: float, other_mm: float) -> bool:
    return math.isclose(one_mm, other_mm, rel_tol=1e-6)


def _title(one: Subject, other: Subject) -> str:
    """The names of both files; of a run's result, the run."""
    names = [s.file.parent.name if s.file.name == RESULT else s.file.stem for s in (one, other)]
    return f"{names[1]}: original and result" if one.name == "original" else " and ".join(names)
