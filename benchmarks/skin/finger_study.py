"""The study of the measured finger: calibration, facts that it predicts, and results it feels; see `main`."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from benchmarks.shared.common import load, machine, save, table
from benchmarks.skin.calibration import DRAWS, SHARES, SPHERE_MM, calibration, solved_fingers
from benchmarks.skin.carried import ALL, FEW, felt_by, tiles
from benchmarks.skin.experiment_plates import APART_MM, DOT_MM, HIGH_MM
from benchmarks.skin.facts import AGAINST, FINGER_FACTS, VALUES, Fact
from benchmarks.skin.finger_chart import draw
from benchmarks.skin.plate_pressing import EXPLORING_N
from benchmarks.skin.posterior import direct, finger, residuals
from benchmarks.skin.quarter import groove_depths
from benchmarks.skin.round_pressing import (
    EXPLORED,
    FORCES_N,
    WAYS,
    RoundFinger,
    exploring,
    flat_exploring,
    pressed_round,
)
from benchmarks.skin.round_stimuli import dot_plates
from benchmarks.skin.sources import GROOVE_FORCE_N, GROOVES, MECHANICAL
from optimize.settings.skins import load_skin
from relief.ground.progress import say
from retouch.laboratory.published.rules import top
from tactile.skin import Skin

NAME = "finger"
"""Name of the results."""
OWN_FORCE = ("spacing", "diameter", "diameter, high", "height", "waves", "ridges", "natural", "force")
"""Series at the finger's own force."""
NAMED = ("measured", "measured-soft", "measured-stiff")
SHOWN = ("paper", "measured, 0.6 N", "measured", "measured, 2 N", "measured-soft", "measured-stiff")
"""Fingers of the table of facts, before the draws."""
LANDS_MM = (0.25, 0.5, 1.0, 20.0)
"""Widths of lands between the grooves, where they are not as wide as the grooves."""
STIFFENS = "moduli that grow with force"
"""Name of the variant that stiffens."""
STIFFENING = 0.4
"""Power of force by which moduli grow in the variant that stiffens: the posterior's median."""


def main(again: bool) -> None:
    """Make what is not in `results/finger.json` yet, and print the tables."""
    results: dict[str, Any] = {} if again else load(NAME)

    def keep() -> None:
        save(NAME, results | {"machine": machine()})

    depths = results.setdefault("solved", {})
    if "calibration" not in results:
        results["calibration"] = calibration(solved_fingers(depths, keep))
        keep()
    felt = results.setdefault("felt", {})
    for name, make in fingers(results["calibration"]["sample"]).items():
        if name not in felt:
            say(name)
            felt[name] = make()
            keep()
    for name in ("measured, 0.6 N", "measured, 2 N"):
        felt[name] |= {key: value for key, value in felt["measured"].items() if key.endswith("exploring")}
    every = (*FINGER_FACTS, AGAINST)
    results["facts"] = {name: {fact.name: vars(fact.of(one)) for fact in every} for name, one in felt.items()}
    peaks_alone(results, keep)
    results["mechanics of variants"] = {
        name: {
            source.name: residuals(source, direct(skin, SPHERE_MM)[source.name]).tolist()
            for source in MECHANICAL
        }
        for name, skin in variants(load_skin("measured")).items()
    }
    results["lands"] = {
        f"{land:g} mm": groove_depths(load_skin("measured"), GROOVES.at, (GROOVE_FORCE_N,), land_mm=land)[
            0
        ].tolist()
        for land in LANDS_MM
    }
    carried(results, keep)
    keep()
    draw(results)
    for title, text in tables(results).items():
        print(f"\n{title}\n\n{text}")


def fingers(sample: list[dict[str, float]]) -> dict[str, Callable[[], dict[str, Any]]]:
    """What each finger feels, by name: named ones, draws of the posterior, `measured` with a change."""
    middle = load_skin("measured")

    def own(skin: Skin) -> dict[str, Any]:
        return pressed_round(skin, OWN_FORCE)

    def whole(skin: Skin) -> dict[str, Any]:
        return own(skin) | exploring(skin)

    def paper() -> dict[str, Any]:
        return dict(load("skin")["felt"]["F/E 20"]) | flat_exploring(Skin())

    found: dict[str, Callable[[], dict[str, Any]]] = {
        "paper": paper,
        "measured": lambda: pressed_round(middle, ("spacing",), WAYS) | own(middle) | exploring(middle, WAYS),
        "measured, 0.6 N": lambda: own(replace(middle, force_n=0.6)),
        "measured, 2 N": lambda: own(replace(middle, force_n=2.0)),
    }
    others = {name: load_skin(name) for name in NAMED[1:]}
    others |= {f"draw {number}": finger(values) for number, values in enumerate(sample[:DRAWS], 1)}
    for name, skin in (others | variants(middle)).items():
        found[name] = partial(whole, skin)
    found[STIFFENS] = lambda: stiffening(middle)
    return found


def variants(middle: Skin) -> dict[str, Skin]:
    """The measured finger with one change, by what is changed."""
    ((thickness, modulus),) = middle.layers
    base = middle.young_modulus_mpa
    return {
        "receptors at 0.5 mm": replace(middle, depth_mm=0.5),
        "receptors at 1 mm": replace(middle, depth_mm=1.0),
        "layer of 0.4 mm": replace(middle, layers=((0.4, modulus),)),
        "layer of 0.8 mm": replace(middle, layers=((0.8, modulus),)),
        "layer twice as stiff": replace(middle, layers=((thickness, 2.0 * modulus),)),
        "layer four times as stiff": replace(middle, layers=((thickness, 4.0 * modulus),)),
        "base twice as stiff": replace(middle, young_modulus_mpa=2.0 * base),
        "radius of 7 mm": replace(middle, radius_mm=7.0),
        "0.5 mm of 0.35 over 0.03 MPa": replace(
            middle, layers=((0.5, 0.35),), young_modulus_mpa=0.03, radius_mm=8.0
        ),
    }


def stiffening(skin: Skin) -> dict[str, Any]:
    """What a finger feels whose moduli grow by the power `STIFFENING` of force from those at 1 N."""

    def at(force: float) -> Skin:
        scale = force**STIFFENING
        layers = tuple((thickness, scale * modulus) for thickness, modulus in skin.layers)
        return replace(skin, force_n=force, young_modulus_mpa=scale * skin.young_modulus_mpa, layers=layers)

    weights, plates = dot_plates(DOT_MM, HIGH_MM, APART_MM)
    force = [float(weights @ RoundFinger(at(one)).felt(plates)[0]["V"]) for one in FORCES_N]
    return pressed_round(skin, OWN_FORCE) | {"force": force} | exploring(at(EXPLORING_N))


def peaks_alone(results: dict[str, Any], keep: Callable[[], object]) -> None:
    """Spacing of the roughest dots at `EXPLORING_N`, mm, to draws of the posterior of each source alone."""
    found = results.setdefault("alone", {})
    for name, sample in results["calibration"]["alone"].items():
        if name not in found:
            say(f"dots by {name} alone")
            skins = [replace(finger(values), force_n=EXPLORING_N) for values in sample]
            found[name] = [
                top(VALUES["spacing"], pressed_round(skin, ("spacing",))["spacing"]) for skin in skins
            ]
            keep()


def carried(results: dict[str, Any], keep: Callable[[], object]) -> None:
    """What fingers feel of tiles that were steered for the default one, JND at each place."""
    found = results.setdefault("carried", {})
    middle = load_skin("measured")
    wanted = {name: (load_skin(name), ALL) for name in NAMED}
    wanted |= {f"measured, {force:g} N": (replace(middle, force_n=force), ALL) for force in (0.6, 2.0)}
    wanted |= {
        f"draw {number}": (finger(values), FEW)
        for number, values in enumerate(results["calibration"]["sample"], 1)
    }
    left = {name: one for name, one in wanted.items() if name not in found}
    pairs = tiles() if left else {}
    for name, (skin, along) in left.items():
        say(f"{name}: tiles")
        found[name] = felt_by(skin, pairs, along)
        keep()


def tables(results: dict[str, Any]) -> dict[str, str]:
    """The tables of the page, by title."""
    done = results["calibration"]
    quantities = ("radius_mm", "thickness_mm", "layer_mm", "layer_mpa", "base_mpa", "ratio", "diameter_mm")
    titles = ["quantity", *(f"{name}: {share:g}" for name in done["posterior"] for share in SHARES[::2])]
    posterior = [
        [
            quantity,
            *(value for one in done["posterior"].values() for value in one["quantiles"][quantity][::2]),
        ]
        for quantity in quantities
    ]
    fits = [
        [
            f"{source.name} {at:g} mm",
            source.values[column],
            *(one["model"][source.name][column][2] for one in done["posterior"].values()),
            *(one["model"][source.name][column] for one in done["fingers"].values()),
            done["fingers"]["measured"]["residual"][source.name][column],
            done["stiffening"]["mean residual"][source.name][column],
        ]
        for source in MECHANICAL
        for column, at in enumerate(source.at)
    ]
    heads = [*(f"fit to {name}" for name in done["posterior"]), *done["fingers"]]
    return {
        "Posterior": table(titles, posterior),
        "Fit": table(["", "people", *heads, "log error of measured", "mean log error, stiffening"], fits),
        "Mechanics of the finger with one change, log errors": table(
            ["", *(f"{source.name} {at:g}" for source in MECHANICAL for at in source.at)],
            [
                [name, *(f"{error:+.2f}" for source in MECHANICAL for error in one[source.name])]
                for name, one in results["mechanics of variants"].items()
            ],
        ),
        "Depths of measured between other lands, mm": table(
            ["lands", *(f"{at:g}" for at in GROOVES.at)],
            [[land, *depths] for land, depths in results["lands"].items()],
        ),
        "Roughest spacing at 0.6 N by one source alone, mm": table(
            ["", "least", "median", "greatest"],
            [[n, min(peaks), statistics.median(peaks), max(peaks)] for n, peaks in results["alone"].items()],
        ),
        "Facts": facts_table(results, SHOWN),
        "Facts over the posterior": facts_table(results, [f"draw {n}" for n in range(1, DRAWS + 1)]),
        "Facts, one change": facts_table(results, [*variants(load_skin("measured")), STIFFENS]),
        "Ways of V": ways_table(results["felt"]["measured"]),
        "Carried": carried_table(results["carried"]),
    }


def facts_table(results: dict[str, Any], names: list[str] | tuple[str, ...]) -> str:
    """Facts by finger, and how many each gets right."""
    facts = results["facts"]

    def cell(name: str, fact: Fact) -> str:
        outcome = facts[name][fact.name]
        return outcome["told"] if outcome["right"] else f"{outcome['told']} **wrong**"

    rows = [[fact.name, *(cell(name, fact) for name in names)] for fact in (*FINGER_FACTS, AGAINST)]
    right = [sum(facts[name][fact.name]["right"] for fact in FINGER_FACTS) for name in names]
    rows.append(["right", *(f"{count} of {len(FINGER_FACTS)}" for count in right)])
    return table(["fact", *names], rows)


def ways_table(felt: dict[str, Any]) -> str:
    """Curves of the measured finger by the ways of V, each over its top."""
    rows = []
    for name in ("spacing", *(f"{one}, exploring" for one in EXPLORED[:3])):
        for way in WAYS:
            curve = felt[name if way == "V" else f"{way}: {name}"]
            rows.append([name, way, max(curve), " ".join(f"{one / max(curve):.2f}" for one in curve)])
    return table(["series", "V", "highest", "over its highest"], rows)


def carried_table(found: dict[str, dict[str, list[float]]]) -> str:
    """JND of each tile: mean and range over places of named fingers, median and range of means over draws."""
    names = list(next(iter(found.values())))
    rows = []
    for finger_name, tiles_felt in found.items():
        if not finger_name.startswith("draw"):
            rows.append([finger_name, *(_range(tiles_felt[name], statistics.fmean) for name in names)])
    draws = [one for name, one in found.items() if name.startswith("draw")]
    means = {name: [statistics.fmean(one[name]) for one in draws] for name in names}
    rows.append(
        [f"posterior, {len(draws)} draws", *(_range(means[name], statistics.median) for name in names)]
    )
    return table(["felt by", *names], rows)


def _range(values: list[float], middle: Callable[[list[float]], float]) -> str:
    return f"{middle(values):+.2f} ({min(values):+.2f} to {max(values):+.2f})"
