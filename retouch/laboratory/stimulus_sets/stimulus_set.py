"""The request of a stimulus set: what `set.toml` in its folder holds, checked before any work begins."""

import hashlib
import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from optimize.settings.toml_files import Positive, Section
from relief.ground.errors import InputError
from retouch.laboratory.stimulus_sets.plate_set import FilePath, PlateSet

FILE = "set.toml"
"""The request, in the folder of the set."""
MOST_LEVELS, MOST_CONTROLS = 32, 16
MOST_PEOPLE, MOST_PAIRS = 300, 1000
"""Most people of a plan, and most pairs of one person: three hours."""

CODE = ("BDFGKLMNPRTVZ", "AEIOU") * 2
"""Letters of a code in turn, which can be spoken."""

Levels = Annotated[tuple[float, ...], Field(strict=False, max_length=MOST_LEVELS)]


class Experiment(Section):
    """`[experiment]`: the plan of the trials with people.

    Attributes:
        people: number of them.
        pairs: most pairs of each question that a person compares; about 10 s each.
        seed: of the random order.
        codes: whether codes stand for the names of the plates, on their backs too, so that nobody reads a
            level.
    """

    people: Annotated[int, Field(ge=1, le=MOST_PEOPLE)] = 8
    pairs: Annotated[int, Field(ge=2, le=MOST_PAIRS)] = 120
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    codes: bool = False

    def code_of(self, label: str) -> str:
        """Four letters that stand for a label and do not depend on the other plates; empty without codes."""
        digits = hashlib.sha256(label.encode()).digest()[: len(CODE)] if self.codes else b""
        return "".join(letters[digit % len(letters)] for letters, digit in zip(CODE, digits, strict=False))


class StimulusSet(PlateSet):
    """`set.toml`.

    Attributes:
        textures: tiles, or as large as a plate where `whole` is set; absolute.
        jnd: levels of roughness, just-noticeable differences from each texture; 0 is the texture itself.
        contact_area_scale: levels of contact area in units of each texture's own.
        same_roughness: whether levels of contact area keep the roughness of their texture.
        whole: whether textures are no tiles, and each plate is optimised as a whole.
        with_scaled: whether each level of roughness is also made by scaling the heights.
        sources: for each texture the picture that it was cut from, for controls; or none at all.
        source_mm: width of each of these pictures, mm; None: as their headers say.
        controls: number of other patches of each picture.
        experiment: the plan of trials with people.
    """

    FILE = FILE
    KIND = "stimulus set"
    FREE = ("print", "experiment")

    jnd: Levels
    contact_area_scale: Levels = ()
    same_roughness: bool = False
    whole: bool = False
    with_scaled: bool = False
    sources: Annotated[tuple[FilePath, ...], Field(strict=False)] = ()
    source_mm: Positive | None = None
    controls: Annotated[int, Field(ge=1, le=MOST_CONTROLS)] = 3
    experiment: Experiment = Experiment()

    @model_validator(mode="after")
    def _levels_differ(self) -> Self:
        if len(self.jnd) + len(self.contact_area_scale) < 2:
            raise ValueError("jnd: at least two levels are needed to tell apart, as in -1,0,1")
        for key, levels in (("jnd", self.jnd), ("contact_area_scale", self.contact_area_scale)):
            for level in levels:
                if levels.count(level) > 1:
                    raise ValueError(f"{key}: {level:g} is given twice")
                if not math.isfinite(level):
                    raise ValueError(f"{key}: {level:g} is not a finite number")
        if self.same_roughness and not self.contact_area_scale:
            raise ValueError("same_roughness: is for levels of contact area, which are missing")
        for level in self.contact_area_scale:
            if not level > 0.0 or level == 1.0:
                raise ValueError(
                    f"contact_area_scale: {level:g} is no level: give numbers above 0 other than 1"
                )
        return self

    @model_validator(mode="after")
    def _others_fit(self) -> Self:
        if self.printer is not None and self.with_scaled:
            raise ValueError("with_scaled: scaling makes no whole layers; leave it or the printer out")
        if self.sources and len(self.sources) != len(self.textures):
            raise ValueError("sources: one picture for each texture is needed, in their order")
        return self

    def check_textures(self) -> None:
        """Check that each texture is a tile, or as large as a plate. Raises InputError."""
        if not self.whole:
            super().check_textures()
            return
        for texture in self.textures:
            if min(self.relief_of(texture).surface.size_mm) < self.print.plate_mm:
                raise InputError(f"{texture}: whole: is smaller than a plate of {self.print.plate_mm:g} mm")
