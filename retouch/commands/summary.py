"""Summary of a finished run, one screen of text."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relief.common.formats import PLATES
from relief.common.formatting import between, duration, number, percent, plus_minus, rounded
from retouch.commands.options import lines_table
from tactile.jnd import ROUGHNESS_JND, tries_of_100
from tactile.quantities import FLAT_SHARE, PLACE_JND, QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from rich.table import Table


def summary(result: Mapping[str, Any], run_dir: Path) -> "Table":
    """Target, result, pictures, heights, time and files of a run, in about a dozen lines.

    Args:
        result: content of result.json.
        run_dir: where the files lie; only files that exist are named.
    """
    return lines_table(_lines(result, run_dir))


def _lines(result: Mapping[str, Any], run_dir: Path) -> Iterator[tuple[str, str]]:
    stop, touch, look = result["stop"], result["touch"], result["look"]
    yield "stop", f"{stop['message']} (step {stop['best_step']} of {stop['steps']} kept)"
    other = touch.get("feel_of")
    whose = {} if other is None else dict.fromkeys(other["quantities"], f" (the feel of {other['name']})")
    for name, quantity in QUANTITIES.items():
        stages = [
            ("original", touch[f"initial_{name}"]),
            (f"target{whose.get(name, '')}", touch[f"target_{name}"]),
            ("achieved", touch[name]),
            (f"verified ({touch['verified_by']})", touch[f"verified_{name}"]),
        ]
        yield quantity.label, f"{_listed(stages)} {quantity.unit}".rstrip()
    yield "in contact", f"{100.0 * touch['contact_fraction']:.0f} % of the plate"
    if (jnd := touch["jnd_from_original"]) is not None:
        sense = "rougher" if jnd > 0 else "smoother"
        apart = f"told apart in {tries_of_100(jnd)} of 100 tries"
        average = " on average" if (touch.get("places") or {}).get("count", 1) > 1 else ""
        yield "feel", f"{number(abs(jnd), 2)} JND {sense} than the original{average}, {apart}"
    if (places := touch.get("places")) is not None and places["count"] > 1:
        yield from _places(places)
    if (fingers := touch.get("fingers")) is not None and fingers["jnd_min"] is not None:
        yield "", other_fingers(fingers)
    yield from _pictures(look)
    if (made := result.get("print")) is not None:
        seen = f"to the eye {percent(made['seen_change_percent'])} at {look['distance_cm']:g} cm"
        yield "printer", f"{made['printer']}: both as printed, {made['layer_um']:g} µm layers; {seen}"
    steered = touch.get("model"), look.get("model")
    if steered not in ((None, None), ("layer", "exact")):
        yield "steered by", f"touch {steered[0]}, pictures {steered[1]}"
    yield "heights", _heights(result["heights"])
    times = dict(result["time_s"])
    total = duration(times.pop("total"))
    yield "time", f"{total}: " + ", ".join(f"{k.replace('_', '-')} {duration(s)}" for k, s in times.items())
    yield "report", str(run_dir / "report.html")
    if printable := [str(run_dir / name) for name in PLATES if (run_dir / name).is_file()]:
        yield "to print", ", ".join(printable)


def _places(places: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """The feel over the places of the finger; a steered place that missed its goal is named."""
    if places["jnd_min"] is not None:
        ends = f"{places['jnd_min']:+.2f} to {places['jnd_max']:+.2f} JND"
        far = places.get("farthest_from_target_jnd")
        target = "" if far is None else f", at most {far:.2f} JND off the target"
        yield "", f"{ends} over {places['count']} places of the finger{target}"
    steered = places["steered"]
    reached, goals = (steered.get(f"{key}_{ROUGHNESS.name}", []) for key in ("verified", "target"))
    off = [
        (abs(math.log(value / goal)) / math.log(ROUGHNESS_JND), place)
        for place, (value, goal) in enumerate(zip(reached, goals, strict=False))
        if min(value, goal) > FLAT_SHARE * sum(goals) / len(goals)
    ]
    if off and max(off)[0] > PLACE_JND:
        farthest = max(off)[1]
        down, right = steered["centres_mm"][farthest]
        yield (
            "farthest",
            f"the place {right:.1f} mm from the left and {down:.1f} mm from the top reaches roughness "
            f"{number(reached[farthest])} of {number(goals[farthest])}",
        )


def other_fingers(fingers: Mapping[str, Any]) -> str:
    """How other fingers feel a change, in a clause: the entry `fingers` of result.json, of known JND."""
    weight = fingers.get("weight")
    drawn = f", drawn along with weight {weight:g}" if weight else ""
    return f"{fingers['jnd_min']:+.2f} to {fingers['jnd_max']:+.2f} JND to {fingers['count']} fingers{drawn}"


def _pictures(look: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    noise = look["noise"]
    if noise["certainty"] == "same":
        yield "pictures", noise["message"]
        return
    of_mean, of_white = noise["change_percent_of_mean"], noise["change_percent_of_white"]
    if noise["certainty"] == "within_noise":
        yield "pictures", f"{noise['message']} It is at most"
        yield "", f"{percent(of_mean['mean'])} of the mean picture, {percent(of_white['mean'])} of white"
    else:
        about = "about " if noise["certainty"] == "coarse" else ""
        change = f"{percent(of_mean['estimate'])} of the mean picture"
        yield "pictures", f"changed by {about}{change} (mean over the pixels that show the plate)"
        yield "", f"bounds {_bounds(of_mean)}"
        yield "", f"of white {percent(of_white['estimate'])}; bounds {_bounds(of_white)}"
    if noise["certainty"] == "coarse":
        yield "", noise["message"]
    if noise["certainty"] != "known":
        yield "", f"{look['samples']} samples a pixel; more make it clearer (verify.samples)"


def _bounds(change: Mapping[str, float]) -> str:
    mean = between(max(0.0, change["mean_at_least"]), change["mean"])
    return f"{mean}, rms {plus_minus(change['rms_less_noise'], change['rms_error'])} %"


def _heights(heights: Mapping[str, float]) -> str:
    change, lift = (1000.0 * heights[key] for key in ("rms_change_mm", "lift_mm"))
    changed = f"changed by {rounded(change)} µm (rms about the mean)"
    if frozen := heights.get("frozen_fraction", 0.0):
        return f"{changed}; {100.0 * frozen:.3g} % of the area, more than 3 mm below the top, stays as it was"
    lifted = f"; {'lifted' if lift > 0 else 'lowered'} by {rounded(abs(lift))} µm, which is not felt"
    return f"{changed}{lifted if abs(lift) >= 0.5 else ''}"


def _listed(values: list[tuple[str, float | None]]) -> str:
    return ", ".join(f"{name} {number(value)}" for name, value in values if value is not None)
