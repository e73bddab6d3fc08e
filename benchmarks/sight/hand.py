"""The look from sides and under lamps that no step has seen: the table of the study `in-hand`.

retouch study in-hand -o runs/in-hand        # 114 runs, an hour of one core
python -m benchmarks.sight.hand [FOLDER]

With a folder its document is committed first.
"""

from collections.abc import Sequence
from statistics import median

from benchmarks.shared.common import publish, table
from benchmarks.shared.finished_studies import Row, committed_anew

STUDIO = "studio"
WAYS = (STUDIO, "studio, shape too", "five views", "in the hand")
HEAD = [
    *("kept", "runs", "change where optimised, %", "in 20 held-out pictures, %"),
    *("held out over optimised", "held out over the studio's"),
    *("JOD where optimised", "held out", "least held out", "CPU s"),
]


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
        _ends([row["change_hand_percent"] / row["change_percent"] for row in rows]),
        _ends(beside),
        f"{median(row['jod'] for row in rows):.2f}",
        f"{median(row['jod_hand'] for row in rows):.2f}",
        f"{min(row['jod_hand_worst'] for row in rows):.2f}",
        f"{median(row['cpu_s'] for row in rows):.0f}",
    )


def lines(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    """A line for each way to keep the look, over all textures at -2 and +2 JND."""
    studio = {_case(row): row for row in rows if row["seen"] == STUDIO}
    each = {way: [row for row in rows if row["seen"] == way] for way in WAYS}
    return [_line(way, some, studio) for way, some in each.items() if some]


def main() -> None:
    rows = [row for row in committed_anew("in-hand", __doc__) if row["table"] == "views"]
    publish("appearance", "in-hand", table(HEAD, lines(rows)))


if __name__ == "__main__":
    main()
