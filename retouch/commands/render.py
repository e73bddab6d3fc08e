"""`retouch render`: pictures of a scene, one for each rendering condition."""

import argparse
import math
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mitsuba_scenes import find_file, find_texture
from relief.common.errors import InputError
from relief.common.formatting import duration, number, percent
from retouch.commands.options import (
    TEXTURE,
    add_mitsuba,
    add_plate,
    add_repeats,
    add_talk,
    check_scales,
    console,
    count,
    print_json,
    seed,
)

if TYPE_CHECKING:
    from rich.table import Table

    from relief.relief import Relief
    from visual.noise import Batches

HELP = "render a scene, one picture for each light"
DESCRIPTION = """\
Renders every condition of a scene (each light alone, together with the ambient light) into DIR, as
<condition>.exr (radiance, 32-bit float) and <condition>.png (sRGB; white is the radiance of a white plate
that faces the light). Pictures of an earlier rendering are replaced.

Each picture is the mean of a few pictures rendered with fewer samples and independent random numbers. Their
spread gives the standard error of a pixel, printed in percent of the picture's mean.

With --explain nothing is rendered or written: the command lists what would be rendered, what is skipped
because the scene does not need it, and whether `retouch optimize` can use the scene.
"""
EPILOG = """\
examples:
  retouch render studio
  retouch render studio.xml --explain
  retouch render studio --texture gravel-tile --repeats
  retouch render studio.xml --texture runs/stone/heights.exr -D resolution=512 --samples 256 -o after
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene",
        type=Path,
        metavar="SCENE",
        help="Mitsuba scene (.xml) with a height field; a bundled one goes by its name",
    )
    parser.add_argument(
        "-o",
        dest="out",
        type=Path,
        metavar="DIR",
        help="folder to write to (default: renders/<name of the scene>)",
    )
    parser.add_argument(
        "--texture",
        type=Path,
        help=f"instead of the scene's, {TEXTURE}",
    )
    add_plate(parser, size="the scene's")
    add_repeats(parser)
    parser.add_argument(
        "--samples",
        type=count,
        metavar="N",
        help="samples a pixel, 4 to 65536; fewer count as 4 (default: the scene's)",
    )
    parser.add_argument(
        "--seed",
        type=seed,
        default=0,
        metavar="N",
        help="seed of the random numbers; the same seed gives the same pictures (default: 0)",
    )
    parser.add_argument(
        "--explain",
        action="store_true",
        help="only list what would be rendered, what is skipped, and why; write nothing",
    )
    add_mitsuba(parser)
    add_talk(parser, "mean radiance, error and files of every picture", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    arguments.scene = find_file(arguments.scene, ".xml")
    if arguments.texture is not None:
        arguments.texture = find_texture(arguments.texture)
        if not os.path.isfile(arguments.texture):
            raise InputError(f"{arguments.texture}: no such file")
        check_scales(arguments, [arguments.texture])
    elif (arguments.relief_mm, arguments.height_scale) != (None, None):
        flag = "--height-scale" if arguments.relief_mm is None else "--relief-mm"
        raise InputError(
            f"{flag}: belongs to --texture; a scene has its own parameters, as in -D relief_mm=1"
        )
    if arguments.explain:
        return _explain(arguments)
    out = arguments.out or Path("renders") / arguments.scene.stem
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: -o: is a file, not a folder")
    from optimize.run_directory.pictures import write_pictures
    from optimize.runs.preparation import BLACK
    from visual.noise import batched, batched_colour
    from visual.scene import load_scene

    scene = load_scene(
        arguments.scene,
        dict(arguments.defines),
        arguments.variant,
        relief=_relief(arguments),
    )
    start = time.perf_counter()
    if scene.colour:
        batches, shown = batched_colour(scene, arguments.samples, arguments.seed)
    else:
        batches = batched(scene, samples=arguments.samples, seed=arguments.seed)
        shown = batches.mean
    seconds = time.perf_counter() - start
    pictures = batches.mean
    levels = dict(zip(scene.conditions, pictures.mean(axis=(1, 2)).tolist(), strict=True))
    for condition, level in levels.items():
        if not math.isfinite(level):
            raise InputError(f"{arguments.scene}: {condition}: pixels are not finite")
    files = write_pictures(out, scene.conditions, shown, scene.white)
    rows, cols = pictures.shape[1:]
    black = [condition for condition, level in levels.items() if level < BLACK * scene.white]
    if arguments.json:
        errors = batches.relative_error()
        print_json(
            {
                "scene": str(arguments.scene),
                "variant": scene.variant,
                "resolution": [rows, cols],
                "samples": batches.samples,
                "seconds": seconds,
                "white": scene.white,
                "pictures": [
                    {
                        "condition": condition,
                        "mean_radiance": level,
                        "pixel_error_percent": 100.0 * float(error),
                        "black": condition in black,
                        "files": [f"{file}{suffix}" for suffix in (".exr", ".png")],
                    }
                    for (condition, level), error, file in zip(levels.items(), errors, files, strict=True)
                ],
            }
        )
        return 0
    screen = console()
    screen.print(table(scene.conditions, files, batches))
    screen.print(
        f"{cols} x {rows} pixels, {batches.samples} samples each, {scene.variant}, "
        f"{duration(seconds)} of rendering."
    )
    if black:
        screen.print(
            f"Black: {', '.join(black)}; next to no light goes from there to the camera.", markup=False
        )
    return 0


def _relief(arguments: argparse.Namespace) -> "Relief":
    """The relief on the scene's plate, the texture's or the scene's own. Raises InputError."""
    from visual.scene_file.fitting import scene_relief

    return scene_relief(
        arguments.scene,
        dict(arguments.defines),
        arguments.texture,
        size_mm=arguments.size_mm,
        relief_mm=arguments.relief_mm,
        height_scale=arguments.height_scale,
        repeats=arguments.repeats or False,
    )


def _explain(arguments: argparse.Namespace) -> int:
    from rich.table import Table
    from rich.text import Text

    from visual.explain import explain_scene

    lines = explain_scene(
        arguments.scene,
        dict(arguments.defines),
        arguments.variant,
        _relief(arguments),
        arguments.samples,
    )
    if arguments.json:
        print_json([{"subject": subject, "sentence": sentence} for subject, sentence in lines])
        return 0
    rows = Table(box=None, padding=(0, 3, 0, 0), pad_edge=False, show_header=False)
    rows.add_column(overflow="fold")
    rows.add_column(overflow="fold")
    for subject, sentence in lines:
        rows.add_row(Text(subject), Text(sentence))
    console().print(rows)
    return 0


def table(conditions: Sequence[str], files: Sequence[Path], batches: "Batches") -> "Table":
    """A table, one row a condition: name, mean radiance, standard error of a pixel in percent, files."""
    from rich.table import Table
    from rich.text import Text

    rows = Table(box=None, padding=(0, 3, 0, 0), pad_edge=False)
    rows.add_column("condition", overflow="fold")
    rows.add_column("mean radiance", justify="right", no_wrap=True)
    rows.add_column("error of a pixel", justify="right", no_wrap=True)
    rows.add_column("files", overflow="fold")
    means, errors = batches.mean.mean(axis=(1, 2)), batches.relative_error()
    for condition, file, mean, error in zip(conditions, files, means, errors, strict=True):
        rows.add_row(
            Text(condition), number(float(mean)), percent(100.0 * float(error)), Text(f"{file}.exr, .png")
        )
    return rows
