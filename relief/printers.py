"""Printers by name or by numbers; `relief.printed` models their prints."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from relief.ground.errors import InputError, naming
from relief.ground.limits import BASE_MM, DEEPEST_RELIEF_MM

FEATURE_PIXELS = 3
"""Default smallest feature of a printer, pixels: thinner ones break off or fill up."""
STEEPEST_DEGREES = 90.0
"""Largest slope of a printer that prints upright walls, which all of the table do."""
RANGES = {
    "pixel_um": (1.0, 5000.0),
    "layer_um": (1.0, 1000.0),
    "min_feature_um": (1.0, 10000.0),
    "max_slope_degrees": (1.0, STEEPEST_DEGREES),
    "max_relief_mm": (0.01, 1000.0),
}
"""Least and greatest value, both allowed, of each number of a printer."""


@dataclass(frozen=True)
class Printer:
    """A printer by its numbers.

    Attributes:
        name: one of `PRINTERS`, that of a printer file, or "own".
        pixel_um: side of a pixel, or of the spot or strand that draws: the footprint of a height, um.
        layer_um: thickness of a layer, um.
        min_feature_um: width of the narrowest ridge or groove that comes out, um.
        max_slope_degrees: largest slope that comes out, from 0, flat, to 90, upright.
        max_relief_mm: greatest height of a relief above its lowest point, mm.
        keep_features: whether ridges and grooves narrower than the smallest feature are left out of prints.

    Raises:
        InputError: a number is out of `RANGES`; the message names the field.
    """

    name: str
    pixel_um: float
    layer_um: float
    min_feature_um: float
    max_slope_degrees: float = STEEPEST_DEGREES
    max_relief_mm: float = DEEPEST_RELIEF_MM
    keep_features: bool = False

    def __post_init__(self) -> None:
        for key, (least, greatest) in RANGES.items():
            if not least <= getattr(self, key) <= greatest:
                number = f"{getattr(self, key):g}"
                raise InputError(f"{key}: {number} is not a number from {least:g} to {greatest:g}")

    @property
    def pixel_mm(self) -> float:
        """Side of a pixel, mm."""
        return self.pixel_um / 1000.0

    @property
    def layer_mm(self) -> float:
        """Thickness of a layer, mm."""
        return self.layer_um / 1000.0

    @property
    def base_mm(self) -> float:
        """Thickness of a plate under height 0: the usual one, up to whole layers, mm."""
        return math.ceil(BASE_MM / self.layer_mm - 1e-9) * self.layer_mm

    def top_mm(self, limit_mm: float) -> float:
        """The greatest height of whole layers within a limit, mm."""
        return math.floor(limit_mm / self.layer_mm + 1e-9) * self.layer_mm

    def numbers(self) -> dict[str, float]:
        """The numbers of `RANGES` by name."""
        return {key: getattr(self, key) for key in RANGES}


def _printer(name: str, pixel_um: float, layer_um: float, min_feature_um: float | None = None) -> Printer:
    return Printer(name, pixel_um, layer_um, min_feature_um or FEATURE_PIXELS * pixel_um)


PRINTERS: Mapping[str, Printer] = {
    printer.name: printer
    for printer in (
        # Screens as masks have pixels of 22 to 50 um, projectors 35 to 75, lasers spots of 75 to 140.
        _printer("mask-22", 22.0, 25.0),
        _printer("mask-35", 35.0, 50.0),
        _printer("mask-50", 50.0, 50.0),
        _printer("dlp-35", 35.0, 25.0),
        _printer("dlp-50", 50.0, 50.0),
        _printer("dlp-75", 75.0, 50.0),
        # A laser draws one spot's width and no less.
        _printer("laser-85", 85.0, 50.0, 85.0),
        _printer("laser-140", 140.0, 50.0, 140.0),
        # Drops at 600 dots an inch; layers of 16 um, and 32 in the faster mode; details from 0.25 mm on.
        _printer("polyjet-16", 42.0, 16.0, 250.0),
        _printer("polyjet-32", 42.0, 32.0, 250.0),
        # The usual nozzle and layer; a strand is as wide as the nozzle.
        _printer("filament", 400.0, 200.0, 400.0),
        _printer("filament-fine", 250.0, 100.0, 250.0),
    )
}
"""Printers by name: a kind, and its pixel or layer in um, with the numbers that makers and print services
state for the kind. Any other printer is described by its own numbers."""

DRAWING = ("laser-85", "laser-140", "filament", "filament-fine")
"""Printers that draw outlines with a spot or a strand, which lie on no grid of pixels."""

WITH_SUPPORT = ("polyjet-16", "polyjet-32")
"""Printers that add a support under overhangs by themselves."""


PRINTER_FILE = ".toml"
"""Suffix of a file with the numbers of a printer, which `retouch scan --coupon` writes."""
LARGEST_FILE = 100_000
"""Most bytes of such a file."""
BESIDE = ("measured",)
"""Tables of such a file for people: intervals of the numbers."""


def is_printer_file(name: str) -> bool:
    """Whether a name is that of a file of a printer."""
    return name.lower().endswith(PRINTER_FILE)


def read_printer(path: str | os.PathLike[str]) -> Printer:
    """The printer of a file, called as the file is.

    `pixel_um` and `layer_um` are needed; other numbers are the usual ones where the file has none.

    Raises:
        InputError: the file cannot be read, has a key that a printer has not, or a number out of `RANGES`.
    """
    # Imported here: a printer by its name reads no file.
    import tomllib

    from relief.ground.files import read_limited
    from relief.ground.lengths import shown

    path = Path(path)
    try:
        values = tomllib.loads(read_limited(path, LARGEST_FILE).decode())
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not TOML: {shown(error)}") from error
    values = {key: value for key, value in values.items() if key not in BESIDE}
    for key, value in values.items():
        kinds = (bool,) if key == "keep_features" else (int, float)
        if key not in (*RANGES, "keep_features"):
            raise InputError(f"{path}: {shown(key)}: no such number of a printer; known: {', '.join(RANGES)}")
        if type(value) not in kinds:
            expected = "true or false" if bool in kinds else "a number"
            raise InputError(f"{path}: {key}: {shown(value)} is not {expected}")
    for key in ("pixel_um", "layer_um"):
        if key not in values:
            raise InputError(f"{path}: {key}: missing; a printer needs pixel_um and layer_um")
    with naming(path):
        usual = {"min_feature_um": FEATURE_PIXELS * values["pixel_um"]}
        return Printer(path.stem, **usual | values)


def find_printer(name: str) -> Printer:
    """The printer of a name, or of a printer file. Raises InputError."""
    if is_printer_file(name):
        return read_printer(name)
    if name not in PRINTERS:
        # Imported here, so that --help needs no numpy.
        from relief.ground.lengths import shown

        raise InputError(f"printer: {shown(name)} is none of {', '.join(PRINTERS)}, nor a file (.toml)")
    return PRINTERS[name]


def printer_of(printer: str | Printer | None) -> Printer | None:
    """The printer that is given, or that of a name or a file; None stays None. Raises InputError."""
    return find_printer(printer) if isinstance(printer, str) else printer
