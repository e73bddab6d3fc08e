"""`retouch evaluate`: how textures feel, by the numbers that are reported, without rendering anything."""

import argparse
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optimize.commands.options import add_plate, console, contact_of
from relief.limits import PATCH_SIDE_MM

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from tactile import Skin

MODELS = {
    "layer": "Elastic layer with free sides",
    "quick": "Elastic layer, few steps of the solver",
    "fem": "Finite elements",
    "net": "Trained net",
}
SMOOTH = 1e-6
"""Roughness that is nothing but rounding; no number of just-noticeable differences leads to or from it."""

HELP = "tell how rough and how cold textures feel"
DESCRIPTION = """\
Presses the finger's skin on each texture and tells its roughness (the full sum, in double precision), its
contact area in mm² (more feels colder) and the share of the plate in contact. Of several textures it also
tells how many just-noticeable differences each is rougher (+) or smoother (-) than the first.
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
    add_plate(parser, f"{PATCH_SIDE_MM:g}", "none, and needed, for PNG and TIFF; EXR and NPY hold mm")
    parser.add_argument(
        "--model",
        choices=tuple(MODELS),
        default="layer",
        help="model of touch: layer (default); fem, finite elements; net, trained, where its weights are",
    )
    skin = parser.add_argument_group("the skin")
    for flag, default, told in (
        ("--force-n", 10.0, "force of the finger"),
        ("--young-modulus-mpa", 0.5, "Young's modulus"),
        ("--poisson-ratio", 0.48, "Poisson's ratio"),
    ):
        skin.add_argument(
            flag, type=float, default=default, metavar="X", help=f"{told} (default: {default:g})"
        )
    parser.add_argument("--json", action="store_true", help="print a JSON list instead of a table")


def run(arguments: argparse.Namespace) -> int:
    from relief.errors import naming
    from relief.heightmap import load_heights
    from tactile import Skin

    size_mm = PATCH_SIDE_MM if arguments.size_mm is None else arguments.size_mm
    with naming("evaluate"):
        skin = Skin(
            force_n=arguments.force_n,
            young_modulus_mpa=arguments.young_modulus_mpa,
            poisson_ratio=arguments.poisson_ratio,
        )
    # All are read first: no one should wait for numbers and then be told of a misspelt name.
    reliefs = [load_heights(texture, relief_mm=arguments.relief_mm) for texture in arguments.textures]
    feels = compared(
        [
            feel(texture, heights, size_mm, skin, arguments.model)
            for texture, heights in zip(arguments.textures, reliefs, strict=True)
        ]
    )
    if arguments.json:
        setting = {"size_mm": size_mm, "skin": asdict(skin), "model": arguments.model}
        print(json.dumps([_told(one, len(feels) > 1) | setting for one in feels], indent=2))
        return 0
    screen = console()
    screen.print(table(feels))
    screen.print(
        f"{MODELS[arguments.model]}, {skin.young_modulus_mpa:g} MPa, Poisson's ratio {skin.poisson_ratio:g}, "
        f"{skin.force_n:g} N on {size_mm:g} x {size_mm:g} mm."
    )
    return 0


def feel(path: Path, heights: "NDArray[np.float64]", size_mm: float, skin: "Skin", model: Any) -> Feel:
    """Press the skin on heights (rows, cols) in mm. Raises InputError that names ``path``."""
    import tactile
    from relief.errors import naming

    with naming(path), contact_of(path):
        touch = tactile.press(heights, size_mm=size_mm, skin=skin, model=model)
        return Feel(
            str(path),
            tactile.roughness(touch.strain, size_mm).item(),
            tactile.contact_area(touch.gap, size_mm).item(),
            touch.contact_fraction.item(),
        )


def compared(feels: list[Feel]) -> list[Feel]:
    """The same with ``jnd_from_first``, where there are several."""
    from tactile import jnd_apart

    first = feels[0].roughness
    if len(feels) == 1 or first < SMOOTH:
        return feels
    return [
        one if one.roughness < SMOOTH else replace(one, jnd_from_first=jnd_apart(one.roughness, first))
        for one in feels
    ]


def table(feels: list[Feel]) -> "Table":
    """One row a texture, for a person."""
    from rich.table import Table
    from rich.text import Text

    from optimize.report.formatting import number

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


def _told(one: Feel, several: bool) -> dict[str, Any]:
    values = asdict(one)
    if not several:
        del values["jnd_from_first"]
    return values
