"""Skins of runs: the keys that describe a finger, and files that give them a name."""

import os
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from mitsuba_scenes.fingers import DEFAULT_SKIN, bundled_skins, find_skin
from optimize.settings.toml_files import Positive, Section, first_fault, read_toml
from relief.ground.errors import InputError
from tactile.skin import LARGEST_THICKNESS_MM, MAX_POISSON_RATIO, Shape, Skin

OWN = "own"
"""Name of a skin whose values are not all those of a file."""

Layer = Annotated[tuple[Positive, Positive], Field(strict=False)]
"""Thickness in mm and modulus in MPa of a layer: a list in TOML, which strict tuples would not take."""


class SkinKeys(Section):
    """The keys of a skin file, which `[touch]` of a run file has as well.

    Attributes:
        young_modulus_mpa: Young's modulus of the skin, MPa; with layers, that of the base below them.
        poisson_ratio: Poisson's ratio of the skin; 0.5 would be incompressible.
        force_n: normal force of the finger, N.
        thickness_mm: thickness of the skin over the bone, mm.
        depth_mm: depth of the receptors below the surface, mm, less than the thickness.
        layers: up to 8 layers above the base, from the surface down, each [thickness in mm, modulus in MPa]:
            at least 0.02 mm, and between a thousandth and a thousand times as stiff as the base.
        shape: flat and square, or a round fingerpad on a round bone.
        radius_mm: radius of a round finger along its length, the relief's y axis, mm, 3 to 100.
        across_mm: radius of a round finger across it, mm, 3 to 100; by default as along.
    """

    young_modulus_mpa: Positive = 0.5
    poisson_ratio: Annotated[float, Field(ge=0, le=MAX_POISSON_RATIO)] = 0.48
    force_n: Positive = 10.0
    thickness_mm: Annotated[float, Field(gt=0, le=LARGEST_THICKNESS_MM)] = 2.5
    depth_mm: Positive = 0.75
    layers: Annotated[tuple[Layer, ...], Field(strict=False)] = ()
    shape: Shape = "flat"
    radius_mm: Positive | None = None
    across_mm: Positive | None = None

    @property
    def finger(self) -> Skin:
        """The skin that the keys describe."""
        return Skin(**{name: getattr(self, name) for name in SKIN_KEYS})

    @model_validator(mode="after")
    def _depth_and_layers_within_thickness(self) -> Self:
        try:
            _ = self.finger
        except InputError as error:
            raise ValueError(str(error).removeprefix("skin.")) from None
        return self


SKIN_KEYS = tuple(SkinKeys.model_fields)
"""Keys that describe a finger; overriding the skin replaces them all."""
ALWAYS = tuple(name for name, key in SkinKeys.model_fields.items() if key.default is not None)
"""Keys that every complete description has; files leave out what is None."""


def load_skin(name: str | os.PathLike[str] = DEFAULT_SKIN) -> Skin:
    """A skin by the name of a bundled one, or by the path of a file with the keys of `SkinKeys`.

    Raises:
        InputError: one line that names file and key.
    """
    return _read(find_skin(name)).finger


def described_skin(skin: Skin, name: str) -> dict[str, Any]:
    """A skin as result.json and `--json` report it: its name, without folder and suffix, and its values."""
    return {"name": Path(name).stem, **skin.described()}


def skin_anchored(name: str, folder: Path) -> str:
    """A skin's path as an absolute one, relative ones from ``folder``; a bundled or empty name as it is."""
    if not name:
        return name
    file = folder / name
    bundled = name.removesuffix(".toml")
    return bundled if bundled in bundled_skins() and not os.path.isfile(file) else os.path.abspath(file)


def fill_in(touch: dict[str, Any]) -> None:
    """Give a section `[touch]` the values of its skin for the keys that it lacks.

    A section with all keys stays as it is, so that a run goes on without the file of its skin. If a value of
    the section differs from the skin's, the skin is called "own".

    Raises:
        InputError: one line that names the skin's file and the key.
    """
    name = touch.get("skin", DEFAULT_SKIN)
    own = {key: touch[key] for key in SKIN_KEYS if key in touch}
    # A name that is no text is a fault that the check of the section reports.
    if not isinstance(name, str) or own.keys() >= set(ALWAYS) or name == OWN:
        return
    file = _read(find_skin(name)).model_dump(mode="json")
    touch |= file | own
    touch["skin"] = name if all(file[key] == value for key, value in own.items()) else OWN


def _read(file: Path) -> SkinKeys:
    try:
        return SkinKeys.model_validate(read_toml(file))
    except ValidationError as error:
        raise InputError(f"{file}: {first_fault(error, SkinKeys)}") from error
