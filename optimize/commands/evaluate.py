"""`retouch evaluate`: roughness and contact area of textures, without rendering anything."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mitsuba_scenes import find_texture
from optimize.commands.options import (
    TEXTURE,
    add_plate,
    add_talk,
    check_scales,
    console,
    contact_errors_name,
    print_json,
)
from optimize.descent.targets import QUANTITIES, ROUGHNESS
from optimize.report.formatting import MODEL_NAMES, model_name, number
from relief.errors import naming
from relief.progress import stage
from tactile.skin import Skin

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from optimize.descent.touch_measures import TouchMeasures
    from tactile.model import ModelName

SMOOTH = 1e-6
"""Largest roughness that is rounding error; ratios to such a roughness mean nothing."""
SKIN = {
    "force_n": ("N", "force of the finger, N"),
    "young_modulus_mpa": ("MPA", "Young's modulus, MPa"),
    "poisson_ratio": ("NU", "Poisson's ratio, no unit, from 0 to 0.499"),
}
"""Attributes of the skin that have an option, with what the help calls the number and says of it."""

HELP = "measure how rough and how cold textures feel"
DESCRIPTION = """\
Presses the finger's skin on each texture and prints its roughness (no unit; full sum, double precision), its
contact area in mm² (more feels colder) and the share of the plate in contact. For several textures it also
prints how many just-noticeable differences each is rougher (+) or smoother (-) than the first.
"""
EPILOG = """\
examples:
  retouch evaluate stone.png --relief-mm 1.2
  retouch evaluate stone.exr runs/stone/heights.exr
  retouch evaluate *.exr --force-n 2 --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "textures",
        nargs="+",
        type=Path,
        metavar="TEXTURE",
        help=TEXTURE,
    )
    add_plate(parser)
    parser.add_argument(
        "--model",
        choices=tuple(MODEL_NAMES),
        default="layer",
        help="model of touch: layer (elastic layer, default), quick (its solver stopped after a few steps), "
        "net (quick with a learned net), fem (finite elements)",
    )
    skin = parser.add_argument_group("the skin")
    for name, (metavar, quantity) in SKIN.items():
        default = getattr(Skin, name)
        flag, text = f"--{name.replace('_', '-')}", f"{quantity} (default: {default:g})"
        skin.add_argument(flag, type=float, default=default, metavar=metavar, help=text)
    add_talk(parser, "a list with an entry for each texture", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    from relief.heightmap import load_height_map
    from relief.lengths import RANGES

    arguments.textures = [find_texture(texture) for texture in arguments.textures]
    check_scales(arguments, arguments.textures)
    with naming("evaluate"):
        skin = Skin(**{name: getattr(arguments, name) for name in SKIN})
    # All files are read before the first press, so that a misspelt name is refused at once.
    lengths = {key: getattr(arguments, key) for key in RANGES}
    read = [load_height_map(texture, **lengths) for texture in arguments.textures]
    sizes = [height_map.side_mm for height_map in read]
    measured = []
    with stage("evaluating", len(read)) as advance:
        for texture, height_map, size_mm in zip(arguments.textures, read, sizes, strict=True):
            measured.append(measure(texture, height_map.heights, size_mm, skin, arguments.model))
            advance()
    entries = described(arguments.textures, measured)
    if arguments.json:
        setting = {"skin": asdict(skin), "model": arguments.model}
        entries = [
            entry | {"size_mm": size_mm} | setting for entry, size_mm in zip(entries, sizes, strict=True)
        ]
        print_json(entries)
        return 0
    screen = console()
    screen.print(table(entries))
    plates = " and ".join(f"{size_mm:g} x {size_mm:g}" for size_mm in dict.fromkeys(sizes))
    screen.print(
        f"{model_name(arguments.model).capitalize()}, {skin.young_modulus_mpa:g} MPa, "
        f"Poisson's ratio {skin.poisson_ratio:g}, {skin.force_n:g} N on {plates} mm."
    )
    return 0


def measure(
    path: Path, heights: "NDArray[np.float64]", size_mm: float, skin: Skin, model: "ModelName"
) -> "TouchMeasures":
    """Press the skin on a texture.

    Args:
        path: of the texture, for error messages.
        heights: (rows, cols), mm.
        size_mm: side of the plate, mm.
        skin: the finger.
        model: a key of `MODEL_NAMES`.

    Raises:
        InputError: unfit heights, size or model, or a contact that does not converge; the line names `path`.
    """
    from optimize.descent.touch_measures import measure_touch

    with naming(path), contact_errors_name(path):
        return measure_touch(heights, size_mm, skin, model)


def described(textures: Sequence[Path], measured: "Sequence[TouchMeasures]") -> list[dict[str, Any]]:
    """One entry a texture: its name, every quantity of touch, and the share of the plate in contact.

    Of several textures, also `jnd_from_first`: just-noticeable differences rougher than the first, or None
    where one of the two has no roughness.
    """
    from tactile import jnd_apart

    entries = []
    first = measured[0].values[ROUGHNESS.name]
    for path, touch in zip(textures, measured, strict=True):
        entry = {"texture": str(path), **touch.values, "contact_fraction": touch.contact_fraction}
        if len(measured) > 1:
            roughness = touch.values[ROUGHNESS.name]
            smooth = min(roughness, first) < SMOOTH
            entry["jnd_from_first"] = None if smooth else jnd_apart(roughness, first)
        entries.append(entry)
    return entries


def table(entries: Sequence[Mapping[str, Any]]) -> "Table":
    """A table for a person, one row a texture."""
    from rich.table import Table
    from rich.text import Text

    rows = Table(box=None, padding=(0, 3, 0, 0), pad_edge=False)
    rows.add_column("texture", overflow="fold")
    several = "jnd_from_first" in entries[0]
    labels = [quantity.label for quantity in QUANTITIES.values()]
    for label in (*labels, "in contact", *(["JND from first"] if several else [])):
        rows.add_column(label, justify="right", no_wrap=True)
    for entry in entries:
        values = [f"{number(entry[name])} {quantity.unit}".rstrip() for name, quantity in QUANTITIES.items()]
        apart = [number(entry["jnd_from_first"])] if several else []
        contact = f"{100.0 * entry['contact_fraction']:.0f} %"
        rows.add_row(Text(entry["texture"]), *values, contact, *apart)
    return rows
