"""The look from sides and under lamps that no step has seen: the tables of the study `in-hand`.

retouch study in-hand -o runs/in-hand        # 114 runs, an hour of one core
python -m benchmarks.sight.hand [FOLDER]

With a folder its document is committed first.
"""

import shutil
from collections.abc import Sequence
from statistics import median

from benchmarks.shared.common import DOCS, publish, study_given, table
from benchmarks.shared.finished_studies import FILE, STUDIES, Row, committed

STUDY, COMMAND = "in-hand", "benchmarks.sight.hand"
STUDIO = "studio"
WAYS = (STUDIO, "studio, shape too", "five views", "in the hand")
WANTED = 0.6
"""Share of the studio's change, where no step has looked, that other results should have at most."""
HEAD = [
    *("kept", "runs", "change where steered, %", "in 20 other pictures, %", "most in one, %"),
    *("ratio to steered", "ratio to the studio's", f"at most {WANTED:g}"),
    *("JOD where steered", "JOD of the others", "least of the others", "CPU s", "off target by over 1 %"),
]
CASE_HEAD = ["texture, JND", *(f"{way}, %" for way in WAYS), *(f"{way}, JOD" for way in WAYS)]
FRONT_HEAD = ["JND", "kept", "change where steered, %", "in 20 other pictures, %", "JOD of the others"]


def _case(row: Row) -> tuple[str, int]:
    return str(row["texture"]), int(row["touch.jnd"])


def _ends(values: Sequence[float]) -> str:
    return f"{median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def _line(way: str, rows: Sequence[Row], studio: dict[tuple[str, int], Row]) -> tuple[object, ...]:
    beside = [row["change_hand_percent"] / studio[_case(row)]["change_hand_percent"] for row in rows]
    return (
        way,
        len(rows),
        f"{median(row['change_percent'] for row in rows):.1f}",
        f"{median(row['change_hand_percent'] for row in rows):.1f}",
        f"{median(row['change_hand_most_percent'] for row in rows):.1f}",
        _ends([row["change_hand_percent"] / row["change_percent"] for row in rows]),
        _ends(beside),
        sum(ratio <= WANTED for ratio in beside),
        f"{median(row['jod'] for row in rows):.2f}",
        f"{median(row['jod_hand'] for row in rows):.2f}",
        f"{min(row['jod_hand_worst'] for row in rows):.2f}",
        f"{median(row['cpu_s'] for row in rows):.0f}",
        sum(row["miss_percent"] > 1.0 for row in rows),
    )


def lines(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    """A line for each way to keep the look, over all textures at -2 and +2 JND."""
    studio = {_case(row): row for row in rows if row["seen"] == STUDIO}
    each = {way: [row for row in rows if row["seen"] == way] for way in WAYS}
    return [_line(way, some, studio) for way, some in each.items() if some]


def cases(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    """A line for each case: change and JOD of the twenty pictures by each way."""
    by_case: dict[tuple[str, int], dict[str, Row]] = {}
    for row in rows:
        by_case.setdefault(_case(row), {})[str(row["seen"])] = row
    return [
        (
            f"{texture}, {jnd:+d}",
            *(f"{ways[way]['change_hand_percent']:.1f}" if way in ways else "" for way in WAYS),
            *(f"{ways[way]['jod_hand']:.2f}" if way in ways else "" for way in WAYS),
        )
        for (texture, jnd), ways in by_case.items()
    ]


def front(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    """A line for each change of feel and each way: medians over the textures that have all of them."""
    textures = {row["texture"] for row in rows if abs(row["touch.jnd"]) == 4}
    summary: list[tuple[object, ...]] = []
    for jnd in sorted({row["touch.jnd"] for row in rows}):
        for way in WAYS:
            some = [
                row
                for row in rows
                if (row["touch.jnd"], row["seen"]) == (jnd, way) and row["texture"] in textures
            ]
            if len(some) == len(textures) > 0:
                keys = ("change_percent", "change_hand_percent", "jod_hand")
                medians = (f"{median(row[key] for row in some):.2f}" for key in keys)
                summary.append((f"{jnd:+d}", way, *medians))
    return summary


def main() -> None:
    if (study := study_given(__doc__)) is not None:
        shutil.copy(study / FILE, STUDIES / f"{STUDY}.json")
    rows = committed(STUDY)
    views = [row for row in rows if row["table"] == "views"]
    tables = [table(HEAD, lines(views)), table(CASE_HEAD, cases(views)), table(FRONT_HEAD, front(rows))]
    publish(DOCS / "evidence" / "appearance.md", STUDY, COMMAND, "\n\n".join(tables))


if __name__ == "__main__":
    main()
