"""Rendering: pictures of a scene, one for each rendering condition, as files."""

import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from mitsuba_scenes import find_file, find_texture
from optimize.run_directory.pictures import write_pictures
from optimize.runs.preparation import BLACK
from relief.ground.errors import InputError
from relief.ground.lengths import Lengths
from relief.ground.progress import Progress
from relief.relief import Relief
from relief.surface import Repeats
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source, relief_of
from visual.explain import explain_scene
from visual.picture_noise import Batches, batched, batched_colour
from visual.scene import Scene, load_scene
from visual.scene_file.plate_fitting import scene_relief


@dataclass(frozen=True, eq=False)
class Rendering:
    """Pictures of a scene, and their files.

    Attributes:
        scene: that was rendered.
        batches: the pictures, (conditions, rows, cols) radiance each, with their noise.
        files: of each condition, without `.exr` (radiance) and `.png` (sRGB).
        seconds: of rendering.
    """

    scene: Scene
    batches: Batches
    files: tuple[Path, ...]
    seconds: float

    @property
    def levels(self) -> dict[str, float]:
        """Mean radiance of the picture of each condition."""
        means = self.batches.mean.mean(axis=(1, 2)).tolist()
        return dict(zip(self.scene.conditions, means, strict=True))

    @property
    def errors_percent(self) -> list[float]:
        """Standard error of a pixel of each picture, in % of the picture's mean."""
        return [100.0 * float(error) for error in self.batches.relative_error()]

    @property
    def black(self) -> list[str]:
        """Conditions whose pictures are black."""
        return [name for name, level in self.levels.items() if level < BLACK * self.scene.white]

    def as_json(self) -> dict[str, Any]:
        """What `retouch render --json` prints."""
        numbers, black = zip(self.levels.items(), self.errors_percent, self.files, strict=True), self.black
        pictures = [
            {"condition": condition, "mean_radiance": level, "pixel_error_percent": error}
            | {"black": condition in black, "files": [f"{file}.exr", f"{file}.png"]}
            for (condition, level), error, file in numbers
        ]
        return {
            "scene": str(self.scene.file),
            "variant": self.scene.variant,
            "resolution": list(self.batches.mean.shape[1:]),
            "samples": self.batches.samples,
            "seconds": self.seconds,
            "white": self.scene.white,
            "pictures": pictures,
        }


def render(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    texture: Source | None = None,
    repeats: Repeats | None = None,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    samples: int | None = None,
    seed: int = 0,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **lengths: Unpack[Lengths],
) -> Rendering:
    """Render every condition of a scene into a folder, as `<condition>.exr` and `<condition>.png`.

    Args:
        scene: a Mitsuba scene (.xml) with a height field, or the name of a bundled one.
        out: the folder; default `renders/<name of the scene>`.
        texture: instead of the scene's own: a `Relief`, heights (rows, cols) in mm, a height map, the name of
            a bundled one, or the folder of a run.
        lengths: `size_mm`, `relief_mm` and `height_scale` of a file, as in `Relief.read`; `size_mm` also
            of an array.
        repeats: whether a file or an array is a tile, along both axes, "x" or "y"; None: as the header says.
        defines: values of the scene's parameters.
        variant: Mitsuba's.
        samples: a pixel, 4 at least; None: the scene's.
        seed: of the random numbers.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: what is wrong with the scene or the texture, in one line.
    """
    file = find_file(scene, ".xml")
    out = Path("renders") / file.stem if out is None else Path(out)
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file, not a folder", f"{out}: -o: is a file, not a folder")
    with followed(progress, quiet):
        relief = _on_plate(file, defines, texture, lengths, repeats)
        loaded = load_scene(file, defines, variant, relief=relief)
        start = time.perf_counter()
        if loaded.colour:
            batches, shown = batched_colour(loaded, samples, seed)
        else:
            batches = batched(loaded, samples=samples, seed=seed)
            shown = batches.mean
        seconds = time.perf_counter() - start
        unwritten = Rendering(loaded, batches, (), seconds)
        for condition, level in unwritten.levels.items():
            if not math.isfinite(level):
                raise InputError(f"{file}: {condition}: pixels are not finite")
        files = write_pictures(out, loaded.conditions, shown, loaded.white)
    return Rendering(loaded, batches, tuple(files), seconds)


def explain(
    scene: str | os.PathLike[str],
    *,
    texture: Source | None = None,
    repeats: Repeats | None = None,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    samples: int | None = None,
    **lengths: Unpack[Lengths],
) -> list[tuple[str, str]]:
    """What `render` would do, and whether `optimize` can use the scene, in lines of a subject and a sentence.

    Arguments are as in `render`. Raises InputError.
    """
    file = find_file(scene, ".xml")
    relief = _on_plate(file, defines, texture, lengths, repeats)
    return explain_scene(file, defines, variant, relief, samples)


def _on_plate(
    scene: Path,
    defines: Mapping[str, str] | None,
    texture: Source | None,
    lengths: Lengths,
    repeats: Repeats | None,
) -> Relief:
    """The relief on the scene's plate. Raises InputError."""
    if texture is not None and not isinstance(texture, str | os.PathLike):
        return relief_of(texture, **lengths, repeats=repeats)
    file = None if texture is None else find_texture(texture)
    return scene_relief(scene, defines, file, **lengths, repeats=repeats)
