"""The content of a report: what one run measured, as arrays and numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Baseline:
    """Another method that reaches the same feel, such as linear scaling of the heights.

    Attributes:
        name: of the method, as shown.
        pictures: (conditions, rows, cols) linear radiance, of the shape of the report's pictures.
        roughness: reached by the method, dimensionless; None if unknown.
        note: a clause that ends the paragraph about the method; may be empty.
    """

    name: str
    pictures: Array
    roughness: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Report:
    """Everything that the page shows of one run.

    Attributes:
        title: heading of the page.
        result: content of result.json; keys of its sections `touch` and `look` may be absent or None.
        conditions: names of the rendering conditions.
        pictures_before, pictures_after: (conditions, rows, cols) linear radiance.
        white: radiance shown as full white, that of a white plate that faces the light.
        strain_before, strain_after: (rows, cols), dimensionless, less the strain under a flat plate.
        heights_before, heights_after: (rows, cols), mm.
        size_mm: side of the plate, mm.
        history: one mapping a step, with step, roughness, target_roughness, contact_area_mm2,
            picture_rms_percent, picture_mean_percent and seconds; values may be None.
        heights_png_mm: heights of black and of white in heights.png, mm.
        pressure_before, pressure_after: (rows, cols), MPa, 0 out of contact; None if there is no contact map.
        tolerance: half width of the accepted range around the target, relative to the target.
        settings: the run file with all defaults.
        baseline: a method to compare with, if any.
        plate: (conditions, rows, cols) weights of the pixels that show the plate, with mean 1 over each
            picture; None if the plate fills all pictures.
        cameras: (conditions,) weights of the conditions in the look; None if all count alike.

    Raises:
        ValueError: the shapes of two arrays to compare differ.
    """

    title: str
    result: Mapping[str, Any]
    conditions: Sequence[str]
    pictures_before: Array
    pictures_after: Array
    white: float
    strain_before: Array
    strain_after: Array
    heights_before: Array
    heights_after: Array
    size_mm: float
    history: Sequence[Mapping[str, float | None]]
    heights_png_mm: tuple[float, float]
    pressure_before: Array | None = None
    pressure_after: Array | None = None
    tolerance: float = 0.01
    settings: Mapping[str, Any] = field(default_factory=dict)
    baseline: Baseline | None = None
    plate: NDArray[np.float64] | None = None
    cameras: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        pairs = {
            "pictures": (self.pictures_before, self.pictures_after),
            "strain": (self.strain_before, self.strain_after),
            "heights": (self.heights_before, self.heights_after),
        }
        if self.baseline is not None:
            pairs["baseline"] = (self.pictures_before, self.baseline.pictures)
        if self.plate is not None:
            pairs["plate"] = (self.pictures_before, self.plate)
        for name, (before, after) in pairs.items():
            if before.shape != after.shape:
                raise ValueError(f"{name}: shape {before.shape} before and {after.shape} after")
        if len(self.conditions) != len(self.pictures_before):
            raise ValueError(f"{len(self.conditions)} conditions, {len(self.pictures_before)} pictures")
