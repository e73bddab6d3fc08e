"""Summary of a finished run, one screen of text."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from relief.ground.formats import PLATES
from relief.ground.formatting import between, duration, number, percent, plus_minus, rounded
from retouch.pages import sentences
from tactile.jnd import ROUGHNESS_JND
from tactile.quantities import FLAT_SHARE, GAPS_COUNT, PLACE_JND, QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from optimize.verification import verification


def summary(
    result: "verification.Verification", run_dir: Path, verbose: bool = False
) -> Iterator[tuple[str, str]]:
    """Target, result, pictures, heights, time and files of a run: about ten words, each with a sentence.

    Args:
        result: what was measured of the result.
        run_dir: where the files lie; only files that exist are named.
        verbose: print also how well each number is known, and the time of each part.
    """
    stop, look = result.stop, result.look
    yield "stop", f"{stop.message} (step {stop.best_step} of {stop.steps} kept)"
    yield from _feel(result.touch, verbose)
    yield from _pictures(look, verbose)
    if (printed := result.printed) is not None:
        seen = f"to the eye {percent(printed.seen_change_percent)} at {look.distance_cm:g} cm"
        yield "printer", f"{printed.printer}: both as printed, {printed.layer_um:g} µm layers; {seen}"
        if (change := sentences.change_by_printing(result)) is not None:
            yield "", change
    models = result.touch.model, look.model
    if models not in ((None, None), ("layer", "exact")):
        yield "steered by", f"touch {models[0]}, pictures {models[1]}"
    yield "heights", _heights(result.heights)
    times = dict(result.time_s)
    total = duration(times.pop("total"))
    parts = ", ".join(f"{name.replace('_', '-')} {duration(seconds)}" for name, seconds in times.items())
    yield "time", f"{total}: {parts}" if verbose else total
    yield "report", str(run_dir / "report.html")
    if printable := [str(run_dir / name) for name in PLATES if (run_dir / name).is_file()]:
        yield "to print", ", ".join(printable)


def _feel(touch: "verification.Touch", verbose: bool) -> Iterator[tuple[str, str]]:
    """The change of roughness, and values of every quantity: means over the places, if there are several."""
    other, places = touch.feel_of, touch.places
    several = places is not None and places.count > 1
    for line, clause in enumerate(_change(touch, several)):
        yield "" if line else "feel", clause
    if places is not None and several:
        yield from _farthest(places)
    means = f" (means over {places.steered.count} places)" if places is not None and several else ""
    whose = {} if other is None else dict.fromkeys(other.quantities, f" (the feel of {other.name})")
    for name, quantity in QUANTITIES.items():
        stages = [
            ("original", touch.initial.get(name)),
            (f"target{whose.get(name, '')}", touch.target.get(name)),
            ("achieved", touch.achieved.get(name)),
            (f"verified ({touch.verified_by})", touch.verified.get(name)),
        ]
        yield quantity.label, f"{_listed(stages)} {quantity.unit}".rstrip() + means
    if verbose:
        yield "in contact", f"{100.0 * touch.contact_fraction:.0f} % of the patch; {GAPS_COUNT}"
        if (bound := touch.contact_error_bound) is not None:
            error = f"error of its energy at most {bound:.0e} of the elastic energy"
            yield "contact solved", f"{error}, at every place"

    if verbose or touch.jnd_from_original is None:
        for line, band in enumerate(touch.surface_bands or ()):
            yield "" if line else "skin's surface", sentences.surface_band(band)


def _change(touch: "verification.Touch", several: bool) -> Iterator[str]:
    """The change of roughness: its mean, unless its target varies, its ends over places, to other fingers."""
    places = touch.places
    varied = places is not None and places.varied
    average = " on average" if several else ""
    if (jnd := touch.jnd_from_original) is None:
        yield sentences.smooth_change(*touch.ends_of(ROUGHNESS.name)) + average
    elif not varied:
        yield f"{sentences.jnd_in_words(jnd)} than the original{average}, {sentences.told_apart(jnd)}"
    if places is not None and several and places.jnd_min is not None:
        ends = f"{places.jnd_min:+.2f} to {places.jnd_max:+.2f} JND{' from the original' * varied}"
        far = places.farthest_from_target_jnd
        target = "" if far is None else f", at most {far:.2f} JND off the target"
        yield f"{ends} over {places.count} places of the finger{target}"
    if (fingers := touch.fingers) is not None and fingers.jnd_min is not None:
        yield sentences.other_fingers(fingers, several)
    if (measured := touch.measured) is not None and measured.jnd_mean is not None:
        yield sentences.measured_finger(measured)


def _farthest(places: "verification.Places") -> Iterator[tuple[str, str]]:
    """The steered place that missed its goal most, if one did."""
    steered, name = places.steered, ROUGHNESS.name
    reached, goals = steered.verified[name], steered.target.get(name, ())
    off = [
        (abs(math.log(value / goal)) / math.log(ROUGHNESS_JND), place)
        for place, (value, goal) in enumerate(zip(reached, goals, strict=False))
        if min(value, goal) > FLAT_SHARE * sum(goals) / len(goals)
    ]
    if off and max(off)[0] > PLACE_JND:
        farthest = max(off)[1]
        down, right = steered.centres_mm[farthest]
        place = f"the place {right:.1f} mm from the left and {down:.1f} mm from the top"
        roughness = f"{number(reached[farthest])} of {number(goals[farthest])}"
        yield "farthest", f"{place} reaches roughness {roughness}"


def _pictures(look: "verification.PictureChange", verbose: bool) -> Iterator[tuple[str, str]]:
    noise = look.noise
    if noise.certainty == "same":
        yield "pictures", noise.message
        return
    seen = look.step_change_percent
    by_steps = "" if seen is None else f"; steps saw {percent(seen)}"
    of_mean, of_white = noise.change_percent_of_mean, noise.change_percent_of_white
    if noise.certainty == "within_noise":
        yield "pictures", f"{noise.message} It is at most"
        white = f", {percent(of_white.mean)} of white" if verbose else ""
        yield "", f"{percent(of_mean.mean)} of the mean picture{white}{by_steps}"
    else:
        about = "about " if noise.certainty == "coarse" else ""
        yield "pictures", f"changed by {about}{percent(of_mean.estimate)} of the mean picture{by_steps}"
        if verbose:
            yield "", "(mean over the pixels that show the plate)"
            yield "", f"bounds {_bounds(of_mean)}"
            yield "", f"of white {percent(of_white.estimate)}; bounds {_bounds(of_white)}"
    if look.step_note:
        yield "", look.step_note
    if noise.certainty == "coarse":
        yield "", noise.message
    if noise.certainty != "known":
        yield "", f"{look.samples} samples a pixel; more make it clearer (verify.samples)"


def _bounds(change: "verification.ChangePercent") -> str:
    mean = between(max(0.0, change.mean_at_least), change.mean)
    return f"{mean}, rms {plus_minus(change.rms_less_noise, change.rms_error)} %"


def _heights(heights: "verification.Heights") -> str:
    change, lift = 1000.0 * heights.rms_change_mm, 1000.0 * heights.lift_mm
    changed = f"changed by {rounded(change)} µm (rms about the mean)"
    if frozen := heights.frozen_fraction:
        return f"{changed}; {100.0 * frozen:.3g} % of the area, more than 3 mm below the top, stays as it was"
    lifted = f"; {'lifted' if lift > 0 else 'lowered'} by {rounded(abs(lift))} µm, which is not felt"
    return f"{changed}{lifted if abs(lift) >= 0.5 else ''}"


def _listed(values: list[tuple[str, float | None]]) -> str:
    return ", ".join(f"{name} {number(value)}" for name, value in values if value is not None)
