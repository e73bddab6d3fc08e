"""Regions of an object with another feel and the same look: their tiles are optimised for where they lie."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mitsuba_scenes import DEFAULT_SCENE, find_file, find_texture
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError, naming
from relief.ground.progress import listening, stage
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.objects.wrap_task import lengths_of, task_of
from retouch.verbs.reliefs import Source

DRAFT_FACES = 20_000
"""Triangles by which the curvature of an object in a region is measured, without texture."""
LARGEST_JND = 10.0
"""Largest change of feel that is asked for, in just-noticeable differences."""

SHAPE = 5.0
"""`look.shape` of the runs: an object is looked at from all sides, while the studio looks from above. On the
curved plate gravel then changes 5.7 instead of 6.7 % from the sides, in the same time."""


@dataclass(frozen=True)
class Steered:
    """A tile that was optimised for a region of an object.

    Attributes:
        mask: of the region.
        jnd: change of feel wanted, in just-noticeable differences.
        reached: change on average over the places of the tile, on the object's curvature.
        run: folder of the run.
        curved_x_mm: radius of the object along the texture's x; None where it is straight.
        curved_y_mm: the same along y.
    """

    mask: str
    jnd: float
    reached: float | None
    run: Path
    curved_x_mm: float | None
    curved_y_mm: float | None

    def as_json(self) -> dict[str, Any]:
        """The region in the output of `retouch wrap --json`."""
        return {**vars(self), "run": str(self.run)}

    def line(self) -> str:
        """The region for a person."""
        reached = "smooth" if self.reached is None else f"{self.reached:+.2f} JND"
        return (
            f"{self.mask}: {reached} on the object's curvature, asked for {self.jnd:+g}; the "
            f"tile is that of {self.run}."
        )


def without_steered(options: WrapOptions) -> WrapOptions:
    """Options without the regions whose feel is to change: until it has, they have the look of the rest."""
    kept = [(mask, tile) for mask, tile in options.regions if not isinstance(tile, float | int)]
    return replace(options, regions=kept)


def with_steered(
    texture: Source, mesh: str | os.PathLike[str], out: Path, options: WrapOptions
) -> tuple[WrapOptions, list[Steered]]:
    """Options whose regions have tiles in the place of changes of feel, and what was made for them.

    Each is optimised in the bundled studio for the median curvature of the object in its region, into a
    folder beside the file, NAME-region-NUMBER.

    Args: as of `wrap`.

    Raises:
        InputError: a folder exists, the texture is no height map of a file, or a change is out of range.
    """
    regions = options.regions
    wanted = {
        number: (mask, float(jnd), out.with_name(f"{out.stem}-region-{number}"))
        for number, (mask, jnd) in enumerate(regions, 1)
        if isinstance(jnd, float | int)
    }
    if not wanted:
        return options, []
    task_of(texture, mesh, without_steered(options))
    file = _file_of(texture)
    for _, jnd, folder in wanted.values():
        if not 0.0 < abs(jnd) <= LARGEST_JND:
            raise InputError(f"regions: a change of {jnd:+g} JND is 0, or more than {LARGEST_JND:g}")
        if folder.exists():
            raise InputError(f"{folder}: exists already; remove it, or write to another file (-o)")
    tiles = {number: _steered(file, mesh, *region, options) for number, region in wanted.items()}
    replaced = [
        (mask, tiles[number].run if number in tiles else tile)
        for number, (mask, tile) in enumerate(regions, 1)
    ]
    return replace(options, regions=replaced), list(tiles.values())


def _file_of(texture: Source) -> Path:
    """The file of a texture that can be optimised. Raises InputError."""
    if not isinstance(texture, str | os.PathLike) or Path(texture).is_dir():
        raise InputError("regions: a change of feel needs a texture that is a height map or a bundled one")
    return find_texture(Path(texture))


def _steered(
    file: Path, mesh: str | os.PathLike[str], mask: str, jnd: float, folder: Path, options: WrapOptions
) -> Steered:
    """A tile with another feel, optimised for a region."""
    where = mask if options.mask is None else f"({options.mask}) & ({mask})"
    bare = replace(options, regions=(), mask=where)
    with stage("how the object bends"), listening(None), naming(mesh):
        task = task_of(file, mesh, bare)
        draft = replace(task.settings, faces=DRAFT_FACES, edge_mm=None, draft=True)
        drawn = task.wrapped(draft)
    radii = {f"curved_{axis}_mm": one.radius_mm for axis, one in zip("xy", drawn.bending, strict=True)}
    changes = [
        f"touch.jnd={jnd!r}",
        "repeats=true",
        "verify.baseline=false",
        f"look.shape={SHAPE!r}",
        *(f"touch.{key}={radius!r}" for key, radius in radii.items() if radius is not None),
        *(f"{key}={length!r}" for key, length in lengths_of(options).items()),
    ]
    # The packages of runs take two seconds to import, and few wraps need them.
    from retouch.verbs.runs import optimize

    result = optimize(run_from_scene(find_file(DEFAULT_SCENE, ".xml"), file, changes), folder)
    reached = result.verification.touch.jnd_from_original
    return Steered(mask, jnd, reached, folder, radii["curved_x_mm"], radii["curved_y_mm"])
