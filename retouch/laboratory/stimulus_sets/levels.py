"""The plates of a set as rows of a study, and the study file that computes them."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from optimize.verification.jod import jod_obstacle
from relief.ground.files import write_atomically
from retouch.laboratory.stimulus_sets.controls import Control
from retouch.laboratory.stimulus_sets.plate_set import TILE, PlateSet
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment, StimulusSet
from retouch.laboratory.studies.rows import Expanded, StudyRow
from retouch.laboratory.studies.study_file import LONGEST_NAME, Study, load_study

STUDY, BASE = "study.toml", "base.toml"
"""The study file in the folder of a set, and the run file that it starts from."""
ROUGHNESS, CONTACT, SCALED, CONTROLS = "roughness", "contact area", "scaled in height", "controls"
"""Tables of the study, which are kinds of plates."""
TEXTURE, JND, SCALE, CONTROL = "texture", "touch.jnd", "touch.contact_area_scale", "control"
"""Axes of the tables."""
AS_STORED = {"height_scale": 1.0, "fill": False, "level": False}
"""Settings of controls, which are prepared in mm, in place of those of the textures."""


@dataclass(frozen=True)
class PlateRow:
    """A plate and the row that computes it.

    Attributes:
        texture: name of its texture.
        kind: table of the row.
        level: just-noticeable differences, ratio of contact areas, or number of a control.
        row: the row.
        experiment: that the plate is for.
    """

    texture: str
    kind: str
    level: float
    row: StudyRow
    experiment: Experiment

    @property
    def code(self) -> str:
        """That stands for the label (`Experiment.code_of`)."""
        return self.experiment.code_of(self.label)

    @property
    def on_back(self) -> str:
        """What stands on its back."""
        return self.code or self.label

    @property
    def mark(self) -> str:
        """The level in the characters of a label."""
        if self.kind == CONTACT:
            return f"AREA {self.level:g}"
        if self.kind == CONTROLS:
            return f"PATCH {self.level:g}"
        mark = f"{self.level:+g}" if self.level else "0"
        return f"{mark} SCALED" if self.kind == SCALED else mark

    @property
    def label(self) -> str:
        """Name of the plate: texture and level."""
        return f"{self.texture} {self.mark.lower()}"


def write_study_file(stimuli: StimulusSet, controls: Sequence[Control], out: Path) -> Study:
    """Write the study of a set into its folder and load it.

    Args:
        stimuli: the set.
        controls: its controls.
        out: the folder.

    Raises:
        InputError: a setting of the runs is none.
    """
    textures = [str(texture) for texture in stimuli.textures]
    tables: list[dict[str, Any]] = []
    if stimuli.jnd:
        tables.append({"name": ROUGHNESS, "axes": {TEXTURE: textures, JND: list(stimuli.jnd)}})
    if stimuli.contact_area_scale:
        axes = {TEXTURE: textures, SCALE: list(stimuli.contact_area_scale)}
        kept = {JND: 0.0} if stimuli.same_roughness else {}
        tables.append({"name": CONTACT, "set": kept, "axes": axes})
    scaled = [level for level in stimuli.jnd if level]
    if stimuli.with_scaled and scaled:
        axes = {TEXTURE: textures, JND: scaled}
        tables.append({"name": SCALED, "set": {"descent.method": "scaling"}, "axes": axes})
    if controls:
        values = [
            {
                "label": f"{one.texture} {one.number}",
                TEXTURE: str(one.file),
                "size_mm": one.size_mm,
                **{key: value for key, value in AS_STORED.items() if key in stimuli.settings},
            }
            for one in controls
        ]
        tables.append({"name": CONTROLS, "set": {JND: 0.0, "repeats": True}, "axes": {CONTROL: values}})
    return study_of(stimuli, f"Stimuli: {', '.join(stimuli.names)}", tables, out, not stimuli.whole)


def study_of(
    plates: PlateSet, title: str, tables: Sequence[Mapping[str, Any]], out: Path, repeats: bool = True
) -> Study:
    """Write the study that computes tables of plates into a folder and load it.

    Args:
        plates: with the settings of the runs.
        title: of the study, which ends in ... where it is too long for one.
        tables: as a study file has them.
        out: the folder.
        repeats: whether the textures are tiles.

    Raises:
        InputError: a setting of the runs is none.
    """
    study = {
        "title": textwrap.shorten(title, LONGEST_NAME, placeholder=" ..."),
        "description": f"The rows of a {plates.KIND}, whose page is index.html.",
        "base": BASE,
        "measures": [] if jod_obstacle() else ["jod"],
        "set": {"verify.baseline": False, **plates.settings},
        "tables": tables,
    }
    base = {"scene": "studio.xml", "texture": str(plates.textures[0]), "repeats": repeats}
    write_atomically(out / BASE, tomli_w.dumps(base).encode())
    write_atomically(out / STUDY, tomli_w.dumps(study).encode())
    return load_study(out / STUDY)


def plate_rows(stimuli: StimulusSet, expanded: Expanded) -> Iterator[PlateRow]:
    """The plates of a set, texture by texture: roughness, contact area, scaled, controls, each ascending."""
    for name, texture in zip(stimuli.names, stimuli.textures, strict=True):
        for table in expanded.tables:
            rows = []
            for row in table.rows:
                if table.name == CONTROLS:
                    own, _, level = str(row.labels[CONTROL]).rpartition(" ")
                else:
                    own = str(row.labels[TEXTURE]).removesuffix(TILE)
                    level = row.labels[JND if JND in row.labels else SCALE]
                if own == name:
                    stem = texture.stem.removesuffix(TILE)
                    rows.append(PlateRow(stem, table.name, float(level), row, stimuli.experiment))
            yield from sorted(rows, key=lambda plate: plate.level)
