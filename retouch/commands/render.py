"""`retouch render`: render a scene, one picture for each light.

Renders every condition of a scene (each light alone, together with the ambient light) into DIR, as
<condition>.exr (radiance, 32-bit float) and <condition>.png (sRGB; white is the radiance of a white plate
that faces the light). Pictures of an earlier rendering are replaced.

Each picture is the mean of a few pictures rendered with fewer samples and independent random numbers. Their
spread gives the standard error of a pixel, printed in percent of the picture's mean.

With --explain nothing is rendered or written: the command lists what would be rendered, what is skipped
because the scene does not need it, and whether `retouch optimize` can use the scene.

examples:
  retouch render studio
  retouch render studio.xml --explain
  retouch render studio --texture gravel-tile
  retouch render studio.xml --texture runs/stone/heights.exr -D resolution=512 --samples 256 -o after
"""

import argparse
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from mitsuba_scenes import find_file, find_texture
from relief.ground.errors import InputError
from relief.ground.formatting import duration, number, percent
from retouch.commands import options
from retouch.pages.sentences import TextTable

if TYPE_CHECKING:
    from retouch import Rendering


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "Mitsuba scene (.xml) with a height field; a bundled one goes by its name"
    options.add(parser, "scene SCENE", text, type=Path)
    options.add_out(parser, "DIR", "folder to write to (default: renders/<name of the scene>)")
    options.add(parser, "--texture", f"instead of the scene's, {options.TEXTURE}", type=Path)
    options.add_plate(parser, size="the scene's")
    options.add_repeats(parser)
    text = "samples a pixel, 4 to 65536; fewer count as 4 (default: the scene's)"
    options.add(parser, "--samples N", text, type=options.count)
    text = "seed of the random numbers; the same seed gives the same pictures (default: 0)"
    options.add(parser, "--seed N", text, type=options.seed, default=0)
    text = "only list what would be rendered, what is skipped, and why; write nothing"
    options.add(parser, "--explain", text)
    options.add_mitsuba(parser)
    options.add_talk(parser, "mean radiance, error and files of every picture", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    arguments.scene = find_file(arguments.scene, ".xml")
    if arguments.texture is not None:
        arguments.texture = find_texture(arguments.texture)
        if not os.path.isfile(arguments.texture):
            raise InputError(f"{arguments.texture}: no such file")
        options.check_scales(arguments, [arguments.texture])
    elif (arguments.relief_mm, arguments.height_scale) != (None, None):
        flag = "--height-scale" if arguments.relief_mm is None else "--relief-mm"
        raise InputError(
            f"{flag}: belongs to --texture; a scene has its own parameters, as in -D relief_mm=1"
        )
    defines = {"defines": dict(arguments.defines)}
    if arguments.explain:
        lines = retouch.explain(**options.keywords(arguments, retouch.explain) | defines)
        entries = [{"subject": subject, "sentence": sentence} for subject, sentence in lines]
        return options.report(arguments, entries, lines)
    rendering = retouch.render(**options.keywords(arguments, retouch.render) | defines)
    return options.report(arguments, rendering.as_json(), _lines(rendering))


def _lines(rendering: "Rendering") -> Iterator[str | TextTable]:
    """The table of the pictures, and sentences about them."""
    columns = (("condition", "text"), ("mean radiance", "number"), ("error of a pixel", "number"))
    rows = [
        (
            one["condition"],
            number(one["mean_radiance"]),
            percent(one["pixel_error_percent"]),
            f"{file}.exr, .png",
        )
        for one, file in zip(rendering.as_json()["pictures"], rendering.files, strict=True)
    ]
    yield TextTable((*columns, ("files", "text")), rows)
    high, wide = rendering.batches.mean.shape[1:]
    yield (
        f"{wide} x {high} pixels, {rendering.batches.samples} samples each, {rendering.scene.variant}, "
        f"{duration(rendering.seconds)} of rendering."
    )
    if rendering.black:
        yield f"Black: {', '.join(rendering.black)}; next to no light goes from there to the camera."
