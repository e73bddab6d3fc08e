"""Findings of the literature: rows of findings.toml, each with its stimulus, its rule and its source."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from pydantic import ValidationError

import tactile
from optimize.settings.toml_files import Section, first_fault, read_toml
from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from retouch.laboratory.published.rules import RULES
from retouch.laboratory.published.stimuli import plates
from retouch.laboratory.studies.records import Cell
from tactile.contact import ContactError
from tactile.readouts import READ_OUTS
from tactile.skin import Skin

FILE = Path(__file__).with_name("findings.toml")
"""The findings; its head describes the keys."""
V, AREA = "V", "contact area"
"""Read-outs beside those of `READ_OUTS`; contact area is judged by rows of this unit alone."""
LABELS = {V: "roughness V", **{name: one.label for name, one in READ_OUTS.items()}, AREA: AREA}
"""Read-outs by name, in words."""
REFUSED, NUMBERS, RIGHT = "refused", "{}, numbers", "{}, right"
"""Columns: why a finger cannot be pressed as the finding asks; numbers and verdict by a read-out."""


class Finding(Section):
    """`[[finding]]`, whose keys the head of the file describes. A curve has one value a plate."""

    name: str
    says: str
    of: str
    mark: Literal["fitted", "seen", "new"]
    force_n: float | list[float] | None = None
    force_share: float | list[float] = 1.0
    unit: Literal["V", "contact area"] | None = None
    stimulus: dict[str, Any]
    rule: dict[str, Any]
    study: str
    doi: str = ""
    read: Literal["full text", "abstract", "second-hand"]
    assumed: str = ""
    dimensions: Literal["assumed", "stated"] = "stated"
    against: str = ""

    @property
    def given(self) -> dict[str, Any]:
        """Parameters of the stimulus, and forces; a list has a value for each plate."""
        return {**self.stimulus, "force_n": self.force_n, "force_share": self.force_share}

    @property
    def at(self) -> list[Any]:
        """What differs between the plates."""
        return next((value for value in self.given.values() if isinstance(value, list)), [1.0])

    def plates(self, own_n: float) -> list[tuple[dict[str, Any], float]]:
        """Each plate's stimulus, and its force in N, to a finger with this force of its own."""
        lists = (
            [value] * len(self.at) if not isinstance(value, list) else value for value in self.given.values()
        )
        rows = (dict(zip(self.given, row, strict=True)) for row in zip(*lists, strict=True))
        popped = ((row, row.pop("force_n"), row.pop("force_share")) for row in rows)
        return [(stimulus, n or own_n * share) for stimulus, n, share in popped]

    def columns(self, finger: Skin, samples: int) -> dict[str, Cell]:
        """Read-outs of each plate, means over its places, and verdicts on them; or why there are none.

        Args:
            finger: with its own force.
            samples: along 10 mm.
        """
        pitch, curves = PATCH_SIDE_MM / samples, {name: list[float]() for name in LABELS}
        try:
            for plate, force in self.plates(finger.force_n):
                skin = replace(finger, force_n=force)
                # A multiple of 8 samples, so that transforms are fast.
                n = 8 * math.ceil((skin.patch_mm or PATCH_SIDE_MM) / pitch / 8)
                weights, heights = plates(plate, n, pitch)
                reliefs = torch.from_numpy(heights.astype(np.float32))
                touch = tactile.press(reliefs, n * pitch, skin)
                values = {V: tactile.roughness(touch), AREA: tactile.contact_area(touch)}
                values |= {name: one.value(touch, reliefs) for name, one in READ_OUTS.items()}
                for name, value in values.items():
                    curves[name].append(float(f"{weights @ value.double().numpy():.6g}"))
        except (InputError, ContactError) as error:
            return {REFUSED: str(error)}
        found: dict[str, Cell] = {
            f"{name} {n}": one for name, of in curves.items() for n, one in enumerate(of)
        }
        for name in [self.unit] if self.unit else [name for name in LABELS if name != AREA]:
            found[NUMBERS.format(name)], found[RIGHT.format(name)] = self.verdict(curves[name])
        return found

    def verdict(self, curve: list[float]) -> tuple[str, bool]:
        """What the rule says of a curve; false where it has no ratios, as 0 or what is negative has none."""
        rule = {name: value for name, value in self.rule.items() if name != "kind"}
        try:
            return RULES[self.rule["kind"]](curve, self.at, **rule)
        except (ArithmeticError, ValueError):
            return "no ratio", False


class Findings(Section):
    """The file."""

    finding: list[Finding]
    not_computable: list[dict[str, str]]


def load_findings(path: Path = FILE) -> Findings:
    """Read findings. Raises InputError: one line that names the file and the row."""
    try:
        return Findings.model_validate(read_toml(path))
    except ValidationError as error:
        raise InputError(f"{path}: {first_fault(error, Findings)}") from error
