"""Results all over tiles and plates as a table, from the documents of their studies.

retouch study tiles -o runs/tiles --from benchmarks/results/studies/tiles.json
cp runs/tiles/study.json benchmarks/results/studies/tiles.json
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.shared.common import table
from benchmarks.shared.finished_studies import Row, committed

ONE, ALL = "one place", "all over"
LEFT_OUT = "waves"
"""Start of the name of the texture that cannot be made smoother, which has lines of its own."""


def cases() -> dict[tuple[str, float], dict[str, Row]]:
    """By texture and target, the rows by how they were made; those alone that are steered in both ways."""
    found: dict[tuple[str, float], dict[str, Row]] = {}
    for kind, row in (
        *((str(row["touches"]), row) for row in committed("tiles", "tiles")),
        *(("scaled", row) for row in committed("tiles", "scaled")),
    ):
        found.setdefault((row["texture"], row["touch.jnd"]), {})[kind] = row
    return {case: rows for case, rows in found.items() if {ONE, ALL} <= rows.keys()}


def at_equal_feel(texture: str, by: Mapping[str, Row]) -> float | None:
    """Change of the pictures all over, in units of that by one place which feels the same elsewhere.

    One place is steered to two targets; between them the logarithm of the change is taken as linear in what
    other places feel. None if the second is not computed or changes nothing elsewhere.
    """
    sign = np.sign(by[ONE]["touch.jnd"])
    aimed = [
        row
        for row in committed("tiles", "aimed")
        if row["texture"] == texture and row["reason"] == "converged" and sign * row["touch.jnd"] > 0.0
    ]
    if not aimed:
        return None
    felt, changes = zip(
        *((abs(row["between_mean_jnd"]), row["change_rms_percent"]) for row in (by[ONE], aimed[0])),
        strict=True,
    )
    if felt[1] <= felt[0]:
        return None
    share = (abs(by[ALL]["between_mean_jnd"]) - felt[0]) / (felt[1] - felt[0])
    return float(by[ALL]["change_rms_percent"] / (changes[0] * (changes[1] / changes[0]) ** share))


def as_text() -> str:
    """How far held-out locations are off, waves apart, and what all locations cost."""
    tiles = cases().values()
    surfaces = {
        "tile of 10 mm, one location": [by[ONE] for by in tiles],
        "tile of 10 mm, 16 locations": [by[ALL] for by in tiles],
        "plate of 25 mm, 49 locations": committed("plates"),
    }
    plain, equal = ratios()
    text = table(
        ("optimised at", "cases", "mean off, JND: median, largest", "worst location off: median, largest"),
        [
            _line(name + (", waves" if apart else ""), [row for row in rows if _apart(row) == apart])
            for apart in (False, True)
            for name, rows in surfaces.items()
        ],
    )
    return (
        f"{text}\n\nAll locations of a tile change the pictures {min(plain):.2f} to {max(plain):.2f} times "
        f"as much as one (rms, waves left out); at equal feel {min(equal):.2f} to {max(equal):.2f} times, "
        f"{np.median(equal):.2f} in the median."
    )


def _apart(row: Row) -> bool:
    return str(row["texture"]).startswith(LEFT_OUT)


def _line(name: str, rows: Sequence[Row]) -> list[object]:
    off = (np.abs([row[f"between_{key}_jnd"] for row in rows]) for key in ("off", "worst"))
    return [name, len(rows), *(f"{np.median(each):.2f}, {each.max():.2f}" for each in off)]


def ratios() -> tuple[list[float], list[float]]:
    """Rms change all over, over that of one location: as it is, and at equal feel; waves left out."""
    found = [(texture, by) for (texture, _), by in cases().items() if not texture.startswith(LEFT_OUT)]
    plain = [by[ALL]["change_rms_percent"] / by[ONE]["change_rms_percent"] for _, by in found]
    return plain, [one for texture, by in found if (one := at_equal_feel(texture, by)) is not None]
