"""Controls: other patches of the picture that a texture was cut from (section 5.3 of the paper)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from relief.ground.errors import InputError, naming, option_error
from relief.ground.progress import stage
from relief.preparing.choices import AUTO, Box
from relief.preparing.picture_preparation import prepare
from relief.preparing.tiling import OVERLAP
from relief.reading.readers import read_samples
from relief.relief import Relief
from retouch.laboratory.stimulus_sets.stimulus_set import StimulusSet

FOLDER = "controls"
"""Folder of the patches in that of a set."""


@dataclass(frozen=True)
class Control:
    """A patch, as a tile.

    Attributes:
        texture: name of the texture whose control the patch is.
        number: from 1 on.
        file: EXR in mm, whose header has the size.
        size_mm: side, mm.
    """

    texture: str
    number: int
    file: Path
    size_mm: float


def check_sources(stimuli: StimulusSet) -> None:
    """Check that each source holds the patches that are asked for. Raises InputError."""
    for texture, source in zip(stimuli.textures, stimuli.sources, strict=False):
        with naming(source):
            list(_crops(stimuli, source, stimuli.relief_of(texture)))


def make_controls(stimuli: StimulusSet, out: Path) -> list[Control]:
    """Prepare the patches of every source, unless they are there already.

    A patch is as wide in mm as its texture, or one period of the picture if that is less, has as many samples
    and the same relief, and is made periodic like a tile.

    Args:
        stimuli: the set.
        out: its folder.

    Raises:
        InputError: a picture has no width in mm, or is too small for a patch beside another.
    """
    controls = []
    for name, texture, source in zip(stimuli.names, stimuli.textures, stimuli.sources, strict=False):
        read = stimuli.relief_of(texture)
        with naming(source), stage(f"patches of {source.name}"):
            for number, crop in enumerate(_crops(stimuli, source, read), start=1):
                file = out / FOLDER / f"{name}-{number}.exr"
                if not file.is_file():
                    _prepare(stimuli, source, read, crop, file)
                size_mm = Relief.read(file, repeats=False).width_mm
                controls.append(Control(name, number, file.absolute(), size_mm))
    return controls


def _pixels_per_mm(stimuli: StimulusSet, source: Path) -> float:
    picture = read_samples(source)
    width_mm = stimuli.source_mm or picture.lengths.get("size_mm")
    if width_mm is None:
        raise option_error("source_mm", "missing; the picture does not say how many mm wide it is")
    return picture.width / width_mm


def _crops(stimuli: StimulusSet, source: Path, texture: Relief) -> Iterator[Box]:
    """Squares of the picture, in pixels, side by side from its corners inwards. Raises InputError."""
    picture = read_samples(source)
    side = round(_pixels_per_mm(stimuli, source) * texture.width_mm * (1.0 + OVERLAP))
    cols, rows = picture.width // max(side, 1), picture.height // max(side, 1)
    if side < 1 or cols * rows < stimuli.controls:
        raise InputError(
            f"holds {cols * rows} patches of {texture.width_mm * (1.0 + OVERLAP):.3g} mm: tiles with seams; "
            f"{stimuli.controls} controls are asked for"
        )
    # The outermost first: the texture itself most often comes from the middle.
    places = [(row, col) for row in range(rows) for col in range(cols)]
    places.sort(key=lambda at: -abs(at[0] - (rows - 1) / 2.0) - abs(at[1] - (cols - 1) / 2.0))
    for row, col in places[: stimuli.controls]:
        x = round(col * (picture.width - side) / max(cols - 1, 1))
        y = round(row * (picture.height - side) / max(rows - 1, 1))
        yield x, y, side, side


def _prepare(stimuli: StimulusSet, source: Path, texture: Relief, crop: Box, file: Path) -> None:
    relief_mm = float(texture.heights.max())
    samples = texture.heights.shape[1]
    prepared = prepare(source, crop=crop, samples=samples, tile=AUTO, relief_mm=relief_mm)
    size_mm = prepared.numbers["tile"]["pixels"] / _pixels_per_mm(stimuli, source)
    replace(prepared, size_mm=size_mm).save(file)
