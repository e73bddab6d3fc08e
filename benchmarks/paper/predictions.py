"""What the paper's experiments found with people (figures 22, 25 and 5.5.1), predicted from our plates.

Touch by Thurstone's model: plates are felt where they are plus normal noise, so that one just-noticeable
difference is told right in 84 of 100 tries. Eye by ColorVideoVDP, where a study has its column.
"""

from __future__ import annotations

from itertools import pairwise
from statistics import fmean, median
from typing import Any

import tactile
from benchmarks.paper.study_rows import rows_of
from retouch.laboratory.stimulus_sets.prediction import (
    cold_jnd,
    far_discrepancy,
    neighbours_right,
    probability,
)

PEOPLE = 10
"""Participants of the paper's sorting experiment."""
JOD_LIMIT = 9.0
"""JOD below which plates would be distinguished: one less than the 10 of identical pictures."""
OPTIMISED, SCALED = "gauss-newton", "scaling"


def by_eye() -> dict[str, Any]:
    """Figure 22: picture changes of optimised and scaled plates, and which pairs would be distinguished."""
    rows = rows_of("figure22")
    found: dict[str, Any] = {"plates": len(rows)}
    for method in (OPTIMISED, SCALED):
        each = [row for row in rows if row["descent.method"] == method]
        jods = [row["jod"] for row in each if row.get("jod") is not None]
        found[method] = {
            "plates": len(each),
            "dssim": median(row["dssim"] for row in each),
            "jod": median(jods) if jods else None,
            "told_apart": sum(jod < JOD_LIMIT for jod in jods) if jods else None,
        }
    ours, theirs = ({_plate(r): r for r in rows if r["descent.method"] == m} for m in (OPTIMISED, SCALED))
    shared = ours.keys() & theirs.keys()
    found["nearer_than_scaled"] = sum(ours[p]["dssim"] < theirs[p]["dssim"] for p in shared)
    found["pairs"] = len(shared)
    return found


def by_touch() -> dict[str, Any]:
    """Figure 25: how often five plates would be sorted as designed, by their verified roughness."""
    sets: dict[str, dict[float, float]] = {}
    for row in rows_of("figure22"):
        if row["descent.method"] == OPTIMISED:
            plates = sets.setdefault(row["texture"], {0.0: 0.0})
            plates[row["touch.jnd"]] = tactile.jnd_apart(row["verified_roughness"], row["initial_roughness"])
    whole = {name: [jnd for _, jnd in sorted(plates.items())] for name, plates in sets.items()}
    whole = {name: jnds for name, jnds in whole.items() if len(jnds) == 5}
    neighbours = [neighbours_right(jnds) for jnds in whole.values()]
    wrong = [far_discrepancy(jnds) for jnds in whole.values()]
    return {
        "sets": len(whole),
        "neighbours_percent": 100.0 * fmean(neighbours) if neighbours else None,
        "far_discrepancies": PEOPLE * sum(wrong),
        "of_sorts": PEOPLE * len(whole),
    }


def by_cold() -> dict[str, Any]:
    """Section 5.5.1: how often the plate with more contact would be called the colder one."""
    plates: dict[str, dict[float, float]] = {}
    for row in rows_of("figure17"):
        if row["descent.method"] == OPTIMISED:
            areas = plates.setdefault(row["texture"], {1.0: row["initial_contact_area_mm2"]})
            areas[row["touch.contact_area_scale"]] = row["verified_contact_area_mm2"]
    one, two = [], []
    for areas in plates.values():
        ordered = [area for _, area in sorted(areas.items())]
        one += [probability(cold_jnd(b, a)) for a, b in pairwise(ordered)]
        if len(ordered) == 3:
            two.append(probability(cold_jnd(ordered[2], ordered[0])))
    return {
        "one_jnd_percent": 100.0 * fmean(one),
        "two_jnd_percent": 100.0 * fmean(two) if two else None,
    }


def _plate(row: dict[str, Any]) -> tuple[str, float]:
    return row["texture"], row["touch.jnd"]
