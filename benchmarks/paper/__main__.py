"""The command ``python -m benchmarks.paper``."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from typing import Any

from benchmarks.charts import style
from benchmarks.common import load, machine, save
from benchmarks.paper import pairs

FIGURES: dict[str, Callable[[], dict[str, Any]]] = {"pairs": pairs.figure}
"""Figures by name."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description="Figures of the paper.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(FIGURES)} (default: all)")
    names = parser.parse_args().names or list(FIGURES)
    for name in names:
        if name not in FIGURES:
            parser.error(f"{name[:40]!r} is not one of {', '.join(FIGURES)}")
    style()
    for name in names:
        began = time.perf_counter()
        found = FIGURES[name]() | {"seconds": round(time.perf_counter() - began, 1)}
        print(name, json.dumps(found, indent=1))
        save("paper", load("paper") | {"machine": machine(), name: found})


if __name__ == "__main__":
    main()
