"""Height maps as files: pictures whose grey value is height, and files that hold mm."""

import errno
import logging
import math
import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relief.corrections import filled, levelled, plane
from relief.ground import limits
from relief.ground.arrays import Array
from relief.ground.errors import InputError, PictureError, naming, option_error
from relief.ground.files import partial_file
from relief.ground.formats import GRIDS, HEIGHT_MAPS, HEIGHTS, MEASURED, PICTURES
from relief.ground.lengths import Lengths, header_of, within
from relief.ground.progress import say
from relief.reading.data_colours import no_heights
from relief.reading.pictures import read_picture
from relief.reading.profilometers import is_measured
from relief.reading.readers import by_content, read_samples
from relief.reading.samples import LAYER, TILE, TILE_MARKS, Check, Samples
from relief.reading.terraces import terraces
from relief.reading.tiff import holds_numbers, read_tiff
from relief.seam import misfit
from relief.surface import Repeats, axes

_log = logging.getLogger(__name__)
_PHOTOGRAPHS = ("JPEG", "WebP", "BMP", "GIF", "PGM")
"""First words of the kinds of files that hold pictures, but no height maps."""

LARGEST_FIELD_SIDE = 8192
"""Most samples a side of a picture that textures are cut from."""
LEAST_FELT_MM = 1e-3
"""Height, mm, of the least relief that anybody feels: moving fingers notice a step of 0.85 µm (Johansson and
LaMotte 1983). Natural reliefs are 0.05 to 3 mm high."""
LIKELIER = (1.0, 1e3, 1e-3, 1e-6)
"""Factors of heights that are mm, or were taken for mm and are metres, micrometres or nanometres."""
NAMES = {
    "1000": ("metres", " (--units m)"),
    "1": ("millimetres", " (--units mm)"),
    "0.001": ("micrometres", " (--units um)"),
    "1e-06": ("nanometres", ""),
}
"""Names of units of length, and the options that state them, by their mm."""
TOLERANCE_MM = 1e-6
"""Rounding, mm: heights this far below 0, above 3 or above 20 mm are clipped; nothing else is."""


@dataclass(frozen=True)
class HeightMap:
    """A height map that was read from a file.

    Attributes:
        heights: (rows, cols), row 0 at +y, in mm within [0, 20].
        size_mm: Side of the plate, mm; None if unknown.
        repeats: Axes along which the header says that the relief repeats; `fitting_repeats` checks the sides.
    """

    heights: Array
    size_mm: float | None
    repeats: Repeats = False

    @property
    def side_mm(self) -> float:
        """Side of the plate, mm, the usual one if unknown."""
        return limits.PATCH_SIDE_MM if self.size_mm is None else self.size_mm


def load_height_map(
    path: str | os.PathLike[str],
    *,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    fill: bool = False,
    level: bool = False,
    default_relief_mm: float | None = None,
    repeats: Repeats | None = None,
) -> HeightMap:
    """Read a height map with the size of its plate.

    There are two kinds of files. Pictures, which are PNG and TIFF of whole numbers, hold grey: black is 0 mm,
    white is ``relief_mm``, and grey lies between in proportion; gamma and colour profiles are ignored.
    EXR, NPY and TIFF of floating-point numbers hold mm, or another unit that ``height_scale`` turns into mm.
    A surface that an instrument measured has its own unit and size, and its lowest height becomes 0.
    Neither number has a meaning for files of the other kind. An argument overrides the file's header; a
    warning is logged if both differ.

    Args:
        path: PNG, TIFF, EXR or NPY with one channel; more channels only if all colours agree. Of an EXR
            file's channels, Y or Z is preferred.
        size_mm: Side of the plate, mm; None takes the number in the file's header.
        relief_mm: Height of white above black, mm; None takes the number in the file's header.
        height_scale: mm for a height of 1.0 in a file that holds heights; None is 1.
        fill: fill samples that were not measured from around; they are refused otherwise.
        level: take out the tilt, then lift the lowest to 0.
        default_relief_mm: Height of white above black, mm, for a picture whose header has none.
        repeats: axes along which holes go on and nothing is tilted; None takes those of the file's header.

    Raises:
        InputError: The file is missing, damaged, smaller than 16 or larger than 4096 samples a side, has
            holes, or holds heights that are not finite or out of range; or a number is out of `RANGES`.
    """
    path = Path(path)
    with naming(path):
        size_mm, height_scale = within("size_mm", size_mm), within("height_scale", height_scale)
        relief_mm, default_relief_mm = (within("relief_mm", mm) for mm in (relief_mm, default_relief_mm))
    content = _read(path, _check_shape, relief_mm)
    unit = unit_mm(content, relief_mm, height_scale, default_relief_mm)
    width_mm = given_or_stored(content, "size_mm", size_mm)
    if content.instrument:
        required("size_mm", width_mm, "the width of the surface in mm, which the file does not say", path)
    with np.errstate(over="ignore", invalid="ignore"):
        heights = content.values * unit
    if content.instrument:
        heights -= np.nanmin(heights)
    ends = axes(content.repeats if repeats is None else repeats)
    # A header's repeat that does not fit holds for a plate, as `fitting_repeats` reports.
    ends = ends if repeats is not None or misfit(heights, ends) is None else (False, False)
    stated = content.unit_mm is not None and height_scale is None
    corrected = _corrected(path, heights, ends, fill, level)
    checked = _in_range(path, corrected, content.holds_numbers, unit, stated)
    # A print is meant to have its printer's steps.
    if not content.printed and (warning := terraces(checked)) is not None:
        _warn_once(f"{path}: {warning}")
    kind = "heights times" if content.holds_numbers else "a picture, white is"
    _log.info("%s: %d x %d samples read, %s %g mm", path, *checked.shape, kind, unit)
    return HeightMap(checked, width_mm, content.repeats)


def unit_mm(
    content: Samples,
    relief_mm: float | None,
    height_scale: float | None,
    default_relief_mm: float | None = None,
) -> float:
    """Mm for white of a picture, or for a number of 1: as given, as the file states, or as is usual.

    Args:
        content: of a file.
        relief_mm, height_scale, default_relief_mm: as of `load_height_map`.

    Raises:
        InputError: nobody states the height of a picture, or the unit of an instrument.
    """
    if not content.holds_numbers:
        white = given_or_stored(content, "relief_mm", relief_mm)
        white = default_relief_mm if white is None else white
        return required(
            "relief_mm", white, "a picture needs the height of white above black in mm", content.path
        )
    unit = content.unit_mm if height_scale is None else height_scale
    if content.instrument:
        return required(
            "height_scale", unit, "mm for a height of 1, which the file does not say", content.path
        )
    return unit or 1.0


def required(name: str, value: float | None, what: str, path: Path) -> float:
    """A value that a file needs. Raises InputError if neither an argument nor the file has it."""
    if value is None:
        raise option_error(name, f"missing; {what}", path)
    return value


def _corrected(path: Path, heights: Array, repeats: tuple[bool, bool], fill: bool, level: bool) -> Array:
    """Heights without holes, and level if wanted. Raises InputError."""
    if missing := np.count_nonzero(np.isnan(heights)):
        percent = f"{100.0 * missing / heights.size:.3g} %"
        fault = f"{path}: {missing} of {heights.size} samples were not measured ({percent})"
        if missing == heights.size:
            raise InputError(f"{path}: nothing was measured")
        if not fill:
            ways = (f"{way} of evaluate, optimize and prepare" for way in ("fill=True", "--fill"))
            raise InputError(*(f"{fault}; {way} fills them from around" for way in ways))
        say(f"{fault}; filled from around")
    if level:
        down, right, offset = plane(heights, repeats)
        across, along = round(abs(right) * heights.shape[1], 6), round(abs(down) * heights.shape[0], 6)
        rises = f"{across:.2g} mm over the width and {along:.2g} mm over the height"
        say(f"{path}: a tilt of {rises} is taken out, and the mean height of {offset:.3g} mm")
        heights = levelled(heights, repeats)
    # After the plane, of which holes are left out.
    return filled(heights, repeats) if missing else heights


def _in_range(path: Path, heights: Array, holds_mm: bool, unit: float, stated: bool) -> Array:
    """`check_heights`, whose refusals name ways to mend it; a relief that nobody feels is a warning.

    Args:
        path: The file.
        heights: (rows, cols) mm.
        holds_mm: Whether the file holds numbers.
        unit: mm for a number of 1, or for white.
        stated: Whether the file states the unit of its numbers, which is then not asked for.
    """
    with np.errstate(invalid="ignore"):
        span = float(np.ptp(heights)) if holds_mm else unit
    factor = next((one for one in LIKELIER if LEAST_FELT_MM <= one * span <= limits.DEEPEST_RELIEF_MM), 1.0)
    likely = f"{factor * unit:g}"
    key, (name, units) = (
        "height_scale" if holds_mm else "relief_mm",
        NAMES.get(likely, ("of another unit", "")),
    )
    argument, option = f"{key}={likely}", f"--{key.replace('_', '-')} {likely}"
    asks = ("", "")
    if factor != 1.0 and not stated:
        asks = (f"; are these {name}? {argument}", f"; are these {name}? {option}{units * holds_mm}")
    if TOLERANCE_MM < span < LEAST_FELT_MM:
        _warn_once(f"{path}: {1e3 * span:.3g} µm high, less than a finger feels{asks[1]}")
    try:
        return check_heights(heights, path)
    except InputError as error:
        faults = [f"{error}{ask}" for ask in asks]
        outside = heights.min() < -TOLERANCE_MM or heights.max() * factor > limits.DEEPEST_RELIEF_MM
        if holds_mm and outside and span * factor <= limits.DEEPEST_RELIEF_MM:
            scaled = likely != "1"
            calls = _mending(path, f" {option}" * scaled, f", {argument}" * scaled, ".exr")
            ways = zip(faults, ("level=True", "--level"), calls, strict=True)
            lifts = "of evaluate and optimize lifts them, and so does:"
            faults = [f"{fault}; {level} {lifts} {call}" for fault, level, call in ways]
        raise InputError(*faults) from error


@lru_cache(maxsize=256)
def _warn_once(line: str) -> None:
    """Log a warning, once: a verb may read a file several times."""
    _log.warning("%s", line)


def fitting_repeats(repeats: Repeats, heights: ArrayLike, path: str | os.PathLike[str]) -> Repeats:
    """The axes of repeats that a header states, or none if the sides do not fit; both cases are logged.

    Args:
        repeats: What the header states.
        heights: (rows, cols) of the file, in any unit.
        path: The file, for the line.
    """
    if (fault := misfit(heights, axes(repeats))) is not None:
        _log.warning("%s: is taken as a plate, though its header says that it repeats: %s", path, fault)
        return False
    if repeats:
        say(f"{path} repeats along {'x and y' if repeats is True else repeats} (its header)")
    return repeats


def repeats_by_header(path: str | os.PathLike[str]) -> Repeats:
    """`fitting_repeats` of a file; False for an unreadable file, as the later read of its heights raises."""
    try:
        state = os.stat(path)
    except OSError:
        return False
    return _repeats_of_file(Path(path), state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _repeats_of_file(path: Path, _mtime_ns: int, _size: int) -> Repeats:
    """Cached, since the rows of a study take the same few files thousands of times."""
    try:
        content = _read(path, _check_shape)
    except InputError:
        return False
    return fitting_repeats(content.repeats, content.values, path)


def given_or_stored(content: Samples, key: str, given: float | None) -> float | None:
    """The length that is given, else that of the header; a difference of both is logged as a warning."""
    header = content.lengths.get(key)
    if given is None or header is None:
        return header if given is None else given
    if not math.isclose(given, header, rel_tol=1e-6):
        _log.warning("%s: %s: %g replaces the %g of the file's header", content.path, key, given, header)
    return given


def load_heights(
    path: str | os.PathLike[str], *, relief_mm: float | None = None, height_scale: float | None = None
) -> Array:
    """Read a height map: the heights of `load_height_map`, (rows, cols) in mm."""
    return load_height_map(path, relief_mm=relief_mm, height_scale=height_scale).heights


def load_field(path: str | os.PathLike[str]) -> Array:
    """Read heights of any unit and range, such as an elevation model or a picture to cut textures from.

    Args:
        path: A file of one of the kinds of `load_height_map`.

    Returns:
        Values of shape (rows, cols), row 0 the top: grey in [0, 1]; float TIFF, EXR and NPY as they are, even
        if not finite.

    Raises:
        InputError: The file is missing, damaged or larger than 8192 samples a side.
    """
    return _read(Path(path), _check_extent).values


def load_content(path: str | os.PathLike[str]) -> Samples:
    """Read what `load_field` reads, with the lengths in the file's header; no refusal names a command."""
    return _one_channel(Path(path), _check_extent)


def holds_mm(path: str | os.PathLike[str]) -> bool:
    """Whether a file holds numbers, by what its content states, else by its name; False if unreadable."""
    path = Path(path)
    try:
        reader = by_content(path)
        if reader is read_tiff:
            return is_measured(path) or holds_numbers(path)
    except (OSError, InputError):
        return False
    if reader is not None:
        return reader is not read_picture
    return path.suffix.lower() in (".exr", ".npy", *GRIDS, *MEASURED)


def check_scales(files: Iterable[str | os.PathLike[str]], lengths: Lengths) -> None:
    """Raise InputError for a ``relief_mm`` without a picture, and a ``height_scale`` without a file in mm."""
    relief_mm, height_scale = lengths.get("relief_mm"), lengths.get("height_scale")
    if relief_mm is None and height_scale is None:
        return
    in_mm = {holds_mm(file) for file in files}
    if relief_mm is not None and in_mm == {True}:
        raise InputError(
            "relief_mm: is for pictures; the texture holds mm, which height_scale scales",
            "--relief-mm: is for pictures; the texture holds mm, which --height-scale scales",
        )
    if height_scale is not None and in_mm == {False}:
        raise InputError(
            "height_scale: is for files that hold mm; a picture is scaled by relief_mm",
            "--height-scale: is for files that hold mm, as --units is; a picture is scaled by --relief-mm",
        )


def _read(path: Path, check: Check, relief_mm: float | None = None) -> Samples:
    """Read a file; the refusal of a picture that is no height map names the command that makes one of it."""
    try:
        return _one_channel(path, check)
    except PictureError as error:
        option = "" if relief_mm is None else f" --relief-mm {relief_mm:g}"
        argument = "" if relief_mm is None else f", relief_mm={relief_mm:g}"
        calls = _mending(path, option, argument)
        raise InputError(*(f"{error}; make a height map of it with: {call}" for call in calls)) from error


def _mending(path: Path, option: str, argument: str, suffix: str = ".png") -> tuple[str, str]:
    """How Python and the command make a height map of a file."""
    out = str(path.with_name(f"{path.stem}-heights{suffix}"))
    for_python = f"retouch.prepare({str(path)!r}{argument}).save({out!r})"
    return for_python, f"retouch prepare {shlex.quote(str(path))} -o {shlex.quote(out)}{option}"


def _one_channel(path: Path, check: Check) -> Samples:
    """What a height map holds: one picture without colours or transparency. Raises InputError."""
    if path.suffix.lower() not in HEIGHTS:
        kind = PictureError if path.suffix.lower() in PICTURES and path.is_file() else InputError
        raise kind(f"{path}: not a height map: expected one of {', '.join(HEIGHT_MAPS)}")
    samples = read_samples(path, check)
    if samples.kind.split()[0] in _PHOTOGRAPHS:
        raise PictureError(f"{path}: holds a {samples.kind}, not a height map")
    if samples.count > 1:
        raise PictureError(f"{path}: holds several pictures ({samples.count}); a height map is one")
    if np.ptp(samples.channels.get("A", 0.0)) != 0.0:
        raise PictureError(f"{path}: transparency varies; a height map is opaque")
    if fault := no_heights(samples.channels, samples.white):
        raise InputError(f"{path}: holds {fault}")
    if samples.coloured:
        raise PictureError(f"{path}: is coloured; a height map is grey")
    for note in samples.notes:
        say(f"{path}: {note}")
    return samples


def check_heights(heights: ArrayLike, name: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Check the shape and the range of heights.

    Args:
        heights: (rows, cols) heights in mm.
        name: The file, or another name, for messages.

    Returns:
        The heights as float64, in [0, 20] mm; those above 3 mm are for `relief.depth`.

    Raises:
        InputError: They are too few or too many, not finite or out of range; the message starts
            with ``name``.
    """
    heights = np.asarray(heights, dtype=np.float64)
    _check_shape(heights.shape, name)
    if not np.isfinite(heights).all():
        raise InputError(f"{name}: {np.count_nonzero(~np.isfinite(heights))} heights are not finite")
    lowest, highest = heights.min(), heights.max()
    if lowest < -TOLERANCE_MM:
        raise InputError(f"{name}: heights go down to {lowest:g} mm; the lowest allowed is 0")
    limit = limits.HEIGHT_LIMIT_MM
    if highest > limit + TOLERANCE_MM:
        limit = limits.DEEPEST_RELIEF_MM
    if highest > limit + TOLERANCE_MM:
        raise InputError(f"{name}: heights reach {highest:g} mm; the highest allowed is {limit:g}")
    return np.clip(heights, 0.0, limit)


def save_heights_exr(
    path: str | os.PathLike[str],
    heights: ArrayLike,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    repeats: Repeats = False,
    layer_um: float | None = None,
) -> None:
    """Write heights as a float32 EXR, channel Y; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in mm.
        size_mm: Side of the plate, mm; ``retouch.size_mm`` of the header.
        relief_mm: Height of white above black, mm, if the heights are made a picture; ``retouch.relief_mm``.
        repeats: Whether they are a tile, along both axes, "x" or "y"; ``retouch.repeats``.
        layer_um: Layers of the print that they are; ``retouch.layer_um``.

    Raises:
        InputError: A length is out of `RANGES`.
    """
    header = header_of(path, size_mm=size_mm, relief_mm=relief_mm) | _marks(repeats, layer_um)
    with partial_file(path) as partial:
        write_exr(partial, heights, header)


def write_exr(path: Path, samples: ArrayLike, attributes: Mapping[str, Any] | None = None) -> None:
    """Write samples (rows, cols) as a float32 EXR, channel Y; (rows, cols, 3) as red, green and blue.

    Args:
        path: The file.
        samples: (rows, cols) or (rows, cols, 3) values.
        attributes: More attributes of the header, by name.

    Raises:
        OSError: The file cannot be written.
    """
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | dict(attributes or {})
    try:
        values = np.ascontiguousarray(samples, dtype=np.float32)
        OpenEXR.File(header, {"Y" if values.ndim == 2 else "RGB": values}).write(str(path))
    except RuntimeError as error:
        # OpenEXR states the system's error only at the end of its message.
        message = str(error).rstrip(".")
        number = next((n for n in errno.errorcode if message.endswith(os.strerror(n))), errno.EIO)
        raise OSError(number, os.strerror(number), str(path)) from error


def save_heights_png(
    path: str | os.PathLike[str],
    heights: ArrayLike,
    relief_mm: float | None,
    size_mm: float | None = None,
    repeats: Repeats = False,
    layer_um: float | None = None,
) -> None:
    """Write heights as a 16 bit grey PNG; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in [0, relief_mm] mm.
        relief_mm: Height of white above black, mm; text ``retouch.relief_mm`` of the file. None, if it is
            unknown, leaves the text out and takes heights from 0 to 1.
        size_mm: Side of the plate, mm; text ``retouch.size_mm`` of the file.
        repeats: Whether they are a tile, along both axes, "x" or "y"; text ``retouch.repeats`` of the file.
        layer_um: Layers of the print that they are; text ``retouch.layer_um``.

    Raises:
        InputError: A height is outside the range that the picture can hold, or a length out of `RANGES`.
    """
    text = PngInfo()
    for key, length in header_of(path, size_mm=size_mm, relief_mm=relief_mm).items():
        text.add_text(key, repr(length))
    for key, mark in _marks(repeats, layer_um).items():
        text.add_text(key, mark)
    heights = np.asarray(heights, dtype=np.float64)
    low, high = heights.min(), heights.max()
    relief_mm = 1.0 if relief_mm is None else relief_mm
    if not (low >= -TOLERANCE_MM and high <= relief_mm + TOLERANCE_MM):
        raise InputError(
            f"{path}: relief_mm: heights {low:g} to {high:g} mm do not fit in 0 to {relief_mm:g}"
        )
    grey = np.rint(np.clip(heights / relief_mm, 0.0, 1.0) * 65535).astype(np.uint16)
    with partial_file(path) as partial:
        Image.fromarray(grey).save(partial, format="PNG", pnginfo=text)


def _marks(repeats: Repeats, layer_um: float | None) -> dict[str, str]:
    """The entries of a header for a tile, and for a print; none for the design of a plate."""
    marks = {stated: mark for mark, stated in TILE_MARKS.items()}
    tile = {TILE: marks[repeats]} if repeats else {}
    return tile if layer_um is None else tile | {LAYER: f"{layer_um:g}"}


def _check_shape(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2:
        raise PictureError(f"{name}: {len(shape)} dimensions; a height map has 2")
    rows, cols = shape
    if min(rows, cols) < limits.SMALLEST_SIDE:
        raise InputError(
            f"{name}: {cols} x {rows} samples; at least {limits.SMALLEST_SIDE} a side are needed"
        )
    if max(rows, cols) > limits.LARGEST_SIDE:
        raise PictureError(f"{name}: {cols} x {rows} samples; at most {limits.LARGEST_SIDE} a side are read")


def _check_extent(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2 or max(shape) > LARGEST_FIELD_SIDE:
        raise PictureError(
            f"{name}: shape {shape}; two sides of at most {LARGEST_FIELD_SIDE} samples are read"
        )
