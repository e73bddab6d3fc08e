"""Options of `retouch fuzzy`, and keywords of `retouch.fuzzy`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.run_options import skin_option
from relief.ground.options import Option, ProgressKeywords
from relief.plate_options import relief_option

if TYPE_CHECKING:
    from retouch.verbs.reliefs import Source
    from tactile.skin import Skin


@dataclass(frozen=True, kw_only=True)
class FuzzyOptions(ProgressKeywords):
    """How the sides of a part are to feel, and what judges them."""

    feel_of: Annotated[
        "Source | Path | None",
        Option(
            "feel of a height map, of a bundled texture by its name, or of the result of a run (its folder)",
            "TEXTURE",
            read=Path,
            exclusive="goal",
        ),
    ] = None
    roughness: Annotated[
        float | None, Option("roughness V of the sides", "V", (0.0, 1.0), exclusive="goal")
    ] = None
    jnd: Annotated[
        float | None,
        Option(
            "just-noticeable differences, + rougher or - smoother, from the fuzzy skin that FILE has",
            "N",
            (-20.0, 20.0),
            exclusive="goal",
        ),
    ] = None
    relief_mm: Annotated[float | None, relief_option("the header of TEXTURE")] = None
    slicer: Annotated[
        str | None, Option("program that slices PART five times", "PROGRAM", default="prusa-slicer, if there")
    ] = None
    skin: Annotated["Skin | str | Path", skin_option(DEFAULT_SKIN)] = DEFAULT_SKIN
