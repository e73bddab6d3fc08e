"""Measured figures of README and guide: each names its result in a comment, and is checked against it.

python -m benchmarks.docs.figures        # write the figures anew from benchmarks/results

A figure is a number, perhaps a unit, and a comment that readers do not see:

    off by 0.18 %<!-- touch_net: median of models/quick/*/error, x 100 --> of roughness

The comment names a file of `benchmarks/results`, and the keys to the number, apart by slashes. `*` stands for
every entry; of several numbers a function (`FUNCTIONS`) makes one. `x` names a factor.
"""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.shared.common import DOCS, ROOT, load

FIGURE = re.compile(
    r"(?P<number>[+-]?\d[\d,]*(?:\.\d+)?)(?P<unit>[^\d\n<|]{0,16})"
    r"(?P<comment><!-- (?P<file>[\w/-]+): "
    r"(?:(?P<function>\w+) of )?(?P<keys>.+?)(?:, x (?P<factor>\S+))? -->)"
)
FUNCTIONS: Mapping[str, Callable[[Sequence[float]], float]] = {
    "median": statistics.median,
    "mean": statistics.fmean,
    "least": min,
    "most": max,
    "sum": sum,
    "count": len,
}


def pages() -> list[Path]:
    """README and guide, whose every measured figure is checked."""
    guide = (page for page in DOCS.rglob("*.md") if DOCS / "evidence" not in page.parents)
    return [ROOT / "README.md", *sorted(guide)]


def value(figure: re.Match[str]) -> float:
    """The result that a figure names.

    Raises:
        ValueError: There is no such result, or it is no single number.
    """
    found = list(_entries(load(figure["file"]), figure["keys"].split("/")))
    if figure["function"] is not None:
        numbers = FUNCTIONS[figure["function"]](found)
    elif len(found) == 1:
        numbers = found[0]
    else:
        raise ValueError(f"{figure['comment']}: {len(found)} numbers, and no function that makes one of them")
    return float(numbers) * float(figure["factor"] or 1.0)


def _entries(content: Any, keys: Sequence[str]) -> Iterator[float]:
    if not keys:
        yield content
        return
    if keys[0] == "*":
        entries = content.values() if isinstance(content, dict) else content
    else:
        try:
            entries = [content[int(keys[0]) if isinstance(content, list) else keys[0]]]
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise ValueError(f"there is no result {keys[0]!r}") from error
    for entry in entries:
        yield from _entries(entry, keys[1:])


def is_right(figure: re.Match[str]) -> bool:
    """Whether a figure is its result, rounded to the digits that are written."""
    whole, _, decimals = figure["number"].partition(".")
    zeros = 0 if decimals else len(whole) - len(whole.rstrip("0,"))
    written = float(figure["number"].replace(",", ""))
    return any(
        written == round(value(figure), digits)
        for digits in ((len(decimals),) if decimals else range(-zeros, 1))
    )


def written(figure: re.Match[str]) -> str:
    """A figure and its comment, made anew with as many digits if it is not right."""
    if is_right(figure):
        return figure[0]
    decimals = len(figure["number"].partition(".")[2])
    sign, comma = ("+" if figure["number"].startswith("+") else ""), ("," if "," in figure["number"] else "")
    return f"{value(figure):{sign}{comma}.{decimals}f}{figure['unit']}{figure['comment']}"


def main() -> None:
    for page in pages():
        before = page.read_text(encoding="utf-8")
        after = FIGURE.sub(written, before)
        if after != before:
            page.write_text(after, encoding="utf-8")
            print(page.relative_to(ROOT))


if __name__ == "__main__":
    main()
