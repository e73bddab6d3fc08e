"""What is being made, as values: the picture and how it becomes heights, and the feel to reach.

A document knows nothing of pages or processes. Each part states the options of the command that do the same,
so that what the app does and what it shows to copy are one.
"""

import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from mitsuba_scenes import find_texture
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.run_options import run_options, run_overrides
from relief.ground.options import Declared, declared, literal, words
from relief.preparing.choices import PrepareOptions
from retouch.verbs.objects.wrap_options import WrapOptions
from tactile.quantities import Quantity, goal_keys

Tile = Literal["auto", "blend", "cut"]
Start = Annotated[int, Field(ge=0, lt=1 << 31)]
Length = Annotated[int, Field(ge=1, lt=1 << 31)]
Crop = tuple[Start, Start, Length, Length]
Finite = Annotated[float, Field(allow_inf_nan=False)]

USUAL_RELIEF_MM = 0.8
"""Relief where the file of a picture states none, mm: what docs/howto/height-maps.md advises for fine
textures."""
MOST_JND = 6.0
"""Largest change of the feel that can be chosen, JND."""
JND, FEEL_OF = "jnd", "feel_of"
"""Goals that are no factors: a change of the roughness, and another texture's feel."""
USUAL_JND, USUAL_FACTOR = 2.0, 0.8
"""Numbers of the goals until others are chosen: just-noticeable differences, and a factor."""


def goals() -> dict[str, Quantity]:
    """Goals that are a number relative to the original's feel: their keys of `[touch]`, with the quantities.

    All but `JND` are factors on the original's value.
    """
    return {goal: quantity for goal, (quantity, key) in goal_keys().items() if key.relative}


def _goal(name: str) -> str:
    """The name of a goal that can be chosen. Raises ValueError."""
    if name != FEEL_OF and name not in goals():
        raise ValueError(f"{name}: no goal")
    return name


def usual_numbers() -> dict[str, float]:
    """The numbers of all goals until others are chosen."""
    return {goal: USUAL_JND if goal == JND else USUAL_FACTOR for goal in goals()}


@dataclass(frozen=True)
class PictureChoice:
    """A picture, and how it becomes heights; fields are arguments of `retouch.prepare`.

    Attributes:
        file: path of the picture, or name of a bundled texture.
        crop: x, y, width and height, pixels; None for the whole.
        rotate: degrees anticlockwise, 0, 90, 180 or 270.
        fill: whether what was not measured is filled from around.
        relief_mm, size_mm: None: as the file's header says.
    """

    file: str
    crop: Crop | None = None
    rotate: int = 0
    invert: bool = False
    tile: Tile | None = None
    samples: int | None = None
    fill: bool = False
    relief_mm: Finite | None = None
    size_mm: Finite | None = None

    def arguments(self) -> dict[str, Any]:
        """Keywords of `retouch.prepare`."""
        names = ("crop", "rotate", "invert", "tile", "samples", "fill", "relief_mm", "size_mm")
        return {name: getattr(self, name) for name in names}

    def command(self, out: str) -> list[str]:
        """The arguments of the command that makes the height map, after `retouch`."""
        crop = [] if self.crop is None else [f"--crop={','.join(map(str, self.crop))}"]
        others = PrepareOptions(**self.arguments() | {"crop": None})
        return ["prepare", self.file, "-o", out, *crop, *words(others)]


@dataclass(frozen=True)
class Wish:
    """What a draft is made for: the finger, a goal, and its number or whose feel it is."""

    skin: str
    goal: str
    value: float | str


@dataclass(frozen=True)
class FeelChoice:
    """The feel to reach, and how it is made.

    Attributes:
        goal: what is to be reached: `FEEL_OF`, or a key of `goals`.
        numbers: of each key of `goals`: just-noticeable differences by which the result is to be rougher (+)
            or smoother (-), or a factor on the original's value. In a file they lie beside the other fields.
        feel_of: a bundled texture, or the folder of a run whose result is meant.
        region: file of a mask whose grey is the share of the way from the original's feel to the goal; None:
            the goal holds all over.
        skin: name of the finger.
        fast: whether each step is computed with the fast models.
        printer: name of the printer whose relief is made; None for none.
        settings: further `KEY=VALUE` of the command's `--set`.
    """

    goal: Annotated[str, AfterValidator(_goal)] = JND
    numbers: Mapping[str, Finite] = field(default_factory=usual_numbers)
    feel_of: str = "brick"
    region: str | None = None
    skin: str = DEFAULT_SKIN
    fast: bool = True
    printer: str | None = None
    settings: tuple[str, ...] = ()

    def number(self) -> float | None:
        """The number of the goal; None where the goal is another texture."""
        return None if self.goal == FEEL_OF else self.numbers[self.goal]

    def wish(self) -> Wish | None:
        """What a draft is to reach; None where nothing changes, or where it varies over the surface."""
        number = self.number()
        if number is None:
            return Wish(self.skin, FEEL_OF, self.feel_of)
        as_it_is = 0.0 if self.goal == JND else 1.0
        return None if self.region is not None or number == as_it_is else Wish(self.skin, self.goal, number)

    def sentence(self) -> str:
        """What is to be reached, in a sentence."""
        number = self.number()
        if number is None:
            goal = f"As rough as {self.feel_of}"
        elif self.goal == JND:
            goal = f"{abs(number):g} JND {'rougher' if number > 0 else 'smoother'} than the original"
        else:
            goal = f"{number:g} of the original's {goals()[self.goal].label}"
        where = "all over" if self.region is None or number is None else "where it is painted"
        made = "" if self.printer is None else f", as printed by {self.printer}"
        return f"{goal}, {where}, to the finger {self.skin}{made}."

    def command(self, heights: str, out: str) -> list[str]:
        """The arguments of the command that runs, after `retouch`."""
        settings = [word for setting in (*self._region(), *self.settings) for word in ("--set", setting)]
        return ["optimize", heights, "-o", out, *words(run_options()(**self._options())), *settings]

    def overrides(self) -> list[str]:
        """The same as overrides of a run file, for `retouch.run_from_scene`."""
        options = self._options()
        # A folder of a run stays one: its run knows more of its result than the file of the heights.
        if (other := options.get(FEEL_OF)) and not Path(other).is_dir():
            options[FEEL_OF] = find_texture(other)
        return [*self._region(), *run_overrides(options), *self.settings]

    def _options(self) -> dict[str, Any]:
        """Options of a run that are given, by name."""
        skin = None if self.skin == DEFAULT_SKIN else self.skin
        options: dict[str, Any] = {"skin": skin, "printer": self.printer, "fast": self.fast or None}
        if self.goal == FEEL_OF:
            options[FEEL_OF] = self.feel_of
        elif self.region is None:
            options[self.goal] = self.number()
        return {name: value for name, value in options.items() if value is not None}

    def _region(self) -> list[str]:
        """The override of a goal that holds where the mask is painted."""
        if self.region is None or self.goal == FEEL_OF:
            return []
        mask, number = literal(self.region), self.number()
        return [f"touch.region=[{{mask = {mask}, {self.goal} = {number!r}, graded = true}}]"]

    def as_json(self) -> dict[str, Any]:
        """The fields as they are kept in a file."""
        content = asdict(self)
        return {**content.pop("numbers"), **content}


def _gathered(content: Any) -> Any:
    """The fields of a file, with the numbers of the goals in one."""
    if not isinstance(content, dict):
        return content
    numbers = usual_numbers() | {goal: content[goal] for goal in goals() if goal in content}
    return {**content, "numbers": numbers}


KeptFeel = Annotated[FeelChoice, BeforeValidator(_gathered)]
"""A feel as it is kept in a file."""


def object_options() -> dict[str, Declared]:
    """Options of `retouch wrap` that the page offers, by name."""
    return {name: one for name, one in declared(WrapOptions).items() if one.option.label}


@dataclass(frozen=True)
class ObjectChoice:
    """An object, and how a texture lies on it.

    Attributes:
        mesh: file, or name of a bundled object.
        options: those of `object_options` that are chosen. In a file they lie beside the mesh.
    """

    mesh: str = "starfish"
    options: Mapping[str, Any] = field(default_factory=dict)

    def command(self, texture: str, file: str) -> list[str]:
        """The arguments of the command that wraps, after `retouch`; `file` is a mesh, or a preview's page."""
        out = "--preview" if file.endswith(".html") else "-o"
        return ["wrap", texture, self.mesh, out, file, *words(WrapOptions(**self.options))]

    def as_json(self) -> dict[str, Any]:
        """The fields as they are kept in a file."""
        return {"mesh": self.mesh} | {name: self.options.get(name) for name in object_options()}


@dataclass(frozen=True)
class PrintChoice:
    """How the result of a run is written for a printer; fields are as of `retouch.export`.

    Attributes:
        suffix: of the file, which is its format.
        repeat: how often a tile is repeated along either side.
    """

    suffix: str = ".3mf"
    base_mm: float | None = None
    repeat: int = 1
    printer: str | None = None

    def file(self, run: str) -> str:
        """The file of a run."""
        return f"{run}-print{self.suffix}"

    def arguments(self) -> dict[str, Any]:
        """Keywords of `retouch.export`."""
        return {"base_mm": self.base_mm, "repeat": (self.repeat, self.repeat), "printer": self.printer}

    def command(self, run: str) -> list[str]:
        """The arguments of the command that writes the file, after `retouch`."""
        words = ["export", run, "-o", self.file(run)]
        words += [] if self.base_mm is None else ["--base-mm", f"{self.base_mm:g}"]
        words += ["--repeat", f"{self.repeat}x{self.repeat}"] if self.repeat > 1 else []
        return words + ([] if self.printer is None else ["--printer", self.printer])


def _object_of(content: Any) -> Any:
    """The fields of a file, with the options in one; what an option cannot be raises ValueError."""
    if not isinstance(content, dict):
        return content
    options = object_options()
    chosen = {name: content[name] for name in options if content.get(name) not in (None, "")}
    for name, value in chosen.items():
        chosen[name] = value = float(value) if type(value) is int else value
        if type(value) is not options[name].type:
            raise ValueError(f"{name}: {value!r} is not of its type")
        options[name].check(value)
    chosen = {name: value for name, value in chosen.items() if value != options[name].value}
    others = {key: value for key, value in content.items() if key not in options}
    return {**others, "options": chosen}


KeptObject = Annotated[ObjectChoice, BeforeValidator(_object_of)]
"""An object as it is kept in a file."""


@dataclass(frozen=True)
class AppDocument:
    """All that a person has chosen.

    Attributes:
        picture: None until one is chosen.
        part: the object that the result is to lie on.
        run: folder of the run that is looked at; None until there is one.
    """

    picture: PictureChoice | None = None
    feel: KeptFeel = field(default_factory=FeelChoice)
    part: KeptObject = field(default_factory=ObjectChoice)
    run: str | None = None

    def as_json(self) -> dict[str, Any]:
        """The document as it is kept in a file."""
        return asdict(self) | {"feel": self.feel.as_json(), "part": self.part.as_json()}


def command_line(words: list[str]) -> str:
    """A line for a shell."""
    return shlex.join(["retouch", *words])
