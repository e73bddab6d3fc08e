"""The verification of a result: what was measured of it, typed. `result.json` is its dump.

Attributes have the names of the keys, unless an alias or `EachUnder` says otherwise. The docstrings are the
text of docs/reference/json.md.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from optimize.settings.run_file import Run
from optimize.verification.section import EachUnder, Section
from relief.ground.formatting import duration, html_table, number, percent
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
    """Why the descent stopped.

    Attributes:
        reason: `converged`, `within_bounds`, `step_limit` (target met); `short_of_target`, `not_confirmed`,
            `unreachable`, `swinging`, `non_finite`, `contact_failed` or `interrupted`.
        message: the same in a sentence.
        steps: steps made.
        best_step: the step whose relief is the result.
    """

    reason: str
    message: str
    steps: int
    best_step: int | None = None


class FingerChange(Section):
    """What one of the other fingers feels.

    Attributes:
        name: name of the finger.
        young_modulus_mpa: modulus of its skin, MPa.
        depth_mm: depth of its receptors, mm.
        initial_roughness: V of the original.
        roughness: V of the result.
        jnd: JND between the two; null if one of them is smooth.
    """

    name: str
    young_modulus_mpa: float
    depth_mm: float
    initial_roughness: float
    roughness: float
    jnd: float | None


class Fingers(Section):
    """What other fingers feel of a change (`optimize.verification.other_fingers`).

    Attributes:
        count: number of other fingers.
        places: number of contact locations where each presses.
        jnd_mean: mean change over the fingers, JND; null where a relief is smooth to one of them.
        jnd_min: least of these changes.
        jnd_max: greatest of these changes.
        jnd_std: standard deviation of these changes.
        each: each of the fingers.
        weight: `touch.fingers_weight` if the run optimised for a range of fingers; else null.
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
    """Just-noticeable differences from the original over contact locations.

    Attributes:
        count: number of contact locations.
        jnd_mean: mean change over them, JND; null where all are smooth.
        jnd_min: least of these changes.
        jnd_max: greatest of these changes.
    """

    count: int
    jnd_mean: float | None = None
    jnd_min: float | None = None
    jnd_max: float | None = None


class Measured(Spread):
    """What a finger fitted to measurements feels of a change (`optimize.verification.other_fingers`).

    Attributes:
        skin: name of the finger.
        force_n: its force, N.
        count: number of contact locations where it presses.
        initial_roughness: V of the original, mean over the contact locations.
        roughness: V of the result, mean over the contact locations.
        jnd_mean: JND between the two means of V; null, as its ends, where a relief is smooth to this finger
            or to the run's own.
    """

    skin: str
    force_n: float
    initial_roughness: float
    roughness: float


class SurfaceBand(Section):
    """Change of the skin's surface in a band of wavelength (`optimize.verification.surface_bands`).

    Attributes:
        least_mm: shortest wavelength of the band, mm.
        most_mm: longest wavelength of the band, mm.
        held: share of the band that the samples hold, 0 to 1.
        initial_um: displacement of the skin's surface by the original, µm rms.
        final_um: the same by the result.
        change_um: the same of the difference of the two.
        threshold_um: rms of a wave as high as the lowest raised dot, as wide as half the wave, that people
            detect on a smooth plate; a scale, no limit.
    """

    least_mm: float
    most_mm: float
    held: float
    initial_um: float
    final_um: float
    change_um: float
    threshold_um: float


class PlaceValues(Spread):
    """What is felt at each of n contact locations.

    Attributes:
        centres_mm: n pairs, mm down from the first row's and right from the first column's edge.
        initial: values of the original, n each.
        verified: values of the result, n each.
        target: goals, n each; absent for a quantity without a target.
    """

    centres_mm: tuple[tuple[float, float], ...]
    initial: Annotated[EachPlace, EachUnder("initial_")]
    verified: Annotated[EachPlace, EachUnder("verified_")]
    target: Annotated[EachPlace, EachUnder("target_")] = Field(default_factory=dict)


class Places(Spread):
    """Feel over a surface: at the contact locations that were optimised, and between them.

    Attributes:
        farthest_from_target_jnd: largest distance of a contact location from its goal, JND; null without a
            target of roughness.
        steered: contact locations that were optimised.
        between: held-out contact locations between them, 64 at most; null if there are none.
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
        name: name of the other relief.
        quantities: names of the quantities that are targets.
        model: model of touch.
        values: value of the other relief, mean over its contact locations.
        places: `count` of these contact locations, and least and largest value of each quantity.
    """

    name: str
    quantities: tuple[str, ...]
    model: str
    values: Annotated[Values, EachUnder("")]
    places: Mapping[str, int | float]


class Touch(Section):
    """Feel of the result.

    Attributes:
        model: model of touch in the steps.
        target: goal, mean over the contact locations; null for a quantity without one.
        initial: value of the original, by the verifying model.
        achieved: value of the result, by the model of the steps.
        verified: value of the result, by the verifying model; null without verification.
        verified_by: the verifying model; null without verification.
        contact_fraction: share of the patch under pressure, of the result.
        initial_contact_fraction: the same of the original.
        contact_error_bound: largest upper bound of the error of a contact's energy, in units of the elastic
            energy, over original and result.
        jnd_from_original: just-noticeable differences between original and result; null if one is smooth.
        feel_of: the other relief whose feel was the target; else null.
        fingers: other fingers; null where the contact of one does not converge.
        measured: a finger fitted to measurements on people.
        surface_bands: the skin's surface by bands of wavelength, from short to long; null where two models
            pressed on original and result.
        places: the contact locations; null if there is one.
    """

    model: str | None = None
    target: Annotated[Values, EachUnder("target_")] = Field(default_factory=dict)
    initial: Annotated[Values, EachUnder("initial_")] = Field(default_factory=dict)
    achieved: Annotated[Values, EachUnder("")]
    verified: Annotated[Values, EachUnder("verified_")] = Field(default_factory=dict)
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
        surrogate_target: goal of its steps, by their model.
        achieved: value that it reached, by the model of the steps.
        verified: value that it reached, by the verifying model.
        relative_error: largest relative error of a target, as verified; a ratio, not %.
        steps: number of its last step.
    """

    surrogate_target: Annotated[Values, EachUnder("surrogate_target_")]
    achieved: Annotated[Values, EachUnder("")]
    verified: Annotated[Values, EachUnder("verified_")]
    relative_error: float
    steps: int


class OuterIterations(Section):
    """The outer iterations, each a descent and its verification.

    Attributes:
        resolution: nodes of the verifying mesh along a side; null for a model without a mesh.
        miss_percent: largest relative error of a target, as verified, %; null without verification.
        surrogate_initial: value of the original, by the model of the steps.
        each: the outer iterations in order; none without verification.
    """

    resolution: int | None = None
    miss_percent: float | None = None
    surrogate_initial: Annotated[Values, EachUnder("surrogate_initial_")] = Field(default_factory=dict)
    each: Annotated[tuple[IterationValues, ...], Field(alias="outer_iterations")] = ()


class ChangePercent(Section):
    """A change of pictures in percent of some radiance (`optimize.verification.picture_change.Change`).

    Attributes:
        estimate: the mean absolute difference as it is reported: middle between its bounds.
        mean: upper bound: as read from the pictures, which noise only enlarges.
        mean_error: standard error of `mean` over other random numbers.
        mean_at_least: lower bound: each batch counted by the sign that the others have.
        noise_floor: what `mean` would be had nothing changed.
        rms: root mean square difference as read from the pictures.
        rms_less_noise: root of the unbiased mean square: the mean product of differing batches.
        rms_error: its standard error by the jackknife.
    """

    estimate: float
    mean: float
    mean_error: float
    mean_at_least: float
    noise_floor: float
    rms: float
    rms_less_noise: float
    rms_error: float


class PictureNoise(Section):
    """How well the change of pictures is known.

    Attributes:
        certainty: `known`, `coarse`, `within_noise` or `same`.
        message: the same in a sentence.
        batches: number of independent pictures of which each picture is the mean.
        standard_error_percent: each condition: rms standard error of a pixel of the plate, after, % of their
            mean.
        change_percent_of_mean: the change in % of the mean picture before.
        change_percent_of_white: the change in % of the radiance of white.
        conditions_percent_of_mean: the same as the first, of each condition alone.
        conditions_percent_of_white: the same as the second, of each condition alone.
    """

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
        conditions: names of the rendering conditions: a light, seen by a camera.
        model: model of the pictures of the steps.
        step_bias_percent: each condition: rms difference of the steps' pictures of the original from rendered
            ones without interreflection, free of noise, % of their mean; null, as the next two, where steps
            see no such pictures.
        step_change_percent: as `change_percent`, by the pictures of the steps.
        step_note: a sentence if the verified change is much larger than that, with the likely reason; else
            null.
        change_percent: the change that is reported: mean absolute difference over the pixels that show the
            plate, % of their mean before.
        change_rms_percent: root mean square difference over the same pixels, less noise, % of their mean
            before.
        change_percent_of_white: as `change_percent`, in % of the radiance of white.
        change_rms_percent_of_white: as `change_rms_percent`, in % of the radiance of white.
        plate_share: each condition: share of its pixels that show the plate.
        pixel_change_percent: each condition: mean absolute difference over all pixels of the film, % of
            white.
        rms_change_percent: each condition: root mean square difference over all pixels, % of white.
        mean_change_percent_of_mean: mean absolute difference over all pixels, all conditions alike, % of
            their mean.
        rms_change_percent_of_mean: root mean square of the same.
        dssim: each condition: structural dissimilarity of the pictures as displayed, 0 to 1.
        flip: each condition: FLIP of the pictures as displayed, 0 to 1.
        jod: each condition: just-objectionable differences, 10 for equal pictures; null unless
            `verify.jod`.
        pixels_per_degree: each condition: pixels in a degree of the visual field, for FLIP and JOD.
        distance_cm: from the eye to the plate, cm.
        samples: samples a pixel, of each final picture.
        noise: how well the change is known.
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
    """Heights of the result, and how they changed.

    Attributes:
        min_mm: lowest height of the result, mm.
        max_mm: highest height of the result, mm.
        frozen_fraction: share of the area more than 3 mm below the top of the original, which stays as it
            was.
        lift_mm: mean change of the heights, which is not felt, mm.
        rms_change_mm: root mean square change about that mean, mm.
    """

    min_mm: float
    max_mm: float
    frozen_fraction: float = 0.0
    lift_mm: float
    rms_change_mm: float


class Faults(Section):
    """What of a print is beyond the limits of its printer (`relief.printed.faults`).

    Attributes:
        too_steep_percent: area that is steeper than `max_slope_degrees`, %.
        too_fine_percent: area of ridges and grooves narrower than `min_feature_um`, %.
        too_high_mm: height beyond `max_relief_mm`, mm.
    """

    too_steep_percent: float
    too_fine_percent: float
    too_high_mm: float


class DesignNumbers(Section):
    """The original before layers are cut, against its print.

    Attributes:
        jnd_of_print: JND of the original's print from its design; null if one is smooth.
        seen_change_percent: picture change between design and print of the original that the eye resolves, %.
        too_steep_percent: area of the design that is steeper than `max_slope_degrees`, %.
    """

    jnd_of_print: float | None
    seen_change_percent: float
    too_steep_percent: float


class PrintNumbers(Section):
    """The prints of original and result, and the numbers of their printer.

    Attributes:
        printer: name of the printer.
        pixel_um, layer_um, min_feature_um, max_slope_degrees, max_relief_mm, keep_features: as in the run
            file.
        pixels: rows and columns of the plate.
        acuity_arcmin: angle that a good eye resolves, minutes of arc.
        seen_change_percent: `look.change_percent` of pictures without detail below that angle, at
            `verify.distance_cm`.
        design: the original's design against its print.
        faults_before: faults of the original's print.
        faults_after: faults of the result's print.
    """

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
        stop: why the run ended.
        touch: feel of the result; values of quantities are means over the contact locations.
        outer: verification by the second model.
        look: change of the pictures.
        heights: heights of the result.
        printed: the prints; null without a printer.
        time_s: wall-clock seconds of each part and in `total`.
        cpu_s: CPU seconds of each part and in `total`.
        skin: `name` of the finger, and its parameters.
        versions: versions of the packages.
        variant: variant of Mitsuba.
        seed: seed of the random numbers.
        settings: every setting of the run, as in a run file.
        sha256: checksums of the files that the run read.
    """

    stop: Stop
    touch: Touch
    outer: Annotated[OuterIterations, Field(alias="verification")] = OuterIterations()
    look: PictureChange
    heights: Heights
    printed: Annotated[PrintNumbers | None, Field(alias="print")] = None
    time_s: Mapping[str, float]
    cpu_s: Mapping[str, float] = Field(default_factory=dict)
    skin: Mapping[str, Any] = Field(default_factory=dict)
    versions: Mapping[str, str] = Field(default_factory=dict)
    variant: str | None = None
    seed: int | None = None
    settings: Mapping[str, Any] = Field(default_factory=dict)
    sha256: Mapping[str, str] = Field(default_factory=dict)

    def _repr_html_(self) -> str:
        """What a notebook shows of this verification."""
        touch, places = self.touch, self.touch.places
        rows: dict[str, str | None] = {"stopped": self.stop.message}
        for name, one in QUANTITIES.items():
            by = touch.verified_by if touch.verified.get(name) is not None else touch.model
            ends = " to ".join(number(end) for end in touch.ends_of(name))
            target = f", target {number(touch.target[name])}" if name in touch.target else ""
            rows[one.label] = f"{ends} {one.unit}".rstrip() + f"{target} (by {by})"
        rows["rougher by"] = f"{number(touch.jnd_from_original)} JND"
        if places is not None and places.between is not None:
            ends = f"{number(places.between.jnd_min)} to {number(places.between.jnd_max)} JND"
            rows[f"at {places.between.count} held-out contact locations"] = ends
        rows["change of the pictures"] = f"{percent(self.look.change_percent)} of their mean"
        rows["time"] = duration(self.time_s["total"]) if "total" in self.time_s else None
        return html_table(rows)

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
