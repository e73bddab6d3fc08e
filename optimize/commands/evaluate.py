"""`retouch evaluate`: roughness and contact area of textures, without rendering anything."""

import argparse
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optimize.commands.options import RELIEF_DEFAULT, add_plate, console, contact_errors_name
from optimize.report.formatting import MODEL_NAMES, model_name, number
from relief.errors import naming
from relief.limits import PATCH_SIDE_MM

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from tactile import Skin

SMOOTH = 1e-6
"""Largest roughness that is rounding error; ratios to such a roughness mean nothing."""

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


@dataclass(frozen=True)
class Feel:
    """How one texture feels: roughness, contact area in mm², share of the plate in contact (0 to 1).

    ``jnd_from_first``: just-noticeable differences rougher than the first texture of several; None for one
    alone, and where one of the two has no roughness.
    """

    texture: str
    roughness: float
    contact_area_mm2: float
    contact_fraction: float
    jnd_from_first: float | None = None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "textures",
        nargs="+",
        type=Path,
        metavar="TEXTURE",
        help="height map: PNG or TIFF (grey is height), EXR or NPY (mm)",
    )
    add_plate(parser, f"{PATCH_SIDE_MM:g}", RELIEF_DEFAULT)
    parser.add_argument(
        "--model",
        choices=tuple(MODEL_NAMES),
        default="layer",
        help="model of touch: layer (elastic layer, default), quick (its solver stopped after a few steps), "
        "net (quick with a learned net), fem (finite elements)",
    )
    skin = parser.add_argument_group("the skin")
    for flag, default, metavar, quantity in (
        ("--force-n", 10.0, "N", "force of the finger, N"),
        ("--young-modulus-mpa", 0.5, "MPA", "Young's modulus, MPa"),
        ("--poisson-ratio", 0.48, "NU", "Poisson's ratio, no unit, from 0 to 0.499"),
    ):
        skin.add_argument(
            flag, type=float, default=default, metavar=metavar, help=f"{quantity} (default: {default:g})"
        )
    parser.add_argument("--json", action="store_true", help="print a JSON list instead of a table")


def run(arguments: argparse.Namespace) -> int:
    from relief.heightmap import load_heights
    from tactile import Skin

    size_mm = PATCH_SIDE_MM if arguments.size_mm is None else arguments.size_mm
    with naming("evaluate"):
        skin = Skin(
            force_n=arguments.force_n,
            young_modulus_mpa=arguments.young_modulus_mpa,
            poisson_ratio=arguments.poisson_ratio,
        )
    # All files are read before the first press, so that a misspelt name is refused at once.
    reliefs = [load_heights(texture, relief_mm=arguments.relief_mm) for texture in arguments.textures]
    feels = compared(
        [
            feel(texture, heights, size_mm, skin, arguments.model)
            for texture, heights in zip(arguments.textures, reliefs, strict=True)
        ]
    )
    if arguments.json:
        setting = {"size_mm": size_mm, "skin": asdict(skin), "model": arguments.model}
        print(json.dumps([_json_values(one, len(feels) > 1) | setting for one in feels], indent=2))
        return 0
    screen = console()
    screen.print(table(feels))
    screen.print(
        f"{model_name(arguments.model).capitalize()}, {skin.young_modulus_mpa:g} MPa, "
        f"Poisson's ratio {skin.poisson_ratio:g}, {skin.force_n:g} N on {size_mm:g} x {size_mm:g} mm."
    )
    return 0


def feel(path: Path, heights: "NDArray[np.float64]", size_mm: float, skin: "Skin", model: Any) -> Feel:
    """Press the skin on a texture.

    Args:
        path: of the texture, for error messages and the result.
        heights: (rows, cols), mm.
        size_mm: side of the plate, mm.
        model: a key of `MODEL_NAMES`.

    Raises:
        InputError: unfit heights, size or model, or a contact that does not converge; the line names `path`.
    """
    import tactile

    with naming(path), contact_errors_name(path):
        touch = tactile.press(heights, size_mm=size_mm, skin=skin, model=model)
        return Feel(
            str(path),
            tactile.roughness(touch.strain, size_mm).item(),
            tactile.contact_area(touch.gap, size_mm).item(),
            touch.contact_fraction.item(),
        )


def compared(feels: list[Feel]) -> list[Feel]:
    """The textures with `jnd_from_first`, if there are several and the first has a roughness."""
    from tactile import jnd_apart

    first = feels[0].roughness
    if len(feels) == 1 or first < SMOOTH:
        return feels
    return [
        one if one.roughness < SMOOTH else replace(one, jnd_from_first=jnd_apart(one.roughness, first))
        for one in feels
    ]


def table(feels: list[Feel]) -> "Table":
    """A table for a person, one row a texture."""
    from rich.table import Table
    from rich.text import Text

    rows = Table(box=None, padding=(0, 3, 0, 0), pad_edge=False)
    rows.add_column("texture", overflow="fold")
    several = len(feels) > 1
    for name in ("roughness", *(["JND from first"] if several else []), "contact area", "in contact"):
        rows.add_column(name, justify="right", no_wrap=True)
    for one in feels:
        apart = [number(one.jnd_from_first)] if several else []
        contact = f"{number(one.contact_area_mm2)} mm²", f"{100.0 * one.contact_fraction:.0f} %"
        rows.add_row(Text(one.texture), number(one.roughness), *apart, *contact)
    return rows


def _json_values(one: Feel, several: bool) -> dict[str, Any]:
    values = asdict(one)
    if not several:
        del values["jnd_from_first"]
    return values
