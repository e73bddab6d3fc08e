"""The content of a page: two reliefs side by side, of a run or of a comparison, as arrays and numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from optimize.verification.verification import Verification
from relief.ground.arrays import Array, FloatArray
from relief.relief import Relief
from retouch.pages.compared import Compared
from tactile.measures import TouchMeasures
from visual.matte import MatteScene
from visual.picture_noise import Batches


@dataclass(frozen=True, kw_only=True)
class Side:
    """One of two reliefs, how it feels and how it looks.

    Attributes:
        name: one or two short words.
        relief: on its plate.
        strain: (rows, cols), dimensionless, less the strain under a flat plate.
        pressure: (rows, cols), MPa, 0 out of contact; None if there is no contact map.
        pictures: (conditions, rows, cols) linear radiance; none if the pictures cannot be compared.
        colours: (conditions, rows, cols, 3) the same pictures in linear RGB, shown instead; None if the scene
            is grey.
    """

    name: str
    relief: Relief
    strain: FloatArray
    pressure: FloatArray | None = None
    pictures: FloatArray = field(default_factory=lambda: np.zeros((0, 1, 1)))
    colours: FloatArray | None = None

    @classmethod
    def of(
        cls,
        name: str,
        relief: Relief,
        touch: TouchMeasures,
        pictures: Batches | None,
        colours: FloatArray | None,
    ) -> Self:
        """A side as measured; its maps of touch are those of the first place."""
        side = cls(
            name=name, relief=relief, strain=touch.strain[0], pressure=touch.pressure[0], colours=colours
        )
        return side if pictures is None else replace(side, pictures=pictures.mean)


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two reliefs.

    Attributes:
        title: heading of the page.
        before, after: the reliefs.
        conditions: names of the rendering conditions; none if the pictures cannot be compared.
        white: radiance shown as full white, that of a white plate that faces the light.
        plate: (conditions, rows, cols) weights of the pixels that show the first plate, with mean 1 over each
            picture; None if the plate fills all pictures.
        cameras: (conditions,) weights of the conditions in the look; None if all count alike.
        matte: the scene of the pictures for the figure whose lamp moves; None without pictures.
    """

    title: str
    before: Side
    after: Side
    conditions: Sequence[str] = ()
    white: float = 1.0
    plate: Array | None = None
    cameras: Array | None = None
    matte: MatteScene | None = None

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both reliefs."""
        return self.before, self.after

    @property
    def names(self) -> tuple[str, str]:
        """Names of both reliefs."""
        return self.before.name, self.after.name


@dataclass(frozen=True)
class Baseline:
    """Another method that reaches the same feel, such as linear scaling of the heights.

    Attributes:
        name: of the method, as shown.
        pictures: (conditions, rows, cols) linear radiance, of the shape of the report's pictures.
        roughness: reached by the method, dimensionless; None if unknown.
    """

    name: str
    pictures: FloatArray
    roughness: float | None = None


@dataclass(frozen=True, kw_only=True)
class Report(Pair):
    """Everything that the page shows of one run: its original and its result.

    Attributes:
        verification: what was measured of the result.
        history: one mapping a step, with step, roughness, target_roughness, contact_area_mm2,
            picture_rms_percent, picture_mean_percent and seconds; values may be None.
        heights_png_mm: heights of black and of white in heights.png, mm.
        tolerance: half width of the accepted range around the target, relative to the target.
        settings: the run file with all defaults.
        baseline: a method to compare with, if any.
        design: (conditions, rows, cols) pictures of the original before printing, where both reliefs are as
            printed.
    """

    verification: Verification
    history: Sequence[Mapping[str, float | None]]
    heights_png_mm: tuple[float, float]
    tolerance: float = 0.01
    settings: Mapping[str, Any] = field(default_factory=dict)
    baseline: Baseline | None = None
    design: FloatArray | None = None


@dataclass(frozen=True, kw_only=True)
class Comparison(Pair):
    """Everything that the page shows of two reliefs."""

    numbers: Compared
