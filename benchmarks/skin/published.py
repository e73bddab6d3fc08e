"""Which published findings each finger predicts: the whole study, its document, a picture and a table.

python -m benchmarks.skin.published            # what is not computed yet, in runs/published
python -m benchmarks.skin.published --again    # all of it anew
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import retouch
from benchmarks.shared.chart_style import GRID, INK, frame, pyplot, style, write
from benchmarks.shared.common import DOCS, IMAGES, RESULTS, ROOT, again_given, publish, table
from benchmarks.skin.finger_chart import COLOURS
from retouch.laboratory.published.findings import AREA, LABELS, V
from retouch.laboratory.published.scoreboard import FINGERS, GROUPS, Scoreboard

PAGE = DOCS / "evidence" / "touch.md"
PICTURE = IMAGES / "published.png"
COMMAND = "benchmarks.skin.published"
RESULT = RESULTS / "published.json"


def main() -> None:
    again = again_given(__doc__)
    tables = retouch.study("published", ROOT / "runs" / "published", again=again)
    shutil.copy(tables.folder / "study.json", RESULT)
    board = Scoreboard.model_validate_json(RESULT.read_bytes())
    draw(board)
    publish(PAGE, "published", COMMAND, as_text(board))


def draw(board: Scoreboard) -> None:
    """Share of right findings with its interval, by group, read-out and finger."""
    style()
    figure, axes = pyplot.subplots(1, len(GROUPS), figsize=(11.0, 3.9), layout="constrained", sharey=True)
    names = [name for name in LABELS if name != AREA]
    for axis, group in zip(axes, GROUPS, strict=True):
        for place, finger in enumerate(FINGERS):
            for one in board.agreement:
                if one["group"] == group and one["finger"] == finger and one["read_out"] in names:
                    y = names.index(one["read_out"]) + 0.18 * (place - 1.5)
                    axis.plot([100 * one["low"], 100 * one["high"]], [y, y], color=COLOURS[finger], lw=1.3)
                    axis.plot(100 * one["share"], y, "o", color=COLOURS[finger], ms=5)
        counts = [one for one in board.agreement if one["group"] == group and one["read_out"] == V]
        axis.set(
            title=f"{group.capitalize()}:\n{counts[0]['rows']} findings, {counts[0]['studies']} studies",
            xlabel="right, % of findings (mean over studies)",
            xlim=(-2.0, 102.0),
            ylim=(len(names) - 0.5, -0.5),
        )
        axis.set_yticks(range(len(names)), [LABELS[name] for name in names])
        axis.title.set_fontsize(9.5)
        frame(axis)
        axis.grid(False, axis="y")
        for line in range(1, len(names)):
            axis.axhline(line - 0.5, color=GRID, lw=0.6)
        axis.tick_params(axis="y", length=0)
    handles = [pyplot.Line2D([], [], color=COLOURS[name], marker="o", ms=5, label=name) for name in FINGERS]
    figure.legend(
        handles=handles, frameon=False, fontsize=8.5, loc="outside lower center", ncols=4, labelcolor=INK
    )
    write(figure, PICTURE, dpi=120)


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
