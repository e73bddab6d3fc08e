"""Run files: the settings of one optimisation in TOML, checked before any work begins."""

import logging
import os
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import tomli_w
from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from mitsuba_scenes import find_file
from optimize.descent.methods import METHODS, StopRule, methods_that_take
from optimize.settings.effects import DECIDING, unable, without_effect
from optimize.settings.look import Look, Verify
from optimize.settings.printing import Print
from optimize.settings.run_paths import anchor, resolve_result
from optimize.settings.skins import fill_in
from optimize.settings.toml_files import NotNegative, Positive, Section, first_fault, one_of, read_toml
from optimize.settings.touch import RIVALS, Touch, too_large
from relief.ground.errors import InputError, naming
from relief.ground.lengths import RANGES, Lengths
from relief.ground.limits import LARGEST_PLATE_MM, PATCH_SIDE_MM
from relief.surface import Repeats, axes

if TYPE_CHECKING:
    from relief.relief import Relief

_log = logging.getLogger(__name__)

DEEPEST = 8
"""Most sections in one another of a key for `--set`; run files have one."""
FilePath = Annotated[Path, Field(strict=False)]
WITHIN = {key: Field(ge=lowest, le=highest) for key, (lowest, highest) in RANGES.items()}
"""Fields of lengths of a texture."""

PAPER_TOLERANCE = 0.1
"""Tolerance of the paper's stopping rule (section 4.1): half of what a finger just notices."""
SHARED = "shared"
"""Keys of the context of a validation that may be without effect, as in `load_run`."""
LARGEST_SMOOTHING = 1e6
"""Largest lambda: steps then divide waves as long as 512 samples by 151; hardly a sample moves alone."""


class DescentSettings(Section):
    """`[descent]`: the method and its settings.

    Attributes:
        method: optimiser: Gauss-Newton, the paper's Adam, or the baseline, which scales the original in
            height and then sideways.
        steps: largest number of steps.
        tolerance: largest relative error of a target that counts as met; 0.1 with the stopping rule "paper".
        shadow_edges: whether gradients of pictures include the boundary term of shadows.
        learning_rate: Adam's learning rate, mm; the default is the paper's.
        growth: factor by which the weight of the targets grows over Adam's steps; the paper's is 1, constant.
        smoothing: lambda of the smoothed metric of Adam's steps; the paper's is 0, sample by sample.
        stop: when Adam stops: after all its steps, or at the paper's bounds (targets within the tolerance,
            pictures within 2 % of white, root mean square).
        regularisation: w2, the weight of differences between neighbouring pixels of the change of the
            pictures.
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
        if not isinstance(section, dict) or section.get("stop") != "paper":
            return section
        # A method without stopping rules keeps its own tolerance; unknown names are left to their check.
        if section.get("method", cls.model_fields["method"].default) in methods_that_take("descent.stop"):
            return {"tolerance": PAPER_TOLERANCE, "growth": 1.0} | section
        return section


class Run(Section):
    """The settings of one run; once loaded, paths are absolute and `repeats` is not None.

    Attributes:
        scene: Mitsuba scene (.xml), or the name of a bundled one.
        texture: height map, or the name of a bundled one.
        size_mm: width of the plate, mm; by default that of the texture's header, else that of the scene.
        relief_mm: height of white above black, mm, in a picture; by default that of its header.
        height_scale: mm for a height of 1 in a file that holds numbers, by default the file's own unit or mm.
        fill: whether holes (samples that were not measured) are filled smoothly from around.
        level: whether the tilt of the texture, the plane by least squares, is taken out.
        repeats: whether the relief is a tile, along both axes or along one; by default as the texture's
            header says, else false.
        seed: seed of all random numbers.
        define: values of the scene's parameters, by name.
        touch, look, descent, verify, print: the sections of the run file.
    """

    scene: FilePath
    texture: FilePath
    size_mm: Annotated[float, WITHIN["size_mm"]] | None = None
    relief_mm: Annotated[float, WITHIN["relief_mm"]] | None = None
    height_scale: Annotated[float, WITHIN["height_scale"]] | None = None
    fill: bool = False
    level: bool = False
    repeats: Repeats | None = None
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

        lengths = {key: getattr(self, key) for key in Lengths.__annotations__}
        return Relief.read(self.texture, **lengths, repeats=self.repeats, default_mm=plate_mm)

    def check_texture(self) -> None:
        """Read the texture, so that its faults are reported before slow work begins. Raises InputError."""
        self.design(PATCH_SIDE_MM)

    def relief(self, plate_mm: float) -> "Relief":
        """The relief that the run begins with: its design, or the print of it. Raises InputError."""
        design, printer = self.design(plate_mm), self.print.described
        return design if printer is None else design.printed(printer)

    def files(self) -> dict[str, Path]:
        """The files that the run reads, by their dotted keys."""
        return {"scene": self.scene, "texture": self.texture, **self.touch.maps()}

    @model_validator(mode="before")
    @classmethod
    def _as_the_header_says(cls, values: Any) -> Any:
        """Where nobody else says whether the relief repeats, the header of the texture does."""
        if not isinstance(values, dict) or values.get("repeats") is not None:
            return values
        texture = values.get("texture")
        if not isinstance(texture, str | Path) or not os.path.isfile(texture):
            return values | {"repeats": False}
        # Imported here, as for `design`.
        from relief.heightmap import repeats_by_header

        return values | {"repeats": repeats_by_header(texture)}

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

    def without_effect(self) -> dict[str, str]:
        """Keys that are set at other than their defaults and change nothing in this run, each with why."""
        return without_effect(self.value, run_keys(), self.texture)

    def value(self, key: str) -> Any:
        """The value of a dotted key."""
        return attrgetter(key)(self)

    @model_validator(mode="after")
    def _every_key_has_an_effect(self, info: ValidationInfo) -> Self:
        if fault := unable(self.value, run_keys()):
            raise ValueError(fault)
        shared = (info.context or {}).get(SHARED, ())
        for key, reason in self.without_effect().items():
            if key not in shared:
                raise ValueError(f"{key}: {reason}")
        return self

    @model_validator(mode="after")
    def _goals_fit_the_plate(self) -> Self:
        size_mm = LARGEST_PLATE_MM if self.size_mm is None else self.size_mm
        for quantity, key, goal in self.touch.goals():
            if not key.relative and goal > quantity.largest(size_mm):
                raise ValueError(f"touch.{key.key}: {too_large(quantity, goal, size_mm)}")
        return self


def load_run(
    path: str | os.PathLike[str], overrides: Sequence[str] = (), *, shared: Collection[str] = ()
) -> Run:
    """Read a run file.

    Args:
        path: the file, or the name of a bundled one. Relative paths in the file are relative to its folder.
        overrides: `key=value` with a dot between section and key, the value as in TOML; bare words count as
            strings. Relative paths are relative to the working directory.
        shared: dotted keys that several runs have in common, and which may be without effect in this one;
            any other key that is set and has none is refused.

    Raises:
        InputError: one line that names the file and the key.
    """
    path = find_file(path, ".toml")
    values = read_toml(path)
    anchor(values, path.parent)
    return _run(path, values, overrides, shared)


def load_settings(path: Path) -> Run:
    """Read the settings that a run directory holds, whatever of them has an effect. Raises InputError."""
    return load_run(path, shared=run_keys())


def run_from_scene(
    scene: str | os.PathLike[str],
    texture: str | os.PathLike[str],
    overrides: Sequence[str] = (),
    *,
    shared: Collection[str] = (),
) -> Run:
    """The run of a scene and a texture; everything else by overrides or default.

    Args:
        scene: the file, or the name of a bundled one.
        texture: height map, or the name of a bundled one.
        overrides: as for `load_run`; one of them states a goal.
        shared: as for `load_run`.

    Raises:
        InputError: one line that names the key.
    """
    values: dict[str, Any] = {"scene": os.fspath(scene), "texture": os.fspath(texture)}
    anchor(values, Path.cwd())
    return _run(None, values, overrides, shared)


def dump_resolved(run: Run) -> str:
    """The run as TOML with defaults and absolute paths, which loads to the same run from any folder."""
    return tomli_w.dumps(run.model_dump(mode="json", exclude_none=True))


def _run(path: Path | None, values: dict[str, Any], overrides: Sequence[str], shared: Collection[str]) -> Run:
    """The run of a file, or of defaults alone, with overrides."""
    touch, overridden = values.get("touch"), [override.partition("=")[0].strip() for override in overrides]
    for rival in (rival for key in overridden for rival in RIVALS.get(key, ())):
        if isinstance(touch, dict):
            touch.pop(rival, None)
    if "print.printer" in overridden:
        # The numbers of the file's printer do not describe another printer.
        values["print"] = {}
    # Keys of the file suit its method, look and texture, and may have no effect by the overriding ones.
    idle = run_keys().keys() - overridden if DECIDING.intersection(overridden) else frozenset[str]()
    for override in overrides:
        _override(values, override)
    with _naming_source(path, overridden):
        if isinstance(touch := values.get("touch"), dict):
            with naming("touch.skin"):
                fill_in(touch)
            with naming("touch.feel_of"):
                resolve_result(touch)
        try:
            run = Run.model_validate(values, context={SHARED: {*shared, *idle}})
        except ValidationError as error:
            raise InputError(first_fault(error, Run)) from error
        for key, file in run.files().items():
            if not os.path.isfile(file):
                raise InputError(f"{key}: {file}: no such file")
    for key, reason in run.without_effect().items():
        if key not in shared:
            _log.warning("%s: %s: %s", path, key, reason)
    return run


@contextmanager
def _naming_source(path: Path | None, overridden: Sequence[str]) -> Iterator[None]:
    """Prefix every InputError of the block, which begins with a key, with the source of the key.

    Args:
        path: of the run file; None if there is none.
        overridden: dotted keys that are overridden. A command names them by their options.
    """
    try:
        yield
    except InputError as error:
        if str(error).partition(":")[0] in overridden:
            raise InputError(f"overrides: {error}", error.for_command) from error
        before = "" if path is None else f"{path}: "
        raise InputError(f"{before}{error}", f"{before}{error.for_command}") from error


def run_keys() -> dict[str, Any]:
    """Every dotted key that a run file may have -> its default; PydanticUndefined for a key without default.

    The keys of `define` are the parameters of the scene; `define` stands for all of them.
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
