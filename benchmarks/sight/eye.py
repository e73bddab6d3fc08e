"""What the eye sees of a change of feel, by what steps keep: the table of the study `eye`.

retouch study eye -o runs/eye        # 168 runs, an hour of one core
python -m benchmarks.sight.eye [FOLDER]

With a folder its document is committed first. The weight of broad changes was chosen on six of the textures;
the other six judge it.
"""

from collections.abc import Sequence
from statistics import fmean, geometric_mean, median

from benchmarks.shared.common import publish, table
from benchmarks.shared.finished_studies import Row, committed_anew

CHOSEN_ON = ("gravel", "pebbles", "leather", "weave", "bark", "knit")
PIXELS, BROAD, ADAM = "pixels", "broad changes too", "adam"
VISIBLE = 9.0
"""JOD below which a case counts: one JOD less than the same picture is seen by three of four people."""
HEAD = [
    *("textures", "kept", "runs", "10 - JOD, median", "largest", "JOD below 9"),
    *("FLIP", "DSSIM", "change, mean %", "rms ratio", "CPU ratio"),
]


def _kept(row: Row) -> str:
    return ADAM if row["table"] == ADAM else str(row["kept"])


def _line(group: str, rows: Sequence[Row], before: dict[tuple[str, int], Row]) -> tuple[object, ...]:
    away = [10.0 - row["jod"] for row in rows]
    pairs = [(row, before[_case(row)]) for row in rows]
    return (
        group,
        _kept(rows[0]),
        len(rows),
        f"{median(away):.2f}",
        f"{max(away):.2f}",
        sum(row["jod"] < VISIBLE for row in rows),
        f"{fmean(row['flip'] for row in rows):.4f}",
        f"{median(row['dssim'] for row in rows):.4f}",
        f"{median(row['change_percent'] for row in rows):.2f}",
        *(
            f"{geometric_mean(own[key] / first[key] for own, first in pairs):.2f}"
            for key in ("change_rms_percent", "cpu_s")
        ),
    )


def _case(row: Row) -> tuple[str, int]:
    return str(row["texture"]), int(row["touch.jnd"])


def lines(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    """Lines of the table: all targets of both groups of textures, and those that Adam has as well."""
    before = {_case(row): row for row in rows if _kept(row) == PIXELS}
    by_adam = {_case(row) for row in rows if _kept(row) == ADAM}
    groups = {
        "weight chosen on": [row for row in rows if row["texture"] in CHOSEN_ON],
        "held out": [row for row in rows if row["texture"] not in CHOSEN_ON],
    }
    summary = [
        _line(name, [row for row in of_group if _kept(row) == kept], before)
        for name, of_group in groups.items()
        for kept in (PIXELS, BROAD)
    ]
    both = [row for row in rows if _case(row) in by_adam]
    return summary + [
        _line("all, -2 and +2", [row for row in both if _kept(row) == kept], before)
        for kept in (PIXELS, BROAD, ADAM)
    ]


def main() -> None:
    publish("appearance", "eye", table(HEAD, lines(committed_anew("eye", __doc__))))


if __name__ == "__main__":
    main()
