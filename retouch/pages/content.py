"""The content of a page: two reliefs side by side, of a run or of a comparison, as arrays and numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two reliefs, how each feels and how each looks.

    Attributes:
        title: heading of the page.
        names: of the two reliefs, one or two short words each.
        conditions: names of the rendering conditions; none if the pictures cannot be compared.
        pictures_before, pictures_after: (conditions, rows, cols) linear radiance.
        colours_before, colours_after: (conditions, rows, cols, 3) the same pictures in linear RGB, shown
            instead; None if the scene is grey.
        white: radiance shown as full white, that of a white plate that faces the light.
        strain_before, strain_after: (rows, cols), dimensionless, less the strain under a flat plate.
        heights_before, heights_after: (rows, cols), mm.
        size_mm: side of the first plate, mm.
        size_after_mm: side of the second plate, mm; None if the sizes agree.
        pressure_before, pressure_after: (rows, cols), MPa, 0 out of contact; None if there is no contact map.
        plate: (conditions, rows, cols) weights of the pixels that show the first plate, with mean 1 over each
            picture; None if the plate fills all pictures.
        cameras: (conditions,) weights of the conditions in the look; None if all count alike.

    Raises:
        ValueError: the shapes of two arrays to compare differ.
    """

    title: str
    names: tuple[str, str] = ("before", "after")
    conditions: Sequence[str]
    pictures_before: Array
    pictures_after: Array
    white: float
    strain_before: Array
    strain_after: Array
    heights_before: Array
    heights_after: Array
    size_mm: float
    size_after_mm: float | None = None
    pressure_before: Array | None = None
    pressure_after: Array | None = None
    colours_before: Array | None = None
    colours_after: Array | None = None
    plate: NDArray[np.float64] | None = None
    cameras: NDArray[np.float64] | None = None

    @property
    def sizes_mm(self) -> tuple[float, float]:
        """Sides of both plates, mm."""
        return self.size_mm, self.size_mm if self.size_after_mm is None else self.size_after_mm

    def _compared(self) -> dict[str, tuple[Array, Array]]:
        """Arrays whose shapes have to agree, by the name that an error gives them."""
        pairs = {"pictures": (self.pictures_before, self.pictures_after)}
        return pairs if self.plate is None else pairs | {"plate": (self.pictures_before, self.plate)}

    def __post_init__(self) -> None:
        for name, (before, after) in self._compared().items():
            if before.shape != after.shape:
                raise ValueError(f"{name}: shape {before.shape} before and {after.shape} after")
        if len(self.conditions) != len(self.pictures_before):
            raise ValueError(f"{len(self.conditions)} conditions, {len(self.pictures_before)} pictures")


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


@dataclass(frozen=True, kw_only=True)
class Report(Pair):
    """Everything that the page shows of one run: its original and its result.

    Attributes:
        result: content of result.json; keys of its sections `touch` and `look` may be absent or None.
        history: one mapping a step, with step, roughness, target_roughness, contact_area_mm2,
            picture_rms_percent, picture_mean_percent and seconds; values may be None.
        heights_png_mm: heights of black and of white in heights.png, mm.
        tolerance: half width of the accepted range around the target, relative to the target.
        settings: the run file with all defaults.
        baseline: a method to compare with, if any.
        design: (conditions, rows, cols) pictures of the original before printing, where both reliefs are as
            printed.

    Raises:
        ValueError: the shapes of two arrays to compare differ.
    """

    result: Mapping[str, Any]
    history: Sequence[Mapping[str, float | None]]
    heights_png_mm: tuple[float, float]
    tolerance: float = 0.01
    settings: Mapping[str, Any] = field(default_factory=dict)
    baseline: Baseline | None = None
    design: Array | None = None

    def _compared(self) -> dict[str, tuple[Array, Array]]:
        pairs = super()._compared() | {
            "strain": (self.strain_before, self.strain_after),
            "heights": (self.heights_before, self.heights_after),
        }
        if self.baseline is not None:
            pairs["baseline"] = (self.pictures_before, self.baseline.pictures)
        if self.design is not None:
            pairs["design"] = (self.pictures_before, self.design)
        return pairs


@dataclass(frozen=True, kw_only=True)
class Comparison(Pair):
    """Everything that the page shows of two reliefs.

    Attributes:
        result: as `retouch.verbs.comparison.compare` returns it, of JSON types.
    """

    result: Mapping[str, Any]
