"""Drafts of the app beside the runs that follow them, on the twelve bundled textures, rougher and smoother.

python -m benchmarks.docs.drafts            # what is missing: 24 runs of half a minute, and their drafts
python -m benchmarks.docs.drafts --again    # the drafts anew, which take two minutes; the runs stay

A run is what the app starts: the commands at the foot of its page, by its usual settings. A draft is what the
app's session makes from nothing; both the first that reaches the goal and the last are kept. Each row is
saved as soon as it is there, so that an interrupted command goes on.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.shared.common import again_given, kept, load, publish
from benchmarks.shared.processes import process
from retouch.app.computing import pictures
from retouch.app.state.session import Session
from retouch.app.values.document import JND, FeelChoice, usual_numbers
from retouch.app.values.folders import textures
from tactile.jnd import ROUGHNESS_JND
from tactile.quantities import ROUGHNESS

NAME = "app_drafts"
JNDS = (2.0, -2.0)
SHORT = 3
"""Exit status of a run that ends short of its target, with a result."""


def main() -> None:
    again = again_given(__doc__)
    rows = [(name, jnd) for name in textures() for jnd in JNDS]
    for name, jnd in rows:
        kept(NAME, "runs", key(name, jnd), partial(run, name, jnd))
    with in_folder():
        asyncio.run(drafted(rows, again))
    publish("speed", "drafts", summary())


def key(name: str, jnd: float) -> str:
    """The name of a row."""
    return f"{name} {jnd:+g}"


@contextlib.contextmanager
def in_folder() -> Iterator[None]:
    """Work in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        yield


def run(name: str, jnd: float) -> dict[str, Any]:
    """What the run of a texture reaches, verified."""
    feel = FeelChoice(numbers={JND: jnd})
    with in_folder():
        for words in (
            pictures.source(name).picture.command("heights.png"),
            feel.command("heights.png", "run"),
        ):
            process(["-m", "retouch", *words], (0, SHORT), folder=Path.cwd())
        result = json.loads(Path("run", "result.json").read_text())
    return {
        "jnd": result["touch"]["jnd_from_original"],
        "change_percent_of_white": result["look"]["change_percent_of_white"],
        "seconds": result["time_s"]["total"],
    }


async def drafted(rows: Sequence[tuple[str, float]], again: bool) -> None:
    """The drafts of the rows that are missing, or of all of them."""
    session = Session()
    try:
        for name, jnd in rows:
            if again or key(name, jnd) not in load(NAME).get("drafts", {}):
                steps = await draft(session, name, jnd)
                kept(NAME, "drafts", key(name, jnd), partial(list, steps), again)
    finally:
        session.close()


async def draft(session: Session, name: str, jnd: float) -> list[dict[str, Any]]:
    """The steps of a draft from nothing."""
    picture = session.document.picture
    if picture is None or picture.file != name:
        await session.choose(name)
    while not (session.numbers.settled and session.activity.idle):
        await asyncio.sleep(0.05)
    session.history.change_feel(numbers=usual_numbers() | {JND: jnd})
    steps: list[Any] = []

    def look() -> None:
        one, own = session.drafts.shown()
        if own and one is not None and one not in steps:
            steps.append(one)

    ending = session.activity.listen(look)
    session.drafts.want()
    while session.drafts.busy:
        await asyncio.sleep(0.05)
    ending()
    return [
        {
            "jnd": math.log(one.ratios[ROUGHNESS.name]) / math.log(ROUGHNESS_JND),
            "change_percent_of_white": one.change_percent_of_white,
            "met": one.met,
        }
        for one in steps
    ]


def agreement() -> dict[str, Any]:
    """How far drafts that have settled are from the runs, in JND and as the ratio of the picture changes.

    A ratio and its reciprocal count as equally far; the worst is the one farther from 1. Rows whose goal is
    not reached, which the page calls the nearest so far, are named apart.
    """
    content = load(NAME)
    runs, settled = content["runs"], {row: steps[-1] for row, steps in content["drafts"].items()}
    reached = [(one, runs[row]) for row, one in settled.items() if one["met"]]
    off = [abs(one["jnd"] - other["jnd"]) for one, other in reached]
    ratios = [_ratio(one, other) for one, other in reached]
    worst = max(ratios, key=lambda ratio: abs(math.log(ratio)))
    return {
        "draft_jnd_off": {"median": statistics.median(off), "worst": max(off)},
        "draft_change_ratio": {"median": statistics.median(ratios), "worst": worst},
        "drafts_short_of_their_goal": [row for row, one in settled.items() if not one["met"]],
    }


def _ratio(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Ratio of the picture changes of two results."""
    return float(one["change_percent_of_white"] / other["change_percent_of_white"])


def summary() -> str:
    """How near drafts are to runs, in one sentence each."""
    found, count = agreement(), len(load(NAME)["drafts"])
    off, ratio, short = (
        found[name] for name in ("draft_jnd_off", "draft_change_ratio", "drafts_short_of_their_goal")
    )
    return (
        f"{count - len(short)} of {count} drafts reach their goal. Of these the feel is off by "
        f"{off['median']:.3f} JND in the median and {off['worst']:.3f} at worst. Their pictures change "
        f"{ratio['median']:.2f} times as much as those of the run in the median, and {ratio['worst']:.2f} "
        "times at worst."
    )


if __name__ == "__main__":
    main()
