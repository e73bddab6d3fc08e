"""Which finger is the default: facts of touch for skins of several kinds, and a finger that was measured.

python -m benchmarks.skin            # all that is not in the results yet; JSON, pictures, tables
python -m benchmarks.skin --again    # all of them anew
"""

from __future__ import annotations

import math
from typing import Any

from benchmarks.shared.common import again_given, load, machine, save, table
from benchmarks.skin import finger_study
from benchmarks.skin.chart import draw
from benchmarks.skin.experiment_plates import natural, series
from benchmarks.skin.facts import FACTS, VALUES, Outcome, in_range
from benchmarks.skin.plate_pressing import pressed
from relief.ground.progress import say
from retouch.laboratory.published.rules import top
from tactile.skin import Skin

SHOWN = ("F/E 20", "F/E 10", "F/E 4", "F/E 2", "0.7 mm of 2 over 0.4 MPa")
"""Skins of the table, before the layered one that the fit chose; the last is halfway to it."""
FORCE_N = 10.0
BASES_MPA, TOPS_MPA, TOPS_MM = (0.1, 0.2, 0.4), (1.0, 2.0, 3.0, 4.0), (0.4, 0.7, 1.0)
"""Grid of layered skins: modulus of the tissue below, modulus and thickness of the layer above."""


def main() -> None:
    again = again_given(__doc__)
    results: dict[str, Any] = {} if again else load("skin")
    plates, reliefs = series(), natural()
    skins = plain() | layered()
    felt = results.setdefault("felt", {})
    for name, skin in skins.items():
        if name not in felt:
            say(name)
            felt[name] = pressed(skin, plates, reliefs)
            save("skin", results | {"machine": machine()})
    results["facts"] = {
        name: {fact.name: vars(fact.of(felt[name])) for fact in FACTS} for name in skins if name in felt
    }
    results["ranking"] = ranking(felt)
    save("skin", results | {"machine": machine()})
    shown = [*SHOWN, results["ranking"][0]]
    rows = []
    for fact in FACTS:
        outcomes = [fact.of(felt[name]) for name in shown]
        rows.append([fact.name + " (fit)" * fact.fit, *map(_cell, outcomes)])
    for title, chosen in (
        ("fit", [f for f in FACTS if f.fit]),
        ("predicted", [f for f in FACTS if not f.fit]),
    ):
        counts = [sum(fact.of(felt[name]).right for fact in chosen) for name in shown]
        rows.append([f"right, {title}", *(f"{count} of {len(chosen)}" for count in counts)])
    print(table(["fact", *shown], rows))
    draw(felt, results["ranking"][0])
    finger_study.main(again)


def plain() -> dict[str, Skin]:
    """Skins of one modulus, by force over modulus in mm²."""
    return {
        f"F/E {ratio:g}": Skin(young_modulus_mpa=FORCE_N / ratio) for ratio in (40.0, 20.0, 10.0, 4.0, 2.0)
    }


def layered() -> dict[str, Skin]:
    """The grid of layered skins, by thickness and modulus of the layer and modulus of the base."""
    return {
        f"{mm:g} mm of {top:g} over {base:g} MPa": Skin(young_modulus_mpa=base, layers=((mm, top),))
        for mm in TOPS_MM
        for top in TOPS_MPA
        for base in BASES_MPA
    }


def ranking(felt: dict[str, Any]) -> list[str]:
    """Layered skins by right facts of the fit, then natural reliefs in range, then the peak near 2.5 mm."""

    def worse(name: str) -> tuple[int, int, float]:
        right = sum(fact.of(felt[name]).right for fact in FACTS if fact.fit)
        return (
            -right,
            -in_range(felt[name]),
            abs(math.log(top(VALUES["spacing"], felt[name]["spacing"]) / 2.5)),
        )

    return sorted((name for name in layered() if name in felt), key=worse)


def _cell(outcome: Outcome) -> str:
    return f"{outcome.told} {'right' if outcome.right else '**wrong**'}"


if __name__ == "__main__":
    main()
