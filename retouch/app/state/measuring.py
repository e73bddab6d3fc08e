"""What the app's worker process computes: heights, how they feel, and how far the feel can change.

Every function takes and returns plain values, which go through a pipe. torch and the models load in the
worker, so that the page is up before them and an error of theirs leaves the page alive.
"""

import io
import logging
import multiprocessing
import os
import signal
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

import retouch
from mitsuba_scenes import DEFAULT_SCENE
from optimize.settings.fast_models import FAST_MODELS
from relief.common.arrays import Array, FloatArray, Index
from relief.common.errors import InputError
from relief.common.files import write_atomically
from relief.common.limits import LARGEST_SIDE, PATCH_SIDE_MM
from relief.common.progress import Progress, progress
from relief.places import places
from relief.relief import Relief
from retouch.app.state.document import USUAL_RELIEF_MM, Feel, Part, Picture
from retouch.app.state.folders import RUNS_FOLDER, picture_file
from retouch.pages.colour_maps import PURPLE_ORANGE, VIRIDIS, Table, bar_uri, map_uri
from tactile.quantities import LIMIT_PERCENT

if TYPE_CHECKING:
    from tactile.model import ModelName

MODEL: "ModelName" = "quick"
"""Model of touch of the numbers that follow the hand: within 1 % of the exact one (docs/learned.md), and on
16 places of 128 x 128 samples in 0.8 s in place of 2.3 s."""
OWN_PACKAGES = ("relief", "tactile", "visual", "optimize", "retouch", "mitsuba_scenes")
"""Packages whose warnings are for the person."""
MAP_SIDE = 512
"""Most pixels a side of a map."""
MOST_JND, COSTS = 6.0, 49
"""Ends of the slider of the feel, JND, and numbers of costs between them."""
TOLD_EVERY_S = 0.25
"""Least time between two lines about what is under way, s."""
THUMBNAIL = 720
"""Longer side of the picture that is shown for cropping, pixels."""


@dataclass(frozen=True)
class Source:
    """A picture as it was found.

    Attributes:
        width, height: pixels.
        relief_mm, size_mm: of its header; the usual ones where there is none.
        tile: whether the header says that the picture repeats.
        notes: what the picture is, in words.
        thumbnail: PNG.
    """

    width: int
    height: int
    relief_mm: float
    size_mm: float
    tile: bool
    notes: str
    thumbnail: bytes


@dataclass(frozen=True, eq=False)
class Shape:
    """Heights and what was done to get them.

    Attributes:
        heights: (rows, cols) mm, float32.
        size_mm: width.
        repeats: along y and x.
        lines: what was done, a subject and a sentence each.
        square: x, y and side of the part of the picture that was taken, pixels.
    """

    heights: FloatArray
    size_mm: float
    repeats: tuple[bool, bool]
    lines: tuple[tuple[str, str], ...] = ()
    square: tuple[int, int, int] = (0, 0, 0)

    @property
    def relief_mm(self) -> float:
        """Highest above lowest point, mm."""
        return float(np.ptp(self.heights))


@dataclass(frozen=True)
class FeltPlaces:
    """How a relief feels at some places of the finger.

    Attributes:
        roughness: V of each, no unit.
        contact_area_mm2: of each.
        contact_fraction: share of the patch in contact at each.
    """

    roughness: tuple[float, ...] = ()
    contact_area_mm2: tuple[float, ...] = ()
    contact_fraction: tuple[float, ...] = ()

    def __add__(self, other: Self) -> Self:
        """Both together."""
        return type(self)(
            self.roughness + other.roughness,
            self.contact_area_mm2 + other.contact_area_mm2,
            self.contact_fraction + other.contact_fraction,
        )


@dataclass(frozen=True)
class Reachable:
    """How far the feel can change, and what it costs the look.

    Attributes:
        smoother, rougher: JND at which the pictures visibly change, both positive.
        limit_percent: change of the pictures from which it is visible, mean in % of white.
        costs: JND and change of the pictures, mean in % of white.
    """

    smoother: float
    rougher: float
    limit_percent: float
    costs: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Map:
    """A map in colours.

    Attributes:
        picture: data URI of a PNG.
        bar: the same of the colours from low to high.
        low, high: in `unit`.
    """

    picture: str
    bar: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True, eq=False)
class Sides:
    """Original and result of a run.

    Attributes:
        change: heights of the result less those of the original, each about its mean; None for two grids.
        feel: strain under a finger, of both.
    """

    before: Shape
    after: Shape
    change: Map | None
    feel: tuple[Map, Map]


@dataclass(frozen=True)
class Written:
    """A file for a printer.

    Attributes:
        lines: what it holds, a word and a sentence each.
    """

    file: str
    lines: tuple[tuple[str, str], ...]


def start(told: Connection) -> None:
    """Prepare the worker.

    Args:
        told: takes lines about what is under way, an empty one where nothing is.
    """
    # The terminal's Ctrl-C is for the app, which ends its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Left by no one: the process listens to its own work as long as it lives.
    _open.enter_context(progress(_Teller(told)))


def _end_with_parent() -> None:
    """End this process when the app does, however that ends: nobody would hear the results."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(0)


_open = ExitStack()


class _Teller:
    """Sends what is under way, the outermost stage first, a few times a second."""

    def __init__(self, told: Connection) -> None:
        self._told, self._stages, self._next = told, list[Progress](), 0.0

    def __call__(self, now: Progress) -> None:
        self._stages = self._stages[: now.level] + ([] if now.ended else [now])
        if time.monotonic() >= self._next or not self._stages:
            self._next = time.monotonic() + TOLD_EVERY_S
            self._told.send(": ".join(map(_sentence, self._stages)))


def _sentence(stage: Progress) -> str:
    if stage.at_most and stage.total is not None and stage.done:
        return f"{stage.stage}, {stage.done:g} of at most {stage.total:g}"
    return f"{stage.stage}, {100.0 * stage.fraction:.0f} %" if stage.fraction else stage.stage


def warm(file: str) -> None:
    """Load what heights need, and keep the picture's file open, before anybody asks for them."""
    shape(Picture(file, relief_mm=source(file).relief_mm))


def source(file: str) -> Source:
    """Open a picture. Raises InputError."""
    picture = _opened(file)
    from relief.preparing.preview import small_picture  # Here, as only pictures need it.

    longest = min(THUMBNAIL, max(picture.width, picture.height))
    thumbnail = io.BytesIO()
    small_picture(picture, longest).save(thumbnail, "png")
    bits = "" if picture.bits is None else f", {picture.bits} bits"
    notes = f"{picture.width} × {picture.height} pixels, {picture.kind}{bits}"
    lengths = picture.lengths
    relief_mm = lengths.get("relief_mm", USUAL_RELIEF_MM)
    if picture.bits is None and "relief_mm" not in lengths:
        # Numbers without a header are mm, or else far too high.
        span = float(np.ptp(picture.values((0, 0, picture.width, picture.height), "luminance")))
        relief_mm = span if 0.01 <= span <= 20.0 else USUAL_RELIEF_MM
    return Source(
        picture.width,
        picture.height,
        relief_mm,
        lengths.get("size_mm", PATCH_SIDE_MM),
        picture.tile,
        notes,
        thumbnail.getvalue(),
    )


@lru_cache(maxsize=2)
def _opened(file: str) -> Any:
    from relief.preparing.pictures import open_picture

    return open_picture(picture_file(file))


@lru_cache(maxsize=8)
def _prepared(picture: Picture) -> Any:
    return retouch.prepare(picture_file(picture.file), **picture.arguments())


def shape(picture: Picture) -> Shape:
    """The heights of a picture. Raises InputError."""
    # Heights grow with the relief, so that one preparation does for every position of its slider.
    relief_mm = picture.relief_mm or USUAL_RELIEF_MM
    prepared = _prepared(replace(picture, relief_mm=1.0))
    lines = {**prepared.done, "relief": f"{relief_mm:.3g} mm"}
    left, upper, right, _ = prepared.square
    tile = prepared.repeats
    return Shape(
        (relief_mm * prepared.heights).astype(np.float32),
        prepared.size_mm or PATCH_SIDE_MM,
        (tile, tile),
        tuple(lines.items()),
        (left, upper, right - left),
    )


def _of_relief(relief: Relief) -> Shape:
    return Shape(relief.heights.astype(np.float32), relief.width_mm, relief.repeats)


def save(picture: Picture, out: str) -> None:
    """Write the height map of a picture, as `retouch prepare` would. Raises InputError or OSError."""
    retouch.prepare(picture_file(picture.file), **picture.arguments()).save(out)


def count_places(shape: Shape) -> int:
    """Number of places of the finger on heights."""
    return len(places(_relief(shape).surface))


def felt(shape: Shape, skin: str, part: slice | None = None) -> FeltPlaces:
    """How heights feel at a part of the places of the finger; None: at the place nearest to the middle.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    relief = _relief(shape)
    touch = _touch(relief, skin, _middle(relief) if part is None else places(relief.surface)[part])
    roughness, area = (tuple(map(float, touch.values[name])) for name in ("roughness", "contact_area_mm2"))
    return FeltPlaces(roughness, area, (touch.contact_fraction,) * len(roughness))


def texture_roughness(name: str, skin: str) -> float:
    """Roughness of a texture that comes with Retouch, at one place."""
    relief = Relief.read(picture_file(name))
    return float(_touch(relief, skin, _middle(relief)).means["roughness"])


def reach(shape: Shape, skin: str) -> Reachable:
    """How far the feel can change before the pictures do, as `retouch evaluate --reach` tells."""
    from optimize.estimates.reach import reach as reach_of

    scene = retouch.load_scene(DEFAULT_SCENE, relief=_relief(shape))
    found = reach_of(scene, retouch.load_skin(skin))
    ends = MOST_JND * np.linspace(-1.0, 1.0, COSTS)
    costs = tuple((float(jnd), found.change_percent(jnd)) for jnd in ends)
    return Reachable(found.smoother.jnd, found.rougher.jnd, LIMIT_PERCENT, costs)


def forecast(heights: str, feel: Feel, out: str) -> list[tuple[str, str]]:
    """What `retouch optimize --dry-run` tells of a run: a word and a sentence each, and its warnings.

    Raises:
        InputError: what is wrong, in a line.
    """
    warnings = _Warnings()
    logging.getLogger().addHandler(warnings)
    try:
        shared = FAST_MODELS if feel.fast else ()
        run = retouch.run_from_scene(DEFAULT_SCENE, heights, feel.overrides(), shared=shared)
        run.check_texture()
        lines = list(retouch.forecast(run, out).lines())
    finally:
        logging.getLogger().removeHandler(warnings)
    return [*lines, *(("warning", line) for line in warnings.lines)]


class _Warnings(logging.Handler):
    """Keeps the warnings of the packages."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if record.name.partition(".")[0] in OWN_PACKAGES:
            self.lines.append(record.getMessage())


def sides(folder: str, skin: str) -> Sides:
    """Original and result of a run, with the maps of what differs. Raises InputError or ContactError."""
    from retouch.verbs.subjects import read_subjects

    none = dict.fromkeys(("size_mm", "relief_mm", "height_scale"))
    reliefs = [subject.relief for subject in read_subjects(folder, None, none, None)]
    one, other = (relief.heights - relief.heights.mean() for relief in reliefs)
    change = None
    if one.shape == other.shape:
        difference = 1000.0 * (other - one)
        most = max(float(np.percentile(np.abs(difference), 99.5)), 1e-3)
        change = _map(difference, -most, most, PURPLE_ORANGE, "µm")
    strains = [np.abs(_touch(relief, skin, _middle(relief)).strain[0]) for relief in reliefs]
    most = max(float(np.percentile(np.stack(strains), 99.5)), 1e-6)
    before, after = (_map(strain, 0.0, most, VIRIDIS, "strain") for strain in strains)
    return Sides(_of_relief(reliefs[0]), _of_relief(reliefs[1]), change, (before, after))


def _map(values: Array, low: float, high: float, table: Table, unit: str) -> Map:
    return Map(map_uri(values, low, high, table, MAP_SIDE), bar_uri(table), low, high, unit)


def best_so_far(folder: str, heights: str) -> tuple[Shape, Shape]:
    """Original and best relief of a run under way, of its checkpoint. Raises InputError."""
    from optimize.run_directory.checkpoint import load_checkpoint

    original = _of_relief(Relief.read(heights))
    best = load_checkpoint(Path(folder)).best.heights
    return original, replace(original, heights=best.astype(np.float32))


def save_mask(content: bytes, out: str) -> bool:
    """Write a painted mask as a black and white PNG; returns whether anything is painted.

    Raises:
        InputError: the content is no picture of a mask.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as image:
            if max(image.size) > LARGEST_SIDE:
                raise InputError(f"mask: {image.size[0]} x {image.size[1]} pixels are too many")
            white = np.asarray(image.convert("L")) > 127
    except (OSError, ValueError, SyntaxError) as error:
        raise InputError(f"mask: {error}") from error
    if not white.any():
        return False
    picture = io.BytesIO()
    Image.fromarray(np.where(white, 255, 0).astype(np.uint8)).save(picture, "png")
    write_atomically(out, picture.getvalue())
    return True


def export(run: str, out: str, base_mm: float | None, repeat: int, printer: str | None) -> Written:
    """Write the result of a run for a printer, as `retouch export`. Raises InputError or OSError."""
    made = retouch.export(run, out, base_mm=base_mm, repeat=(repeat, repeat), printer=printer)
    lines = [("file", str(made.file)), ("size", f"{made.width_mm:.4g} × {made.height_mm:.4g} mm")]
    if made.thickness_mm is not None:
        lines.append(("highest point", f"{made.thickness_mm:.3g} mm"))
    if made.printer is not None and made.thickness_mm is not None:
        layers = round(made.thickness_mm / made.printer.layer_mm)
        lines.append(("layers", f"{layers} of {made.printer.layer_um:g} µm"))
    lines.append(("bytes", f"{made.file.stat().st_size / 2**20:.1f} MiB"))
    return Written(str(made.file), tuple(lines))


def preview_object(run: str, part: Part, page: str) -> tuple[tuple[str, str], ...]:
    """Write a page that shows the result of a run on an object. Raises InputError."""
    made = retouch.preview_wrap(run, part.mesh, page, **part.options()).as_json()
    sides = " × ".join(f"{side:.3g}" for side in made["size_mm"])
    return (
        ("size", f"{sides} mm"),
        ("triangles", f"about {made['faces']:,} in the file, {made['shown_faces']:,} shown"),
        ("time", f"about {made['seconds']:.0f} s"),
        *(("warning", line) for line in made["warnings"]),
    )


def wrap_object(run: str, part: Part, out: str) -> Written:
    """Lay the result of a run over an object, and write the solid. Raises InputError or OSError."""
    made = retouch.wrap(run, part.mesh, out, **part.options()).as_json()
    sides = " × ".join(f"{side:.3g}" for side in made["size_mm"])
    lines = [("file", made["file"]), ("size", f"{sides} mm"), ("triangles", f"{made['faces']:,}")]
    lines += [("bytes", f"{made['bytes'] / 2**20:.1f} MiB")]
    return Written(made["file"], (*lines, *(("warning", line) for line in made["warnings"])))


def feel_object(file: str, mesh: str, skin: str) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Write a page that shows the roughness of a wrapped object in colours; returns the page and its lines.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    felt = retouch.evaluate(file, without_texture=mesh, skin=skin, model=MODEL, colours=RUNS_FOLDER)
    page = next(str(one) for one in felt.files if one.suffix == ".html")
    places = f"mean over {felt.places.count} places"
    return page, (("roughness V", f"{felt.roughness:.4f}, {places}"),)


def _relief(shape: Shape) -> Relief:
    return Relief(shape.heights.astype(np.float64), shape.size_mm, shape.repeats)


def _middle(relief: Relief) -> Index:
    """(1, 2) the place nearest to the middle of the relief."""
    each = places(relief.surface)
    return each[len(each) // 2][None]


def _touch(relief: Relief, skin: str, at: Index | None) -> Any:
    from tactile.measures import measure_touch

    if not np.isfinite(relief.heights).all():
        raise InputError("heights: not every value is finite")
    return measure_touch(relief, retouch.load_skin(skin), MODEL, at=at)
