"""The request of a stimulus set: what `set.toml` in its folder holds, checked before any work begins."""

import math
import os
from pathlib import Path
from typing import Annotated, Literal, Self

import tomli_w
from pydantic import Field, ValidationError, model_validator

from optimize.settings.printing import Print
from optimize.settings.toml_files import Positive, Section, first_fault, read_toml
from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.lengths import Lengths
from relief.ground.limits import BASE_MM, LARGEST_PLATE_MM, PATCH_SIDE_MM
from relief.printers import WITH_SUPPORT, Printer
from relief.relief import Relief
from relief.seam import check_seams, misfit
from relief.solids.export.bed import places_on_beds

FILE = "set.toml"
"""The request, in the folder of the set."""
TILE = "-tile"
"""End of the name of a texture that labels leave out."""
MOST_TEXTURES, MOST_LEVELS, MOST_CONTROLS = 64, 32, 16
MOST_PEOPLE, MOST_PAIRS = 300, 1000
"""Most people of a plan, and most pairs of one person: three hours."""
PLATE_MM = 25.0
"""Side of a plate, mm: that of the paper's experiments (5.3.1)."""
BED_MM = (120.0, 68.0)
"""Sides of the bed, mm: those of a common resin printer."""
OWN_KEYS = (
    *("scene", "texture", "repeats", "descent.method"),
    *("touch.jnd", "touch.roughness", "touch.contact", "touch.feel_of", "touch.region", "touch.axis"),
)
"""Begins of the keys of a run that a set states itself, or that its plates do not follow."""
OF_PRINTER = "print."
"""Begin of the keys of a run that describe its printer."""
LABEL_MM = 0.4
"""How far labels stand out of the back or go into it, mm."""

FilePath = Annotated[Path, Field(strict=False)]
Length = Annotated[float, Field(gt=0, le=LARGEST_PLATE_MM)]
Levels = Annotated[tuple[float, ...], Field(strict=False, max_length=MOST_LEVELS)]


class PrintSettings(Section):
    """`[print]`: the plates.

    Attributes:
        plate_mm: side of a plate, mm, at least that of the patch under a finger.
        base_mm: thickness of the lowest plate under the height 0, mm.
        bed_mm: sides of the printer's bed along x and y, mm.
        label: how the names of the plates lie on their backs.
    """

    plate_mm: Length = PLATE_MM
    base_mm: Length = BASE_MM
    bed_mm: Annotated[tuple[Length, Length], Field(strict=False)] = BED_MM
    label: Literal["raised", "engraved", "none"] = "raised"

    @property
    def label_depth_mm(self) -> float | None:
        """By which labels stand out of the back, mm, negative if engraved; None: no labels."""
        return {"raised": LABEL_MM, "engraved": -LABEL_MM, "none": None}[self.label]

    @model_validator(mode="after")
    def _can_be_made(self) -> Self:
        if self.plate_mm < PATCH_SIDE_MM:
            raise ValueError(
                f"plate_mm: {self.plate_mm:g} mm is less than the {PATCH_SIDE_MM:g} mm under a finger"
            )
        if self.label == "engraved" and self.base_mm <= LABEL_MM:
            raise ValueError(f"base_mm: {self.base_mm:g} mm is too thin for labels {LABEL_MM:g} mm deep")
        places_on_beds(1, self.plate_mm, self.bed_mm)
        return self


class Experiment(Section):
    """`[experiment]`: the plan of the trials with people.

    Attributes:
        people: number of them.
        pairs: most pairs of each question that a person compares; about 10 s each.
        seed: of the random order.
    """

    people: Annotated[int, Field(ge=1, le=MOST_PEOPLE)] = 8
    pairs: Annotated[int, Field(ge=2, le=MOST_PAIRS)] = 120
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0


class StimulusSet(Section):
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
        settings: of every run, by dotted keys.
        print: the plates.
        experiment: the plan of trials with people.
    """

    textures: Annotated[tuple[FilePath, ...], Field(strict=False, min_length=1, max_length=MOST_TEXTURES)]
    jnd: Levels
    contact_area_scale: Levels = ()
    same_roughness: bool = False
    whole: bool = False
    with_scaled: bool = False
    sources: Annotated[tuple[FilePath, ...], Field(strict=False)] = ()
    source_mm: Positive | None = None
    controls: Annotated[int, Field(ge=1, le=MOST_CONTROLS)] = 3
    settings: dict[str, str | int | float | bool] = Field(default_factory=dict)
    print: PrintSettings = PrintSettings()
    experiment: Experiment = Experiment()

    @property
    def printer(self) -> Printer | None:
        """The printer whose prints the plates are, by the settings of the runs; None: plates are designs."""
        own = {
            key.removeprefix(OF_PRINTER): value
            for key, value in self.settings.items()
            if key.startswith(OF_PRINTER)
        }
        return Print.model_validate(own).described

    @property
    def label_advice(self) -> str | None:
        """Why other labels print better with the printer of the set; None if they do not."""
        printer = self.printer
        if self.print.label != "raised" or printer is None or printer.name in WITH_SUPPORT:
            return None
        hang = f"raised labels hold the backs {LABEL_MM:g} mm off the bed, where they hang without supports"
        return f"{hang}; engraved ones print better: --redraw --label engraved"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the textures, as labels have them."""
        return tuple(texture.stem.removesuffix(TILE) for texture in self.textures)

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
    def _settings_are_not_the_set_s_own(self) -> Self:
        for key in self.settings:
            if key.startswith(OWN_KEYS):
                raise ValueError(f"settings: {key}: is no setting of a set, whose plates are its own")
        return self

    @model_validator(mode="after")
    def _can_be_printed(self) -> Self:
        try:
            printer = self.printer
        except ValidationError as error:
            raise ValueError(f"settings: {OF_PRINTER}{first_fault(error, Print)}") from error
        if printer is not None and self.with_scaled:
            raise ValueError("with_scaled: scaling makes no whole layers; leave it or the printer out")
        return self

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        for name in self.names:
            if self.names.count(name) > 1:
                raise ValueError(f"textures: two are called {name}, as their plates would be")
        if self.sources and len(self.sources) != len(self.textures):
            raise ValueError("sources: one picture for each texture is needed, in their order")
        return self

    def relief_of(self, texture: Path) -> Relief:
        """A texture with the lengths of the set, as a plate. Raises InputError."""
        lengths = {key: self.settings.get(key) for key in Lengths.__annotations__}
        return Relief.read(texture, **lengths, repeats=False)  # type: ignore[arg-type]

    def check_textures(self) -> None:
        """Check that each texture is a tile, or as large as a plate. Raises InputError."""
        for texture in self.textures:
            relief = self.relief_of(texture)
            if not self.whole:
                beside = texture.with_name(f"{texture.stem}{TILE}{texture.suffix}")
                if beside.is_file() and misfit(relief.heights):
                    raise InputError(f"{texture}: is no tile, but {beside.stem} beside it is: name that one")
                check_seams(relief.heights, (True, True), texture)
                continue
            if min(relief.surface.size_mm) < self.print.plate_mm:
                raise InputError(f"{texture}: whole: is smaller than a plate of {self.print.plate_mm:g} mm")


def set_bytes(stimuli: StimulusSet) -> bytes:
    """A request as TOML."""
    return tomli_w.dumps(stimuli.model_dump(mode="json", exclude_none=True)).encode()


def read_set(path: Path) -> StimulusSet:
    """Read a request back. Raises InputError."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; the folder holds no stimulus set")
    try:
        return StimulusSet.model_validate(read_toml(path))
    except ValidationError as error:
        raise InputError(f"{path}: {first_fault(error, StimulusSet)}") from error


def claim(out: Path, stimuli: StimulusSet) -> None:
    """Write the request into the folder of a set; only print and experiment may differ from a set there.

    Raises:
        InputError: the folder holds another set.
    """
    path = out / FILE
    if path.is_file():
        there = read_set(path)
        free = {"print": stimuli.print, "experiment": stimuli.experiment}
        if there.model_copy(update=free) != stimuli:
            raise InputError(
                f"{out}: holds another set, of {', '.join(there.names)} at "
                f"{', '.join(f'{level:g}' for level in there.jnd)} JND; choose another -o"
            )
    elif out.is_dir() and os.listdir(out):
        raise InputError(f"{out}: holds files that are no stimulus set's; choose another -o")
    write_atomically(path, set_bytes(stimuli))
