"""Requests for plates of textures: textures, settings and print, and the file in the folder that says so."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import tomli_w
from pydantic import Field, ValidationError, model_validator

from optimize.settings.printing import Print
from optimize.settings.toml_files import Section, first_fault, read_toml
from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.lengths import Lengths
from relief.ground.limits import BASE_MM, LARGEST_PLATE_MM, PATCH_SIDE_MM
from relief.printers import WITH_SUPPORT, Printer
from relief.relief import Relief
from relief.seam import check_seams, misfit
from relief.solids.export.bed import places_on_beds

TILE = "-tile"
"""End of the name of a texture that labels leave out."""
MOST_TEXTURES = 64
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


class PlateSet(Section):
    """What a folder of plates holds.

    Attributes:
        textures: tiles; absolute.
        settings: of every run, by dotted keys.
        print: the plates.
    """

    FILE: ClassVar[str]
    """The request, in the folder."""
    KIND: ClassVar[str]
    """What the folder holds, in words."""
    FREE: ClassVar[tuple[str, ...]] = ("print",)
    """Fields that may differ from those of the request in the folder."""

    textures: Annotated[tuple[FilePath, ...], Field(strict=False, min_length=1, max_length=MOST_TEXTURES)]
    settings: dict[str, str | int | float | bool] = Field(default_factory=dict)
    print: PrintSettings = PrintSettings()

    @classmethod
    def checked(cls, values: Mapping[str, Any], file: Path | None = None) -> Self:
        """A request of these fields, which a file holds if it is given. Raises InputError."""
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise InputError(f"{file or cls.KIND}: {first_fault(error, cls)}") from error

    @classmethod
    def read(cls, path: Path) -> Self:
        """The request of a file. Raises InputError."""
        if not path.is_file():
            raise InputError(f"{path}: no such file; the folder holds no {cls.KIND}")
        return cls.checked(read_toml(path), path)

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
    def _settings_are_not_the_set_s_own(self) -> Self:
        for key in self.settings:
            if key.startswith(OWN_KEYS):
                raise ValueError(f"settings: {key}: is no setting of a set, whose plates are its own")
        return self

    @model_validator(mode="after")
    def _can_be_printed(self) -> Self:
        try:
            self.printer  # noqa: B018
        except ValidationError as error:
            raise ValueError(f"settings: {OF_PRINTER}{first_fault(error, Print)}") from error
        return self

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        for name in self.names:
            if self.names.count(name) > 1:
                raise ValueError(f"textures: two are called {name}, as their plates would be")
        return self

    def relief_of(self, texture: Path) -> Relief:
        """A texture with the lengths of the set, as a plate. Raises InputError."""
        lengths = {key: self.settings.get(key) for key in Lengths.__annotations__}
        return Relief.read(texture, **lengths, repeats=False)  # type: ignore[arg-type]

    def check_textures(self) -> None:
        """Check that each texture is a tile. Raises InputError."""
        for texture in self.textures:
            relief = self.relief_of(texture)
            beside = texture.with_name(f"{texture.stem}{TILE}{texture.suffix}")
            if beside.is_file() and misfit(relief.heights):
                raise InputError(f"{texture}: is no tile, but {beside.stem} beside it is: name that one")
            check_seams(relief.heights, (True, True), texture)


def claim(out: Path, request: PlateSet) -> None:
    """Write a request into its folder; only what is free may differ from a request there.

    Raises:
        InputError: the folder holds something else.
    """
    path = out / request.FILE
    if path.is_file():
        there, mine = (vars(one) for one in (request.read(path), request))
        if other := [name for name in mine if there[name] != mine[name] and name not in request.FREE]:
            raise InputError(
                f"{out}: holds a {request.KIND} with other {', '.join(other)}; choose another -o"
            )
    elif out.is_dir() and os.listdir(out):
        raise InputError(f"{out}: holds files that are no {request.KIND}'s; choose another -o")
    write_atomically(path, tomli_w.dumps(request.model_dump(mode="json", exclude_none=True)).encode())
