"""Columns that the page of a study shows: heading and meaning of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.records import Cell
from tactile.jnd import SMOOTH_BELOW


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes:
        heading: with the unit.
        meaning: in a sentence.
        digits: significant digits that are shown.
    """

    heading: str
    meaning: str
    digits: int = 3


SHOWN: Mapping[str, Column] = {
    "reason": Column("ended", "Why the descent stopped."),
    "jnd_from_original": Column(
        "felt, JND",
        "Just-noticeable differences from the original, as verified; negative is smoother; none where one "
        f"of the two is smooth, with V below {SMOOTH_BELOW:g}, the least that people have judged.",
    ),
    "miss_percent": Column("off target, %", "Largest relative error of a target, as verified.", 2),
    "change_percent": Column(
        "picture change, % of mean",
        "Mean absolute change of a pixel, in % of the mean picture before, less noise.",
    ),
    "change_rms_percent": Column(
        "picture change rms, % of mean",
        "Root mean square change of a pixel, in % of the mean picture before, less noise.",
    ),
    "change_percent_of_white": Column(
        "picture change, % of white",
        "Mean absolute change of a pixel, in % of the radiance of white, less noise.",
    ),
    "flip": Column("FLIP", "Difference that an eye sees between the pictures, mean over the lights.", 2),
    "jod": Column("JOD", "Quality of the pictures in just-objectionable differences; 10 is identical."),
    "steps": Column("steps", "Steps of all descents."),
    "time_s.total": Column("time, s", "From the start of the run to its last file.", 2),
}
"""Columns of result.json that tables show, by key; the row itself has all."""
AXES: Mapping[str, str] = {
    "touch.jnd": "target, JND",
    "touch.roughness": "target, roughness",
    "touch.contact_area_mm2": "target, mm²",
    "touch.model": "touch",
    "look.model": "look",
    "look.weight": "weight of the look",
    "descent.method": "method",
}
"""Axes by key of a run, in words, where the last part of the key does not say enough."""


UNCHANGED: Mapping[str, float] = {"touch.jnd": 0.0, "jnd_from_original": 0.0, "touch.contact_area_scale": 1.0}
"""Values of axes and columns by which a relief is its own original."""
ZERO_UNCHANGED = frozenset(
    {"change_percent", "change_rms_percent", "change_percent_of_white", "flip", "jnd_from_original"}
)
"""Columns that are 0 of a relief that is its own original."""

UNITS: Mapping[str, str] = {"percent": "%", "mb": "MB", "mm": "mm", "mm2": "mm²", "s": "s", "jnd": "JND"}
"""Units by the last word of a key."""


def filled(rows: Sequence[Mapping[str, Cell]]) -> dict[str, Column]:
    """The columns that have a value in some row: those of `SHOWN`, and those of measures."""
    columns = dict(SHOWN)
    for measure in MEASURES.values():
        columns |= {key: Column(heading(key), text) for key, text in measure.columns.items()}
    return {key: column for key, column in columns.items() if any(row.get(key) is not None for row in rows)}


def heading(key: str) -> str:
    """A column or axis in words."""
    if key in SHOWN:
        return SHOWN[key].heading
    *words, last = key.rpartition(".")[2].split("_")
    unit = UNITS.get(last) if words else None
    return AXES.get(key) or (" ".join([*words, last]) if unit is None else f"{' '.join(words)}, {unit}")
