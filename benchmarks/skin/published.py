"""Which published findings each finger predicts: the whole study, its document, a picture, and the tables.

python -m benchmarks.skin.published            # what is not computed yet, in runs/published
python -m benchmarks.skin.published --again    # all of it anew
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator

from scipy.stats import binomtest

import retouch
from benchmarks.shared.chart_style import GRID, INK, frame, pyplot, style, write
from benchmarks.shared.common import DOCS, IMAGES, RESULTS, ROOT, again_given, publish, table
from benchmarks.skin.finger_chart import COLOURS
from retouch.laboratory.published.findings import AREA, LABELS, NUMBERS, REFUSED, RIGHT, Finding, V
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
    publish(PAGE, "tables", COMMAND, "\n\n".join(sections(board)))


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


def sections(board: Scoreboard) -> Iterator[str]:
    """The tables of the page."""
    groups = {group: [one for one in board.agreement if one["group"] == group] for group in GROUPS}
    for group, every in groups.items():
        yield f"### {group.capitalize()}\n\n{_agreement(every)}"
    yield f"### Read-outs beside V, on new findings\n\n{_pairs(groups['new'])}"
    yield f"### Fingers beside the default, by V\n\n{_beside(board)}"
    findings = board.findings.finding
    for title, chosen in (
        ("Every new finding", [one for one in findings if one.mark == "new"]),
        ("Every finding that was known or fitted", [one for one in findings if one.mark != "new"]),
    ):
        # Those that were known are told on the pages of skin and finger; a page has its limits.
        rows = [
            [one.says if one.mark == "new" else one.name, _source(one), *_cells(board, one)] for one in chosen
        ]
        yield f"### {title}\n\n{table(('finding', 'source', *FINGERS), rows)}"
    lines = [[one["study"], one["says"], one["missing"]] for one in board.findings.not_computable]
    yield f"### What is not computable\n\n{table(('source', 'what it found', 'what is missing'), lines)}"


def _agreement(every: list[dict[str, float | str]]) -> str:
    rows = []
    for name, label in LABELS.items():
        cells = [
            f"{one['right']} of {one['rows']}; {100 * float(one['share']):.0f} % "
            f"({100 * float(one['low']):.0f} to {100 * float(one['high']):.0f})"
            for finger in FINGERS
            for one in every
            if one["finger"] == finger and one["read_out"] == name
        ]
        if len(cells) == len(FINGERS):
            rows.append([label, *cells])
    return table(("right by", *FINGERS), rows)


def _pairs(every: list[dict[str, float | str]]) -> str:
    rows = []
    for name, label in LABELS.items():
        if name not in (V, AREA):
            mine = [one for one in every if one["read_out"] == name]
            rows.append([label, *(f"+{one['gained']} -{one['lost']} (p {one['p']:.2g})" for one in mine)])
    notes = "Right where V is wrong, and the reverse; p of the exact sign test, not corrected for 20 of them."
    return f"{notes}\n\n{table(('read-out', *FINGERS), rows)}"


def _beside(board: Scoreboard) -> str:
    """How many findings a finger gets right that the default does not, and the reverse, by V."""
    right = {
        (row.labels["finding"], row.labels["finger"]): board.records[row.key].columns.get(RIGHT.format(V))
        for row in board.tables[0].rows
    }
    rows = []
    for group, holds in GROUPS.items():
        names = [one.name for one in board.findings.finding if holds(one) and not one.against]
        cells = []
        for finger in FINGERS[1:]:
            pairs = [(right[name, finger], right[name, FINGERS[0]]) for name in names]
            gained, lost = pairs.count((True, False)), pairs.count((False, True))
            cells.append(f"+{gained} -{lost} (p {binomtest(gained, max(1, gained + lost)).pvalue:.2g})")
        rows.append([group, *cells])
    return table(("findings", *FINGERS[1:]), rows)


def _source(one: Finding) -> str:
    """The source as a link, how it was read, and whether the dimensions are assumed."""
    study = f"[{one.study}](https://doi.org/{one.doi})" if one.doi else one.study
    notes = [one.read, *(["dimensions assumed"] if one.dimensions == "assumed" else [])]
    return f"{study} ({', '.join([*notes, *([one.mark] if one.mark == 'fitted' else [])])})"


def _cells(board: Scoreboard, finding: Finding) -> Iterator[str]:
    """Numbers and verdict of each finger, by V or the contact area."""
    name = finding.unit or V
    for row in board.tables[0].rows:
        if row.labels["finding"] == finding.name:
            columns = board.records[row.key].columns
            if REFUSED in columns:
                yield "cannot be pressed so"
            else:
                wrong = "" if columns[RIGHT.format(name)] else " **wrong**"
                yield f"{columns[NUMBERS.format(name)]}{wrong}"


if __name__ == "__main__":
    main()
