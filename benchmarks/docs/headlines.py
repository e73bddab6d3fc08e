"""Headlines: the few numbers of each benchmark that the README states, from the results."""

from __future__ import annotations

import statistics
import textwrap
from collections.abc import Iterator
from typing import Any

from benchmarks.learned.unseen_textures import spread
from benchmarks.shared.common import load, table
from benchmarks.sight import gradients
from retouch.pages.meanings import NOT_VERIFIED, OTHER_FINGERS, VERIFIED
from tactile.layer.truncated import STEPS

LINE = 128
"""Most characters of a line of the README."""


def _wrapped(sentence: str) -> str:
    return textwrap.fill(sentence, LINE, break_long_words=False, break_on_hyphens=False) + "\n"


def status_table() -> str:
    """What was verified by what, as pages of sets and `retouch doctor` have it."""
    rows = [[what, by] for what, by in VERIFIED.items()]
    closing = _wrapped(f"**{NOT_VERIFIED}** {OTHER_FINGERS} ([more](docs/evidence/touch.md))")
    return f"{table(['what', 'verified by'], rows)}\n\n{closing}"


def fast_sentence() -> str:
    """How far off the models of `--fast` are, in the median."""
    touch, look = load("touch_net")["models"], load("fast_look")
    quick, unseen = touch[f"layer, {STEPS} steps"], look["unseen"]["studio"]
    off = (quick["unseen"][f"{what}_percent"] for what in ("roughness", "contact_area"))
    felt, touched, seen = (f"{spread(values)['median']:.2g} %" for values in (*off, unseen))
    (_, press), (_, render) = quick["milliseconds"]["2"], look["milliseconds"]["2"]
    return _wrapped(
        "`retouch optimize --fast` steers by models that take milliseconds. On 320 textures that no net has "
        f"seen, they are off by {felt} of roughness, {touched} of contact area and {seen} of a pixel in the "
        f"median; with gradients touch takes {press:.0f} ms and three pictures take {render:.0f} ms "
        "([more](docs/evidence/speed.md#the-fast-models))."
    )


def gradients_sentence() -> str:
    """The range of the errors of picture gradients, ours beside Mitsuba's."""
    found, ours, theirs = load("gradients")["cases"], list[float](), list[float]()
    for case in _of_gravel(found):
        methods = found[case.key]["methods"]
        ours.append(100.0 * methods["explicit"]["error"])
        theirs += (100.0 * methods[f"Mitsuba {name}"]["error"] for name in ("direct", "prb"))
    return _wrapped(
        "Most of the gradient of a picture under raked light is in how shadows move. Over "
        f"{len(ours)} combinations of camera and light the error of Retouch's gradient is {min(ours):.1f} to "
        f"{max(ours):.1f} %, in the median {statistics.median(ours):.1f} %, against finite differences of "
        "converged renders; that of Mitsuba's own `direct` and `prb`, which see no shadow move, is "
        f"{min(theirs):.0f} to {max(theirs):.0f} % "
        "([each of them](docs/evidence/appearance.md#gradients-of-pictures))."
    )


def _of_gravel(found: dict[str, Any]) -> Iterator[gradients.Case]:
    """The measured cases of gravel in plastic, in order."""
    for case in gradients.cases():
        of_gravel = (case.relief, case.material, case.bounces) == (gradients.GRAVEL, "plastic", 1)
        if of_gravel and case.key in found:
            yield case
