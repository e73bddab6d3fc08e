"""Section `[print]` of a run file: the printer that makes the relief."""

from typing import Any, Self

from pydantic import model_validator

from optimize.settings.toml_files import Section
from relief.ground.limits import DEEPEST_RELIEF_MM
from relief.printers import FEATURE_PIXELS, RANGES, STEEPEST_DEGREES, Printer, find_printer

OWN = "own"
"""Name of a printer whose numbers are not those of a named one."""
NEEDED = ("pixel_um", "layer_um")
"""Numbers that a printer without a name needs."""


class Print(Section):
    """`[print]`: the printer; none, if nothing is given.

    Numbers that are not given are those of the named printer. Once loaded, they are all there.

    Attributes:
        printer: name of a printer, or a printer file (.toml); "own" where a number differs from its.
        pixel_um: side of a pixel, or width of the spot or strand, µm; by default that of the named printer.
        layer_um: thickness of a layer, µm; by default that of the named printer.
        min_feature_um: width of the narrowest ridge or groove that comes out, µm; by default that of the
            named printer, else three pixels.
        max_slope_degrees: largest slope that comes out; by default that of the named printer, else 90,
            upright walls.
        max_relief_mm: greatest height of a relief; by default that of the named printer, else 20.
        keep_features: whether prints are without ridges and grooves narrower than the smallest feature.
    """

    printer: str | None = None
    pixel_um: float | None = None
    layer_um: float | None = None
    min_feature_um: float | None = None
    max_slope_degrees: float | None = None
    max_relief_mm: float | None = None
    keep_features: bool = False

    @property
    def described(self) -> Printer | None:
        """The printer; None if there is none. Raises InputError."""
        if self.printer is None:
            return None
        numbers = {key: getattr(self, key) for key in RANGES}
        return Printer(self.printer, **numbers, keep_features=self.keep_features)

    @model_validator(mode="before")
    @classmethod
    def _filled_in(cls, section: Any) -> Any:
        """The numbers of the named printer, or the usual ones, for those that are not given."""
        if not isinstance(section, dict):
            return section
        given = {key: section[key] for key in RANGES if section.get(key) is not None}
        name = section.get("printer")
        # A run goes on with its own numbers, whatever a later version says of a name. Wrong types are left
        # to the check of the fields.
        if name is None and not given and section.get("keep_features"):
            raise ValueError("keep_features: of no printer; name one")
        complete = name is not None and len(given) == len(RANGES)
        if complete or (name is None and not given) or not isinstance(name, str | None):
            return section
        if name not in (None, OWN):
            found = find_printer(name)
            # The name of a printer file is the one inside the file, wherever the file is kept.
            numbers, name = found.numbers(), found.name
            section = {"keep_features": found.keep_features} | section
        elif missing := [key for key in NEEDED if key not in given]:
            raise ValueError(f"{missing[0]}: missing; a printer needs {' and '.join(NEEDED)}, or a name")
        else:
            numbers = {"max_slope_degrees": STEEPEST_DEGREES, "max_relief_mm": DEEPEST_RELIEF_MM}
            if isinstance(pixel_um := given["pixel_um"], int | float):
                numbers["min_feature_um"] = FEATURE_PIXELS * pixel_um
        same = name is not None and all(numbers.get(key) == number for key, number in given.items())
        return section | numbers | given | {"printer": name if same else OWN}

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        _ = self.described
        return self
