"""Picture and tables of the stability map; `python -m benchmarks.stability.sweep --draw` makes them."""

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from textwrap import fill
from typing import Any, NamedTuple

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from benchmarks.shared.chart_style import FAINT, INK, style, write
from benchmarks.shared.common import DOCS, IMAGES, put, table

PATH = IMAGES / "stability.png"
PAGE = DOCS / "evidence" / "speed.md"
PAPER, REFUSED, FAILED = "#fdfcfa", "#c9c6bf", "#6b4c9a"
BANDS = (
    (0.1, "#5aa469", "within 0.1 %"),
    (1.0, "#f2cf5b", "within 1 %"),
    (math.inf, "#d9604c", "beyond 1 %"),
)
"""Bounds of the deviation in %, with colour and name."""
PLANE_BOUND = 1.0
"""Deviation in % from which a cell of a two-parameter map bears its number."""

TOUCH_MODELS = {
    "layer": "layer",
    "single": "layer, float32",
    "quick": "quick",
    "net": "net",
    "elements": "layer against\nfinite elements",
    "finer grid": "grid against\na finer one",
}
LOOK_MODELS = {
    "explicit": "explicit, as in\na descent",
    "rendered": "rendered",
    "fast": "fast",
    "differences": "finite\ndifferences",
}
"""Models by their names in the results, with those in the picture."""
NUMBERS = {"touch": ("V", "A", "contact"), "look": ("mean", "gradient")}
TABLED = {"touch": ("V", "A"), "look": ("mean", "gradient")}
"""Numbers in the picture, and those of which the table has the worst."""
MODELS = {"touch": TOUCH_MODELS, "look": LOOK_MODELS}
SENSES = {"touch": "Touch", "look": "Pictures"}
AXES = {
    "relief_mm": "height of the relief, mm",
    "samples": "samples a side",
    "young_modulus_mpa": "Young's modulus, MPa",
    "poisson_ratio": "Poisson's ratio",
    "force_n": "force, N",
    "size_mm": "side of the plate, mm",
    "elevation": "light above the plate, degrees",
}
PLANES = {
    "touch": (("single", "quick"), "V, A and contact"),
    "look": (("explicit", "fast"), "gradient"),
}
"""Models in the two-parameter maps, and of which numbers the worst is shown."""

Row = dict[str, Any]


class Cell(NamedTuple):
    """Worst deviation over the reliefs, % (not a number: the truth is 0), or why there is none."""

    value: float = math.nan
    reason: str = ""
    failed: bool = False


def cell(rows: Sequence[Row], model: str, numbers: Sequence[str]) -> Cell | None:
    """The worst of some numbers over rows of one place; None if the model was not tried there."""
    parts = [row if "models" not in row else row["models"].get(model, {}) for row in rows]
    for key in ("refused", "failed"):
        for part in parts:
            if key in part:
                return Cell(reason=part[key], failed=key == "failed")
    values = [part[number] for part in parts for number in numbers if number in part]
    return Cell(float(max(values, key=lambda v: math.inf if math.isnan(v) else v))) if values else None


def places(rows: Mapping[str, Row], sense: str, name: str) -> dict[float, list[Row]]:
    """Rows where one parameter varies, by its value; those of all reliefs together."""
    by_value: dict[float, list[Row]] = {}
    for key, row in rows.items():
        kind, _, *varied = key.split(", ")
        if kind == sense and len(varied) == 1 and varied[0].split()[0] == name:
            by_value.setdefault(float(varied[0].split()[1]), []).append(row)
    return dict(sorted(by_value.items()))


def plane(rows: Mapping[str, Row], sense: str) -> tuple[list[str], dict[tuple[float, float], list[Row]]]:
    """Rows where two parameters vary: the parameters, and rows by both values."""
    names: list[str] = []
    by_values: dict[tuple[float, float], list[Row]] = {}
    for key, row in rows.items():
        kind, _, *varied = key.split(", ")
        if kind == sense and len(varied) == 2:
            names = [part.split()[0] for part in varied]
            first, second = (float(part.split()[1]) for part in varied)
            by_values.setdefault((first, second), []).append(row)
    return names, by_values


def senses_and_axes(rows: Mapping[str, Row]) -> list[tuple[str, str]]:
    """Each parameter that varies alone, with what was measured."""
    return [(sense, name) for sense in NUMBERS for name in AXES if places(rows, sense, name)]


def as_text(rows: Mapping[str, Row]) -> str:
    """For each parameter and model, where the worst number is within 0.1 %, 1 %, beyond, or refused."""
    lines: list[list[str]] = []
    for sense, name in senses_and_axes(rows):
        by_value = places(rows, sense, name)
        for model, title in MODELS[sense].items():
            cells = {value: cell(found, model, TABLED[sense]) for value, found in by_value.items()}
            if not any(one is not None and not one.reason for one in cells.values()):
                continue
            kinds: dict[str, list[str]] = {name: [] for name in ("refused", *(band for *_, band in BANDS))}
            for value, one in cells.items():
                if one is not None:
                    number = "" if one.reason or one.value <= 1.0 else f" ({_number(one.value)} %)"
                    kinds[_band(one)[1]].append(f"{value:g}{number}")
            bands = [_ranges(kinds[band], list(cells)) for _, _, band in BANDS]
            lines.append(
                [
                    f"{SENSES[sense].lower()}: {AXES[name]}",
                    title.replace("\n", " "),
                    *bands,
                    ", ".join(kinds["refused"]),
                ]
            )
    head = ("parameter", "model", *(band for *_, band in BANDS), "refused")
    return table(head, [[text or None for text in line] for line in lines])


def write_table(rows: Mapping[str, Row]) -> None:
    """Put the table into its place in the documentation."""
    if not put(PAGE, "stability", "benchmarks.stability.sweep", f"{as_text(rows)}\n"):
        raise ValueError(f"{PAGE}: has no place for the table")


def _ranges(texts: Sequence[str], values: Sequence[float]) -> str:
    """Values as text, neighbours without a number joined to a range."""
    order = [f"{value:g}" for value in values]
    plain = [order.index(text) for text in texts if text in order]
    runs = [[i for _, i in run] for _, run in groupby(enumerate(plain), lambda pair: pair[1] - pair[0])]
    joined = [
        f"{order[run[0]]} to {order[run[-1]]}" if len(run) > 1 else order[run[0]] for run in runs if run
    ]
    return ", ".join([*joined, *(text for text in texts if text not in order)])


def _number(value: float) -> str:
    """Two digits, without a power of ten."""
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def _band(one: Cell) -> tuple[str, str]:
    """Colour and name of what a cell holds."""
    if one.reason:
        return (FAILED, "refused") if one.failed else (REFUSED, "refused")
    for bound, colour, name in BANDS:
        if not one.value > bound:
            return (colour, name) if not math.isnan(one.value) else (PAPER, name)
    raise AssertionError("the last bound is infinite")


def draw(rows: Mapping[str, Row]) -> None:
    """Strips for one parameter at a time, and maps of two."""
    style()
    figure = pyplot.figure(figsize=(13.6, 19.0), facecolor=PAPER)
    grid = figure.add_gridspec(
        5,
        1,
        height_ratios=(3.2, 3.2, 3.2, 1.7, 2.6),
        hspace=0.27,
        top=0.912,
        bottom=0.03,
        left=0.12,
        right=0.99,
    )
    touch = [name for sense, name in senses_and_axes(rows) if sense == "touch"]
    look = [name for sense, name in senses_and_axes(rows) if sense == "look"]
    for row in range(3):
        pair = grid[row].subgridspec(1, 2, wspace=0.33)
        for column, name in enumerate(touch[2 * row : 2 * row + 2]):
            strips(figure.add_subplot(pair[column]), rows, "touch", name)
    three = grid[3].subgridspec(
        1, 3, wspace=0.55, width_ratios=[3 + len(places(rows, "look", name)) for name in look]
    )
    for column, name in enumerate(look):
        strips(figure.add_subplot(three[column]), rows, "look", name)
    four = grid[4].subgridspec(1, 4, wspace=0.36)
    for number, sense in enumerate(PLANES):
        for column, model in enumerate(PLANES[sense][0]):
            heat(figure.add_subplot(four[2 * number + column]), rows, sense, model)
    _head(figure)
    write(figure, PATH, dpi=110, facecolor=PAPER, pil_kwargs={"optimize": True})


def _head(figure: Figure) -> None:
    figure.text(0.012, 0.977, "Where the models hold, and what is refused", fontsize=17, weight="bold")
    figure.text(
        0.012,
        0.963,
        "Deviation from a converged run in double precision, the worst of two reliefs (gravel and "
        "waves), in %; numbers above 0.1 %.\n"
        "One parameter at a time, then two. Elsewhere: relief 1.2 mm, 128 samples (pictures and the maps of "
        "two: 64),\n"
        "E 0.5 MPa, Poisson's ratio 0.48, 10 N, plate 10 mm, light at 35 degrees.",
        fontsize=10.5,
        va="top",
        linespacing=1.5,
    )
    handles = [Patch(color=colour, label=name) for _, colour, name in BANDS]
    handles += [
        Patch(color=REFUSED, label="refused"),
        Patch(color=FAILED, label="no convergence"),
    ]
    figure.legend(
        handles=handles,
        loc="upper right",
        bbox_to_anchor=(0.995, 0.994),
        ncols=5,
        frameon=False,
        fontsize=9,
        handlelength=1.1,
        handleheight=1.1,
        columnspacing=1.1,
    )


def strips(axis: Axes, rows: Mapping[str, Row], sense: str, name: str) -> None:
    """One parameter across; down, each model with a strip for each number."""
    by_value, numbers = places(rows, sense, name), NUMBERS[sense]
    top, labels = 0.0, []
    for model, title in MODELS[sense].items():
        cells = [[cell(found, model, (number,)) for found in by_value.values()] for number in numbers]
        if all(one is None or one.reason for line in cells for one in line):
            continue
        for down, line in enumerate(cells):
            for across, one in enumerate(line):
                if one is not None and not one.reason:
                    _square(axis, across, top + down, one)
            if any(line):
                labels.append((top + down + 0.5, numbers[down]))
        for across, one in enumerate(cells[0]):
            if one is not None and one.reason:
                _block(axis, across, top, len(numbers), one)
        _shared_reason(axis, cells[0], top + 0.5 * len(numbers), list(by_value.values()))
        middle = top + 0.5 * len(numbers)
        axis.annotate(
            title,
            (0.0, middle),
            (-44.0, 0.0),
            xycoords=axis.get_yaxis_transform(),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=8.5,
        )
        top += len(numbers) + 0.45
    for across, found in enumerate(by_value.values()):
        reasons = [row["refused"] for row in found if "refused" in row]
        if len(reasons) == len(found):
            text = fill(_short(reasons[0]), 42)
            axis.text(
                across + 0.5, 0.5 * top, text, rotation=90, ha="center", va="center", fontsize=8, color=INK
            )
    axis.set_yticks([y for y, _ in labels], [label for _, label in labels], fontsize=7, color=FAINT)
    axis.set_xticks(
        [i + 0.5 for i in range(len(by_value))], [f"{value:g}" for value in by_value], fontsize=8.5
    )
    _finish(axis, len(by_value), top - 0.45)
    axis.set_title(f"{SENSES[sense]}: {AXES[name]}", loc="left", fontsize=10.5)


def _finish(axis: Axes, width: float, height: float) -> None:
    axis.set_xlim(0, width)
    axis.set_ylim(height, 0)
    axis.set_facecolor(PAPER)
    axis.tick_params(length=0)
    for side in axis.spines.values():
        side.set_visible(False)


def _square(axis: Axes, across: float, down: float, one: Cell, bound: float = BANDS[0][0]) -> None:
    axis.add_patch(Rectangle((across, down), 1, 1, facecolor=_band(one)[0], edgecolor=PAPER, linewidth=0.8))
    if one.value > bound:
        text = _number(one.value)
        ink = "white" if one.value > BANDS[1][0] else INK
        axis.text(across + 0.5, down + 0.53, text, ha="center", va="center", fontsize=6.8, color=ink)


def _block(axis: Axes, across: float, top: float, height: float, one: Cell) -> None:
    axis.add_patch(
        Rectangle((across, top), 1, height, facecolor=_band(one)[0], edgecolor=PAPER, linewidth=0.8)
    )


def _shared_reason(
    axis: Axes, line: Sequence[Cell | None], middle: float, found: Sequence[Sequence[Row]]
) -> None:
    """A model's own reason, once for each run of neighbours that it refuses."""
    own = [
        one is not None and bool(one.reason) and not all("refused" in row for row in rows)
        for one, rows in zip(line, found, strict=True)
    ]
    start = 0
    for refused, run in groupby(own):
        length = len(list(run))
        one = line[start]
        if refused and one is not None:
            text = "no convergence" if one.failed else fill(_short(one.reason), 12 * length)
            colour = "white" if one.failed else INK
            axis.text(
                start + 0.5 * length, middle, text, ha="center", va="center", fontsize=6.8, color=colour
            )
        start += length


def _short(reason: str) -> str:
    """A refusal without the name of its field and of what was given instead."""
    field, said = reason.split(": ")[:2]
    return f"{field.split('.')[-1]}: {said.split(', not ')[0].split('; ')[0]}"


def heat(axis: Axes, rows: Mapping[str, Row], sense: str, model: str) -> None:
    """Two parameters: the worst of the numbers of one model."""
    names, by_values = plane(rows, sense)
    title = {"single": "layer, float32"}.get(model, model)
    numbers = NUMBERS["touch"] if sense == "touch" else ("gradient",)
    across, down = (sorted({values[i] for values in by_values}) for i in (1, 0))
    for values, found in by_values.items():
        one = cell(found, model, numbers)
        column, line = across.index(values[1]), len(down) - 1 - down.index(values[0])
        if one is not None and one.reason:
            _block(axis, column, line, 1, one)
        elif one is not None:
            _square(axis, column, line, one, PLANE_BOUND)
    axis.set_xticks([i + 0.5 for i in range(len(across))], [f"{value:g}" for value in across], fontsize=8)
    axis.set_yticks(
        [i + 0.5 for i in range(len(down))], [f"{value:g}" for value in reversed(down)], fontsize=8
    )
    _finish(axis, len(across), len(down))
    if names:
        axis.set_xlabel(AXES[names[1]], fontsize=8.5)
        axis.set_ylabel(AXES[names[0]], fontsize=8.5)
    axis.set_title(f"{title}: {PLANES[sense][1]}", loc="left", fontsize=10)
