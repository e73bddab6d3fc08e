"""The verification of a result: what was measured of it, typed. `result.json` is its dump.

Attributes have the names of the keys, which docs/explanation/verification.md explains, unless `Keys` says
otherwise.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from optimize.settings.run_file import Run
from optimize.verification.section import Keys, Section
from tactile.quantities import QUANTITIES, ROUGHNESS

LARGEST_NUMBER = 1e300
"""Largest number of result.json; NaN, which Python's reader of JSON takes, is not within."""
SAME_CHANGE = 1e-6
"""Relative difference of two changes that count as one: rounding."""

Values = Mapping[str, float | None]
"""Numbers by the names of their quantities; None where there is none."""
EachPlace = Mapping[str, tuple[float, ...]]
"""Numbers of every place by the names of their quantities."""


class Stop(Section):
    """Why the descent stopped: the name and the sentence of a `StopReason`, and steps made and kept."""

    reason: str
    message: str
    steps: int
    best_step: int | None = None


class FingerChange(Section):
    """What one of the other fingers feels; `jnd` is None if one of the reliefs is smooth."""

    name: str
    young_modulus_mpa: float
    depth_mm: float
    initial_roughness: float
    roughness: float
    jnd: float | None


class Fingers(Section):
    """What other fingers feel of a change, by `optimize.verification.other_fingers`.

    Attributes:
        count: of fingers.
        places: where each of them presses.
        jnd_mean, jnd_min, jnd_max, jnd_std: None where a relief is smooth to one of the fingers.
        each: the fingers.
        weight: by which a descent drew them along; None if it did not.
    """

    count: int
    places: int
    jnd_mean: float | None
    jnd_min: float | None
    jnd_max: float | None
    jnd_std: float | None
    each: tuple[FingerChange, ...]
    weight: float | None = None


class Spread(Section):
    """Just-noticeable differences from the original over places; None where all are flat."""

    count: int
    jnd_mean: float | None = None
    jnd_min: float | None = None
    jnd_max: float | None = None


class Measured(Spread):
    """What a finger that was measured feels of a change, by `optimize.verification.other_fingers`.

    Attributes:
        skin: its name.
        force_n: its force, N.
        count: places where it presses.
        initial_roughness, roughness: means over the places.
        jnd_mean: of these means; None, as its ends, where a relief is smooth to this finger or the run's own.
    """

    skin: str
    force_n: float
    initial_roughness: float
    roughness: float


class SurfaceBand(Section):
    """Change of the skin's surface in a band of wavelength (`optimize.verification.surface_bands`).

    Attributes:
        least_mm, most_mm: wavelengths of the band.
        held: share of the band that the grid holds, 0 to 1.
        initial_um, final_um, change_um: rms of the skin's displacement by original and result, and of the
            difference of the two.
        threshold_um: rms of a wave as high as the lowest dot that people detect on a smooth plate.
    """

    least_mm: float
    most_mm: float
    held: float
    initial_um: float
    final_um: float
    change_um: float
    threshold_um: float


class PlaceValues(Spread):
    """What is felt at each of n places.

    Attributes:
        centres_mm: (n, 2), from the first row's and the first column's edge.
        initial, verified, target: (n,) by quantity; no target for a quantity without one.
    """

    centres_mm: tuple[tuple[float, float], ...]
    initial: Annotated[EachPlace, Keys(("initial_",), each=True)]
    verified: Annotated[EachPlace, Keys(("verified_",), each=True)]
    target: Annotated[EachPlace, Keys(("target_",), each=True)] = Field(default_factory=dict)


class Places(Spread):
    """Feel over a surface: at the places of the descent, and between them.

    Attributes:
        farthest_from_target_jnd: of any place; None without a target of roughness.
        steered: places of the descent.
        between: places between them; None if there are none.
    """

    farthest_from_target_jnd: float | None = None
    steered: PlaceValues
    between: PlaceValues | None = None

    @property
    def varied(self) -> bool:
        """Whether the targets of roughness are other than one change from the original everywhere."""
        name = ROUGHNESS.name
        ratios = [
            goal / first
            for side in self.sides
            for goal, first in zip(side.target.get(name, ()), side.initial[name], strict=False)
            if goal > 0.0 and first > 0.0
        ]
        return bool(ratios) and max(ratios) > (1.0 + SAME_CHANGE) * min(ratios)

    @property
    def sides(self) -> tuple[PlaceValues, ...]:
        """The steered places, and those between them if there are any."""
        return (self.steered,) if self.between is None else (self.steered, self.between)


class FeelOf(Section):
    """The feel of another relief that was the target (`optimize.runs.feel_of`).

    Attributes:
        name: of the other relief.
        quantities: names of those that are targets.
        model: of touch.
        values: means over the places of the other relief.
        places: their count, and the least and largest of each quantity.
    """

    name: str
    quantities: tuple[str, ...]
    model: str
    values: Annotated[Values, Keys(("",), each=True)]
    places: Mapping[str, int | float]


class Touch(Section):
    """Feel of the result.

    Attributes:
        model: of touch, by which the descent was steered.
        target, initial, achieved, verified: means over the places, by quantity: goal; of the original by the
            verifying model; of the result by the model that steers, and by the verifying one.
        verified_by: the verifying model; None without verification, as the values of `verified`.
        contact_fraction, initial_contact_fraction: share of the plate under pressure of the result and of
            the original, means over the places by the model of `verified`.
        contact_error_bound: largest bound of the error of a contact's energy, over the elastic energy, of
            original and result by the same model.
        jnd_from_original: just-noticeable differences; None if one of the reliefs is smooth.
        surface_bands: change of the skin's surface by bands of wavelength, from short to long; None where two
            models pressed on original and result.
    """

    model: str | None = None
    target: Annotated[Values, Keys(("target_",), each=True)] = Field(default_factory=dict)
    initial: Annotated[Values, Keys(("initial_",), each=True)] = Field(default_factory=dict)
    achieved: Annotated[Values, Keys(("",), each=True)]
    verified: Annotated[Values, Keys(("verified_",), each=True)] = Field(default_factory=dict)
    verified_by: str | None = None
    contact_fraction: float
    initial_contact_fraction: float | None = None
    contact_error_bound: float | None = None
    jnd_from_original: float | None = None
    feel_of: FeelOf | None = None
    fingers: Fingers | None = None
    measured: Measured | None = None
    surface_bands: tuple[SurfaceBand, ...] | None = None
    places: Places | None = None

    def final(self, name: str) -> float | None:
        """The verified value of a quantity, or that of the descent if nothing was verified."""
        verified = self.verified.get(name)
        return self.achieved.get(name) if verified is None else verified

    def ends_of(self, name: str) -> tuple[float, float]:
        """The value of a quantity before and after; 0 where one is unknown."""
        return self.initial.get(name) or 0.0, self.final(name) or 0.0


class IterationValues(Section):
    """One outer iteration: a descent and its verification.

    Attributes:
        surrogate_target, achieved, verified: by quantity: goal of the descent; value that it reached by the
            model that steers; value by the verifying model.
        relative_error: largest of a target, by the verifying model.
        steps: number of the last step.
    """

    surrogate_target: Annotated[Values, Keys(("surrogate_target_", "aimed_"), each=True)]
    achieved: Annotated[Values, Keys(("",), each=True)]
    verified: Annotated[Values, Keys(("verified_",), each=True)]
    relative_error: Annotated[float, Keys(("relative_error", "miss"))]
    steps: int

    def as_json(self) -> dict[str, Any]:
        """The iteration of JSON types, quantity by quantity."""
        content = super().as_json()
        ordered = [key for name in QUANTITIES for key in content if key.endswith(name)]
        return {key: content[key] for key in dict.fromkeys((*ordered, *content))}


class OuterIterations(Section):
    """The outer iterations, each a descent and its verification.

    Attributes:
        resolution: nodes of the verifying mesh along a side; None for a model without a mesh.
        miss_percent: largest relative error of a target, as verified; None without verification.
        surrogate_initial: of the original by the model that steers, by quantity.
        each: none without verification.
    """

    resolution: int | None = None
    miss_percent: float | None = None
    surrogate_initial: Annotated[Values, Keys(("surrogate_initial_", "believed_initial_"), each=True)] = (
        Field(default_factory=dict)
    )
    each: Annotated[tuple[IterationValues, ...], Keys(("outer_iterations", "rounds"))] = ()


class ChangePercent(Section):
    """A change of pictures in percent of some radiance; see `optimize.verification.picture_change.Change`."""

    estimate: float
    mean: float
    mean_error: float
    mean_at_least: float
    noise_floor: float
    rms: float
    rms_less_noise: float
    rms_error: float


class PictureNoise(Section):
    """How well the change of pictures is known: the name and sentence of a `Certainty`, and the numbers."""

    certainty: str
    message: str
    batches: int
    standard_error_percent: tuple[float, ...]
    change_percent_of_mean: ChangePercent
    change_percent_of_white: ChangePercent
    conditions_percent_of_mean: tuple[ChangePercent, ...] | None = None
    conditions_percent_of_white: tuple[ChangePercent, ...]


class PictureChange(Section):
    """The change of the pictures.

    Attributes:
        conditions: their names.
        model: of pictures, by which a descent was steered.
        step_bias_percent: of each condition, by which the pictures of steps differed from rendered ones at
            the start, % of their mean; None where steps look at no such pictures, as the other two.
        step_change_percent: as `change_percent`, by the pictures of steps.
        step_note: a sentence, if the verified change is much larger than that.
    """

    conditions: tuple[str, ...] = ()
    model: str | None = None
    step_bias_percent: tuple[float, ...] | None = None
    step_change_percent: float | None = None
    step_note: str | None = None
    change_percent: float
    change_rms_percent: float
    change_percent_of_white: float
    change_rms_percent_of_white: float
    plate_share: tuple[float, ...]
    pixel_change_percent: tuple[float, ...]
    rms_change_percent: tuple[float, ...]
    mean_change_percent_of_mean: float
    rms_change_percent_of_mean: float
    dssim: tuple[float, ...]
    flip: tuple[float, ...]
    jod: tuple[float, ...] | None = None
    pixels_per_degree: tuple[float, ...]
    distance_cm: float
    samples: int
    noise: PictureNoise


class Heights(Section):
    """Heights of the result, and how they changed."""

    min_mm: float
    max_mm: float
    frozen_fraction: float = 0.0
    lift_mm: float
    rms_change_mm: float


class Faults(Section):
    """What of a print is beyond the limits of its printer (`relief.printed.faults`)."""

    too_steep_percent: float
    too_fine_percent: float
    too_high_mm: float


class DesignNumbers(Section):
    """The original before layers are cut, against its print."""

    jnd_of_print: float | None
    seen_change_percent: float
    too_steep_percent: float


class PrintNumbers(Section):
    """The prints of original and result, and the numbers of their printer."""

    printer: str
    pixel_um: float
    layer_um: float
    min_feature_um: float
    max_slope_degrees: float
    max_relief_mm: float
    keep_features: bool
    pixels: tuple[int, ...]
    acuity_arcmin: float
    seen_change_percent: float
    design: DesignNumbers
    faults_before: Faults
    faults_after: Faults


class Verification(Section):
    """What was measured of the result of a run.

    Attributes:
        outer: the outer iterations.
        printed: None without a printer.
        time_s, cpu_s: seconds of each part and in total, of the clock and of the processor.
        skin: its name and its values.
        versions: of packages.
        variant: Mitsuba's.
        seed: of the random numbers.
        settings: every setting of the run.
        sha256: checksums of its files.
    """

    stop: Stop
    touch: Touch
    outer: Annotated[OuterIterations, Keys(("verification",))] = OuterIterations()
    look: PictureChange
    heights: Heights
    printed: Annotated[PrintNumbers | None, Keys(("print",))] = None
    time_s: Mapping[str, float]
    cpu_s: Mapping[str, float] = Field(default_factory=dict)
    skin: Mapping[str, Any] = Field(default_factory=dict)
    versions: Mapping[str, str] = Field(default_factory=dict)
    variant: str | None = None
    seed: int | None = None
    settings: Mapping[str, Any] = Field(default_factory=dict)
    sha256: Mapping[str, str] = Field(default_factory=dict)

    @classmethod
    def from_json(cls, content: object) -> Verification:
        """The verification that `as_json` gave.

        Raises:
            ValueError: a value is missing, of another type, or may not be shown.
        """
        verification = cls.model_validate(content)
        # Not of the content: a text such as "1e999" becomes a number.
        if not all(map(_presentable, _leaves(verification.as_json()))):
            raise ValueError("holds a text or a number that may not be shown")
        return verification


def described(settings: Run) -> dict[str, Any]:
    """The settings of a run and the SHA-256 of its files, as result.json has them."""
    files = {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in settings.files().items()}
    return {"settings": settings.model_dump(mode="json"), "sha256": files}


def _leaves(content: Any) -> Iterator[str | float | None]:
    """Every text, number, truth value and null of a JSON document, but not the names of its members."""
    if isinstance(content, list | dict):
        for value in content.values() if isinstance(content, dict) else content:
            yield from _leaves(value)
    else:
        yield content


def _presentable(value: str | float | None) -> bool:
    """Whether a value may be shown: a text without control characters, a number that is one."""
    if isinstance(value, str):
        return value.isprintable()
    return value is None or abs(value) <= LARGEST_NUMBER
