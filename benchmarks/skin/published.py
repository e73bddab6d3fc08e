"""Which published findings each finger predicts: the whole study, its document and a table.

python -m benchmarks.skin.published            # what is not computed yet, in runs/published
python -m benchmarks.skin.published --again    # all of it anew
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import retouch
from benchmarks.shared.common import RESULTS, ROOT, again_given, publish, table
from retouch.laboratory.published.findings import AREA, LABELS, V
from retouch.laboratory.published.scoreboard import FINGERS, GROUPS, Scoreboard

RESULT = RESULTS / "published.json"


def main() -> None:
    again = again_given(__doc__)
    tables = retouch.study("published", ROOT / "runs" / "published", again=again)
    shutil.copy(tables.folder / "study.json", RESULT)
    publish("touch", "published", as_text(Scoreboard.model_validate_json(RESULT.read_bytes())))


def as_text(board: Scoreboard) -> str:
    """V on every group of findings, then the other read-outs on the new ones."""
    lines = [[f"V, {group}", *_cells(board, group, V)] for group in GROUPS]
    lines += [
        [f"{label}, new", *_cells(board, "new", name)]
        for name, label in LABELS.items()
        if name not in (V, AREA)
    ]
    return table(("right by", *FINGERS), lines)


def _cells(board: Scoreboard, group: str, read_out: str) -> Iterator[str]:
    """Right findings of a group by a read-out, with the share and its 95 % interval, finger by finger."""
    for finger in FINGERS:
        for one in board.agreement:
            if (one["group"], one["finger"], one["read_out"]) == (group, finger, read_out):
                low, high = (100 * float(one[end]) for end in ("low", "high"))
                yield f"{one['right']} of {one['rows']} ({low:.0f} to {high:.0f} %)"


if __name__ == "__main__":
    main()
