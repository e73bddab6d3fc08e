"""Picture files: EXR with radiance, PNG for display."""

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from relief.ground.arrays import FloatArray
from relief.ground.errors import InputError
from relief.ground.files import partial_folder
from relief.ground.srgb import srgb
from relief.heightmap import write_exr
from relief.reading.exr import exr_channels
from visual.lights.parallel import LUMINANCE

LONGEST_NAME = 48
"""Most characters of a file name without its endings: four bytes each still fit into 255 bytes."""


def file_names(conditions: Sequence[str]) -> list[str]:
    """A safe file name without suffix for each condition.

    A scene may name its conditions by any text. The file names contain no folder, and differ even on file
    systems that ignore case.
    """
    names: dict[str, str] = {}
    for condition in conditions:
        stem = re.sub(r"[^\w.-]+", "-", condition).lstrip(".-")[:LONGEST_NAME] or "condition"
        numbered = (f"{stem}-{number}" for number in itertools.count(2))
        name = next(name for name in itertools.chain([stem], numbered) if name.casefold() not in names)
        names[name.casefold()] = name
    return list(names.values())


def write_pictures(
    folder: Path, conditions: Sequence[str], pictures: FloatArray, white: float, suffix: str = ""
) -> list[Path]:
    """Write each picture as `<condition>[-suffix].exr` (radiance, float32) and `.png` (sRGB, `white` is 255).

    The folder is created if needed. The files appear in the folder once all of them are written.

    Args:
        conditions: names of the conditions, any text.
        pictures: (conditions, rows, cols) linear radiance, or (conditions, rows, cols, 3) in colour.
        white: radiance shown as full white in the PNG files.
        suffix: end of each file name, such as "before".

    Returns:
        The paths without `.exr` and `.png`, in the order of the conditions.
    """
    names = [f"{name}-{suffix}" if suffix else name for name in file_names(conditions)]
    with partial_folder(folder) as temporary:
        written = []
        for name, picture in zip(names, pictures, strict=True):
            written += [temporary / f"{name}.exr", temporary / f"{name}.png"]
            write_exr(written[-2], picture)
            Image.fromarray(np.rint(srgb(picture, white) * 255.0).astype(np.uint8)).save(written[-1])
        folder.mkdir(exist_ok=True)
        for path in written:
            path.replace(folder / path.name)
    return [folder / name for name in names]


def read_grey(path: Path, shape: tuple[int, int] | None = None) -> FloatArray:
    """Luminance (rows, cols) of a picture file.

    Args:
        path: EXR, in grey or in colour.
        shape: rows and columns that the picture must have; any by default.

    Raises:
        InputError: the file is missing or damaged, or of another shape.
    """

    def check(size: tuple[int, ...], name: object) -> None:
        if shape is not None and tuple(size) != shape:
            raise InputError(f"{name}: {size[1]} x {size[0]} pixels; the scene has {shape[1]} x {shape[0]}")

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    channels, *_ = exr_channels(path, check)
    channels.pop("A", None)
    each = np.stack([*channels.values()]).astype(np.float64)
    picture = np.asarray(each[0] if len(each) == 1 else np.tensordot(LUMINANCE, each, 1))
    if not np.isfinite(picture).all():
        raise InputError(f"{path}: holds values that are not finite")
    return picture
