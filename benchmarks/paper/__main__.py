"""The command ``python -m benchmarks.paper``."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from typing import Any

from benchmarks.paper import (
    evidence_page,
    filters,
    gallery,
    model_tables,
    predictions,
    ranges,
)
from benchmarks.paper.study_rows import extent
from benchmarks.shared.chart_style import style
from benchmarks.shared.common import load, machine, save
from relief.ground.errors import InputError

FIGURES: dict[str, tuple[Callable[[], dict[str, Any]], str | None]] = {
    "filters": (filters.figure, None),
    "gallery": (gallery.figure, "figure15"),
    "profiles": (gallery.profiles, "figure15"),
    "looks": (model_tables.looks, "figure10"),
    "contact": (model_tables.contact, "figure17"),
    "cold": (predictions.by_cold, "figure17"),
    "eye": (predictions.by_eye, "figure22"),
    "touch": (predictions.by_touch, "figure22"),
    "views": (ranges.views, "figure19"),
    "range": (ranges.reach, "range"),
    "surrogate": (model_tables.surrogate, "exact-vs-surrogate"),
}
"""Figures by name, and the study that each is made from."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description="Figures of the paper.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(FIGURES)} (default: all)")
    names = parser.parse_args().names or list(FIGURES)
    for name in names:
        if name not in FIGURES:
            parser.error(f"{name[:40]!r} is not one of {', '.join(FIGURES)}")
    style()
    for name in names:
        make, study = FIGURES[name]
        began = time.process_time()
        try:
            found = make()
        except InputError as error:
            print(f"{name}: left out: {error}")
            continue
        found |= (
            {"cpu_s": round(time.process_time() - began, 1)} if study is None else {"study": extent(study)}
        )
        print(name, json.dumps(found, indent=1))
        save("paper", load("paper") | {"machine": machine(), name: found})
    evidence_page.write()


if __name__ == "__main__":
    main()
