"""Tables of docs/evidence that are made of documents of studies, and sentences of the README.

python -m benchmarks.docs.measured
"""

from __future__ import annotations

from benchmarks.docs import headlines
from benchmarks.runs import demo
from benchmarks.shared.common import DOCS, ROOT, put
from benchmarks.surfaces import tile_tables

COMMAND = "benchmarks.docs.measured"


def main() -> None:
    readme, evidence = ROOT / "README.md", DOCS / "evidence"
    for page, name, text in (
        (readme, "gradients", headlines.gradients_sentence()),
        (readme, "fast", headlines.fast_sentence()),
        (readme, "status", headlines.status_table()),
        (evidence / "optimiser.md", "demo", demo.as_text() + "\n"),
        (evidence / "optimiser.md", "all over", tile_tables.as_text() + "\n"),
    ):
        print(f"{page.name}, {name}: {'written' if put(page, name, COMMAND, text) else 'has no place'}")


if __name__ == "__main__":
    main()
