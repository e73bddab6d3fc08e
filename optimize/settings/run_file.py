"""Run files: the settings of one optimisation in TOML, checked before any work begins."""

import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import tomli_w
from pydantic import Field, ValidationError, field_validator, model_validator

from mitsuba_scenes import find_file
from optimize.descent.methods import METHODS, StopRule, methods_that_take
from optimize.settings.look import Look, Verify
from optimize.settings.printing import Print
from optimize.settings.run_paths import anchor, resolve_result
from optimize.settings.skins import fill_in
from optimize.settings.toml_files import NotNegative, Positive, Section, first_fault, one_of, read_toml
from optimize.settings.touch import RIVALS, Touch, too_large
from relief.common.errors import InputError, naming
from relief.common.limits import (
    LARGEST_HEIGHT_SCALE,
    LARGEST_PLATE_MM,
    LARGEST_RELIEF_MM,
    SMALLEST_PLATE_MM,
    SMALLEST_RELIEF_MM,
)
from relief.surface import Repeats, axes

if TYPE_CHECKING:
    from relief.relief import Relief

DEEPEST = 8
"""Most sections in one another of a key for `--set`; run files have one."""
FilePath = Annotated[Path, Field(strict=False)]

PAPER_TOLERANCE = 0.1
"""Tolerance of the paper's stopping rule (section 4.1): half of what a finger just notices."""
UNABLE = {
    "look.masking": "look.masking: {method} has no weights by contrast; {others} has",
    "touch.fingers": "touch.fingers: {method} steers one finger; {others} a range",
    "print.printer": "print: {method} makes no whole layers; {others} does",
}
"""What a method that does not take a key is unable to do."""
LARGEST_SMOOTHING = 1e6
"""Largest lambda: steps then divide waves as long as 512 samples by 151; hardly a sample moves alone."""


class DescentSettings(Section):
    """`[descent]`: the method and its settings.

    Attributes:
        method: of the descent; "scaling", the original scaled in height and then sideways, to compare with.
        steps: largest number of steps.
        tolerance: largest relative error of a target that counts as met.
        shadow_edges: whether gradients of pictures follow moving shadows.
        learning_rate: Adam's, mm; the paper's value.
        growth: of the weight of the targets over Adam's steps, as a factor; 1, the paper's: constant.
        smoothing: lambda of the smoothed metric of Adam's steps; 0, the paper's: sample by sample.
        stop: when Adam stops: "schedule", after all its steps; "paper", at the paper's bounds.
        regularisation: w2.
    """

    method: Annotated[str, one_of(METHODS)] = "gauss-newton"
    steps: Annotated[int, Field(ge=1, le=100_000)] = 100
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 0.01
    shadow_edges: bool = True
    learning_rate: Positive = 0.027
    growth: Annotated[float, Field(ge=1, le=1e6)] = 30.0
    smoothing: Annotated[float, Field(ge=0, le=LARGEST_SMOOTHING)] = 0.0
    stop: StopRule = "schedule"
    regularisation: NotNegative = 0.06

    @model_validator(mode="before")
    @classmethod
    def _as_the_paper(cls, section: Any) -> Any:
        """The paper's stopping rule comes with its own tolerance and constant weights, unless given."""
        if isinstance(section, dict) and section.get("stop") == "paper":
            return {"tolerance": PAPER_TOLERANCE, "growth": 1.0} | section
        return section


class Run(Section):
    """The settings of one run.

    Attributes:
        scene, texture: files; absolute paths once loaded.
        size_mm: width of the plate, mm; by default that of the texture's header, else that of the scene.
        relief_mm: height of white above black, mm, in a picture; by default that of its header.
        height_scale: mm for a height of 1 in a file that holds heights; without meaning for pictures.
        repeats: whether the relief goes on as itself beyond its rim: along both axes, or along "x" or "y".
        seed: of all random numbers.
        define: values of the scene's parameters, by name.
        touch, look, descent, verify, print: the sections of the run file.
    """

    scene: FilePath
    texture: FilePath
    size_mm: Annotated[float, Field(ge=SMALLEST_PLATE_MM, le=LARGEST_PLATE_MM)] | None = None
    relief_mm: Annotated[float, Field(ge=SMALLEST_RELIEF_MM, le=LARGEST_RELIEF_MM)] | None = None
    height_scale: Annotated[float, Field(ge=1.0 / LARGEST_HEIGHT_SCALE, le=LARGEST_HEIGHT_SCALE)] = 1.0
    repeats: Repeats = False
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    define: Mapping[str, str] = {}
    touch: Touch
    look: Look = Look()
    descent: DescentSettings = DescentSettings()
    verify: Verify = Verify()
    print: Print = Print()

    @property
    def axes_repeat(self) -> tuple[bool, bool]:
        """Whether the relief repeats along y (rows) and along x (columns)."""
        return axes(self.repeats)

    def design(self, plate_mm: float) -> "Relief":
        """The relief of the texture before a printer makes it. Raises InputError.

        Args:
            plate_mm: width of the scene's plate, for a texture of unknown width.
        """
        # Imported here: a run file is checked before anything heavy is loaded.
        from relief.relief import Relief

        return Relief.read(
            self.texture,
            size_mm=self.size_mm,
            relief_mm=self.relief_mm,
            height_scale=self.height_scale,
            repeats=self.repeats,
            default_mm=plate_mm,
        )

    def check_texture(self) -> None:
        """Read the texture, so that its faults are told before anything slow begins. Raises InputError."""
        # Imported here, as for `design`.
        from relief.heightmap import load_field, load_height_map

        if self.relief_mm is None:
            load_height_map(self.texture, height_scale=self.height_scale)
        else:
            load_field(self.texture)

    def relief(self, plate_mm: float) -> "Relief":
        """The relief that the run begins with: its design, or the print of it. Raises InputError."""
        design, printer = self.design(plate_mm), self.print.described
        return design if printer is None else design.printed(printer)

    def files(self) -> dict[str, Path]:
        """The files that the run reads, by their dotted keys."""
        return {"scene": self.scene, "texture": self.texture, **self.touch.maps()}

    @field_validator("define", mode="before")
    @classmethod
    def _as_text(cls, define: Any) -> Any:
        """Scene parameters are text; numbers need no quotes in a run file."""
        if not isinstance(define, dict):
            return define
        return {
            key: str(value).lower() if isinstance(value, bool) else str(value)
            for key, value in define.items()
        }

    @model_validator(mode="after")
    def _by_the_method(self) -> Self:
        stated = {
            "look.masking": self.look.masking > 0.0,
            "touch.fingers": self.touch.fingers == "range",
            "print.printer": self.print.printer is not None,
        }
        method = self.descent.method
        for key, fault in UNABLE.items():
            if stated[key] and key not in METHODS[method].takes:
                raise ValueError(fault.format(method=method, others=" or ".join(methods_that_take(key))))
        return self

    @model_validator(mode="after")
    def _goals_fit_the_plate(self) -> Self:
        size_mm = LARGEST_PLATE_MM if self.size_mm is None else self.size_mm
        for quantity, key, goal in self.touch.goals():
            if not key.relative and goal > quantity.largest(size_mm):
                raise ValueError(f"touch.{key.key}: {too_large(quantity, goal, size_mm)}")
        return self


def load_run(path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Run:
    """Read a run file.

    Args:
        path: the file, or the name of a bundled one. Relative paths in the file are relative to its folder.
        overrides: `key=value` with a dot between section and key, the value as in TOML; bare words count as
            strings. Relative paths are relative to the working directory.

    Raises:
        InputError: one line that names the file and the key.
    """
    path = find_file(path, ".toml")
    values = read_toml(path)
    anchor(values, path.parent)
    return _run(path, values, overrides)


def run_from_scene(
    scene: str | os.PathLike[str], texture: str | os.PathLike[str], overrides: Sequence[str] = ()
) -> Run:
    """The run of a scene and a texture; everything else by overrides or default.

    Args:
        scene: the file, or the name of a bundled one.
        texture: height map, or the name of a bundled one.
        overrides: as for `load_run`; one of them states a goal.

    Raises:
        InputError: one line that names the file and the key.
    """
    values: dict[str, Any] = {"scene": os.fspath(scene), "texture": os.fspath(texture)}
    anchor(values, Path.cwd())
    return _run(Path(scene), values, overrides)


def dump_resolved(run: Run) -> str:
    """The run as TOML with defaults and absolute paths, which loads to the same run from any folder."""
    return tomli_w.dumps(run.model_dump(mode="json", exclude_none=True))


def _run(path: Path, values: dict[str, Any], overrides: Sequence[str]) -> Run:
    touch = values.get("touch")
    for override in overrides:
        for rival in RIVALS.get(override.partition("=")[0].strip(), ()):
            if isinstance(touch, dict):
                touch.pop(rival, None)
    if any(override.partition("=")[0].strip() == "print.printer" for override in overrides):
        # Another printer has other numbers.
        values["print"] = {}
    for override in overrides:
        _override(values, override)
    if isinstance(touch := values.get("touch"), dict):
        with naming(f"{path}: touch.skin"):
            fill_in(touch)
        with naming(f"{path}: touch.feel_of"):
            resolve_result(touch)
    try:
        run = Run.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: {first_fault(error, Run)}") from error
    for key, file in run.files().items():
        if not os.path.isfile(file):
            raise InputError(f"{path}: {key}: {file}: no such file")
    return run


def run_keys() -> dict[str, Any]:
    """Every key that a run file may have, dotted, and its default; PydanticUndefined where there is none.

    A key of `define` is any parameter of the scene; `define` stands for all.
    """
    keys: dict[str, Any] = {}
    for name, field in Run.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            within = field.annotation.model_fields
            keys |= {f"{name}.{part}": within[part].get_default() for part in within}
        else:
            keys[name] = field.get_default()
    return keys


def _override(values: dict[str, Any], override: str) -> None:
    name, equals, text = override.partition("=")
    keys = [key.strip() for key in name.split(".")]
    if not equals or not all(keys) or len(keys) > DEEPEST:
        raise _in_override(override[:80], "expected key=value, as in touch.roughness=0.07")
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        parsed = {"value": text.strip()}
    if parsed.keys() != {"value"}:
        raise _in_override(override, "one value is expected")
    section = values
    for key in keys[:-1]:
        section = section.setdefault(key, {})
        if not isinstance(section, dict):
            raise _in_override(override, f"{key} is not a section")
    key = ".".join(keys)
    setting = {key: parsed["value"]}
    anchor(setting, Path.cwd())
    section[keys[-1]] = setting[key]


def _in_override(override: str, fault: str) -> InputError:
    return InputError(f"overrides: {override}: {fault}", f"--set {override}: {fault}")
