"""Process profiles of slicers: the settings that decide how sides feel, read, and written with new values.

PrusaSlicer and SuperSlicer write flat `.ini` files of `key = value`, OrcaSlicer and Bambu Studio `.json`
objects. Keys, labels, defaults and rules are those of `PrintConfig.cpp` and `Flow.cpp` of these slicers.
"""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from relief.ground.errors import InputError, naming
from relief.ground.files import read_limited
from relief.ground.formatting import plain

LONGEST_FILE = 1 << 22
"""Most bytes of a profile: full ones with notes and start code hold some 100 kB."""
LARGEST_MM = 5.0
"""Largest length in a profile, mm: of point distances in OrcaSlicer, and beyond every nozzle."""


@dataclass(frozen=True)
class Setting:
    """A setting of a profile.

    Attributes:
        ini: key of PrusaSlicer and SuperSlicer; empty if they have no such setting.
        json: key of OrcaSlicer and Bambu Studio.
        label: in the windows of the slicers.
        default: value of the slicer where a file states none.
        least_mm: least value of a length, mm.
        needed: whether a `.json` has to state the value, which would come from a profile that it inherits.
    """

    ini: str
    json: str
    label: str
    default: str
    least_mm: float = 0.0
    needed: bool = False


LAYER = Setting("layer_height", "layer_height", "Layer height", "0.3", 0.02, True)
NOZZLE = Setting("nozzle_diameter", "nozzle_diameter", "Nozzle diameter", "0.4", 0.05)
OUTER = Setting("external_perimeter_extrusion_width", "outer_wall_line_width", "Outer wall", "0", needed=True)
WIDTH = Setting("extrusion_width", "line_width", "Default", "0")
MODE = Setting("fuzzy_skin", "fuzzy_skin", "Fuzzy Skin", "none")
THICKNESS = Setting("fuzzy_skin_thickness", "fuzzy_skin_thickness", "Fuzzy skin thickness", "0.3")
POINTS = Setting(
    "fuzzy_skin_point_dist", "fuzzy_skin_point_distance", "Fuzzy skin point distance", "0.8", 0.1
)
NOISE = Setting("", "fuzzy_skin_noise_type", "Fuzzy skin noise type", "classic")
GENERATOR = Setting("", "fuzzy_skin_mode", "Fuzzy skin generator mode", "displacement")


@dataclass(frozen=True)
class Profile:
    """A process profile.

    Attributes:
        path: of the file.
        text: all of the file; bytes that are no UTF-8 are kept as surrogates.
        values: texts by the slicer's key; the first of a list; null states none.
        slicer: "PrusaSlicer", "SuperSlicer" or "OrcaSlicer", which stands for Bambu Studio too.
    """

    path: Path
    text: str
    values: Mapping[str, str]
    slicer: str

    @property
    def of_json(self) -> bool:
        """Whether the profile is one of OrcaSlicer or Bambu Studio."""
        return self.slicer == "OrcaSlicer"

    def key(self, setting: Setting) -> str:
        """The slicer's key of a setting."""
        return setting.json if self.of_json else setting.ini

    def stated(self, setting: Setting) -> str:
        """The value of a setting, or the slicer's default. Raises InputError if a `.json` has to state it."""
        if setting.needed and self.of_json and setting.json not in self.values:
            missing = ", ".join(one.json for one in (LAYER, OUTER) if one.json not in self.values)
            raise InputError(
                f"{self.path}: {missing}: missing; add what the inherited profile states, or take "
                "Metadata/project_settings.config out of a project saved as 3MF, renamed to .json"
            )
        return self.values.get(self.key(setting), setting.default)

    @property
    def fuzzy(self) -> bool:
        """Whether outer walls are fuzzy."""
        return self.stated(MODE) not in ("none", "disabled_fuzzy", "")

    @property
    def classic(self) -> bool:
        """Whether a fuzzy skin moves points of the wall by uniform noise, as all these slicers can."""
        return all(self.stated(one) == one.default for one in (NOISE, GENERATOR))

    def fuzzy_settings(self, thickness_mm: float, point_distance_mm: float) -> dict[Setting, str]:
        """The settings of a classic fuzzy skin; outer walls that are fuzzy already stay so."""
        others = () if self.classic else (NOISE, GENERATOR)
        mode = self.stated(MODE) if self.fuzzy else "external"
        lengths = {THICKNESS: f"{thickness_mm:g}", POINTS: f"{point_distance_mm:g}"}
        return {MODE: mode, **lengths, **{one: one.default for one in others}}

    def mm(self, setting: Setting) -> float:
        """A length, mm; percentages are of the nozzle, but PrusaSlicer's are of the layer's height.

        Raises:
            InputError: the value is missing, no number, negative or out of range.
        """
        # Values of several extruders are separated by commas.
        text, share = re.split("[,;]", self.stated(setting))[0].strip(), 1.0
        if text.endswith("%") and setting not in (LAYER, NOZZLE):
            over = LAYER if self.slicer == "PrusaSlicer" else NOZZLE
            text, share = text[:-1], 0.01 * self.mm(over)
        try:
            value = share * float(text)
        except ValueError:
            value = math.nan
        if not setting.least_mm <= value <= LARGEST_MM:
            fault = f"{plain(text[:40])!r} is no length from {setting.least_mm:g} to {LARGEST_MM:g} mm"
            raise InputError(f"{self.path}: {self.key(setting)}: {fault}")
        return value

    @property
    def wall_mm(self) -> float:
        """Width of the outer wall, mm: if 0 the default width, and if that is 0, too, by the nozzle."""
        nozzles = 1.05 if self.slicer == "SuperSlicer" else 1.125
        return self.mm(OUTER) or self.mm(WIDTH) or nozzles * self.mm(NOZZLE)

    def shown(self, values: Mapping[Setting, str]) -> list[str]:
        """Settings by their labels, with values as the slicer's window shows them."""
        words = {"external": "Contour" if self.of_json else "Outside walls", "all": "All walls"}
        texts = {one: f"{text} mm" if one in (THICKNESS, POINTS) else text for one, text in values.items()}
        return [f"{one.label}: {words.get(text, text)}" for one, text in texts.items()]

    def changed(self, values: Mapping[Setting, str]) -> bytes:
        """The file with these values, and every other byte as it was.

        Raises:
            InputError: the file states a setting in a form that cannot be changed in its place.
        """
        text, put = self.text, _put_in_json if self.of_json else _put_in_ini
        new = {self.key(setting): value for setting, value in values.items()}
        for key, value in new.items():
            text = put(text, key, value)
        if _values(text, self.of_json) != {**self.values, **new}:
            raise InputError(f"{self.path}: states {', '.join(new)} in a form that cannot be changed")
        return text.encode("utf-8", "surrogateescape")


def read_profile(path: Path) -> Profile:
    """Read a process profile of PrusaSlicer, SuperSlicer (.ini), OrcaSlicer or Bambu Studio (.json).

    Raises:
        InputError: the file cannot be read, is no profile, or holds several.
    """
    of_json = path.suffix.lower() == ".json"
    if not of_json and path.suffix.lower() != ".ini":
        raise InputError(f"{path}: a profile is an .ini (PrusaSlicer, SuperSlicer) or the .json of a process")
    text = read_limited(path, LONGEST_FILE).decode("utf-8", "surrogateescape")
    with naming(path):
        values = _values(text, of_json)
    of_ini = "SuperSlicer" if "SuperSlicer" in text.partition("\n")[0] else "PrusaSlicer"
    return Profile(path, text, values, "OrcaSlicer" if of_json else of_ini)


def _values(text: str, of_json: bool) -> dict[str, str]:
    """Values of a file by key. Raises InputError."""
    if of_json:
        try:
            content = json.loads(text.removeprefix("\ufeff"))
        except (ValueError, RecursionError) as error:
            raise InputError(f"is no JSON: {str(error)[:100]}") from error
        if not isinstance(content, dict):
            raise InputError("is no profile: the JSON is no object")
        firsts = {
            key: next(iter(value), None) if isinstance(value, list) else value
            for key, value in content.items()
        }
        return {key: str(value) for key, value in firsts.items() if value is not None}
    stated = [line for line in map(str.strip, text.split("\n")) if line and line[0] not in "#;"]
    lines = [line.partition("=") for line in stated]
    if any(key.lstrip().startswith("[") for key, _, _ in lines):
        raise InputError("holds several profiles; export one: File > Export > Export Config")
    if not lines or not all(equals for _, equals, _ in lines):
        raise InputError("is no profile: its lines are not key = value")
    return {key.strip(): value.strip() for key, _, value in lines}


def _put_in_ini(text: str, key: str, value: str) -> str:
    """The text with a value in its line, or in a new last one."""
    lines, end = text.split("\n"), "\r" * ("\r\n" in text)
    places = [number for number, line in enumerate(lines) if line.partition("=")[0].strip() == key]
    for number in places:
        before, equals, old = lines[number].partition("=")
        lines[number] = f"{before}{equals} {value}{old[len(old.rstrip()) :]}"
    if not places:
        lines[-1:] = [line + end for line in (lines[-1], f"{key} = {value}") if line] + [""]
    return "\n".join(lines)


def _put_in_json(text: str, key: str, value: str) -> str:
    """The text with a value in its place, or before the first key."""
    old = re.compile(rf'("{key}"\s*:\s*)("(?:[^"\\]|\\.)*"|\[[^\[\]]*\]|[^\s,\]}}\["]+)')
    put, count = old.subn(rf'\g<1>"{value}"', text)
    return put if count else re.sub(r"\{(\s*)", rf'{{\1"{key}": "{value}",\1', text, count=1)
