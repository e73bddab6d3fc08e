"""Tables of docs/evidence that are made of documents of studies, and the status in the README.

python -m benchmarks.docs.measured
"""

from __future__ import annotations

import textwrap

from benchmarks.runs import demo
from benchmarks.shared.common import ROOT, publish, put, table
from benchmarks.surfaces import tile_tables
from retouch.pages.meanings import NOT_VERIFIED, OTHER_FINGERS, VERIFIED

LINE = 128
"""Most characters of a line of the README."""


def main() -> None:
    put(ROOT / "README.md", "status", status_table())
    publish("optimiser", "demo", demo.as_text())
    publish("optimiser", "all over", tile_tables.as_text())


def status_table() -> str:
    """What was verified by what, as pages of sets and `retouch doctor` have it."""
    closing = textwrap.fill(
        f"**{NOT_VERIFIED}** {OTHER_FINGERS} ([more](docs/evidence/touch.md))",
        LINE,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return f"{table(['what', 'verified by'], list(VERIFIED.items()))}\n\n{closing}"


if __name__ == "__main__":
    main()
