"""A stage that lasts is shown, on whatever there is to show it; lines of a run say what they are."""

import io
import re
import sys
import time
from collections.abc import Callable
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.runs.recorder import step_line
from relief.ground import progress as stages
from relief.ground.progress import Progress, say, stage
from retouch.verbs import progress_display as progress
from retouch.verbs.progress_display import followed, shown
from tests.optimize.descent.one_touch import one_touch

STEP = Iterate(3, np.zeros((2, 2)), one_touch(roughness=0.07, contact_area_mm2=31.0), 0.5, 2.6512, 5.0, {})


def until(condition: Callable[[], object]) -> None:
    """Wait for the thread that shows progress, half a minute at most."""
    for _ in range(3000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("nothing was shown")


class Stderr(io.StringIO):
    """A stderr that is a terminal or not."""

    def __init__(self, terminal: bool) -> None:
        super().__init__()
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages, "INTERVAL_S", 0.0)
    monkeypatch.setattr(progress, "PATIENCE_S", 0.0)
    monkeypatch.setattr(progress, "PERIOD_S", 0.0)
    monkeypatch.setattr(progress, "TICK_S", 0.001)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")


def stderr(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> Stderr:
    stream = Stderr(terminal)
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


@pytest.mark.parametrize("terminal", [False, True])
def test_a_stage_that_lasts_is_shown_without_saying_anything(hasty, monkeypatch, terminal: bool) -> None:
    stream = stderr(monkeypatch, terminal)
    with shown(), stage("evaluating [1]"), stage("pressing", 2) as advance:
        advance()
        until(lambda: "evaluating [1]: pressing, 50 %, " in stream.getvalue())
    assert stream.getvalue().isascii()


def test_a_stage_that_may_end_early_promises_no_time(hasty, monkeypatch) -> None:
    """Its steps are counted, because their pace so far is no bound: the fourth may take longest."""
    monkeypatch.setattr(progress, "LEAST_S", 0.0)
    stream = stderr(monkeypatch, False)
    with shown(), stage("reach"), stage("short descents", 400, at_most=True) as advance:
        time.sleep(0.02)
        advance(2)
        until(lambda: "reach: short descents, 2 of at most 400, 0 s so far\n" in stream.getvalue())
    assert "more" not in stream.getvalue()


def test_the_rest_of_a_stage_stands_beside_its_name(hasty, monkeypatch) -> None:
    monkeypatch.setattr(progress, "LEAST_S", 0.0)
    stream = stderr(monkeypatch, False)
    with shown(), stage("evaluating", 1000) as advance:
        time.sleep(0.02)
        advance()
        with stage("pressing", 10**6) as inner:
            time.sleep(0.01)
            inner()
            until(lambda: re.search(r"evaluating, 0 %, about \d+ s more: pressing, 0 %\n", stream.getvalue()))


def test_a_stage_that_is_soon_over_is_not_shown(monkeypatch) -> None:
    monkeypatch.setattr(progress, "PATIENCE_S", 1e9)
    monkeypatch.setattr(progress, "TICK_S", 0.001)
    stream = stderr(monkeypatch, False)
    with shown(), stage("pressing"):
        time.sleep(0.02)
    assert stream.getvalue() == ""


def test_the_pictures_of_a_step_are_called_an_estimate() -> None:
    line = step_line(Targets.of(0.01, roughness=0.07), STEP, 1.5)
    assert line.startswith("step   3  ") and line.endswith("  pictures about 2.7 %  1.5 s")


def test_a_pipe_gets_each_line_once_and_at_once(monkeypatch) -> None:
    stream = stderr(monkeypatch, False)
    with shown(), stage("descending", 4, at_most=True) as advance:
        for step in (1, 2):
            advance.describe(f"step {step}")
            advance()
        say("interrupted")
        assert stream.getvalue() == "step 1\nstep 2\ninterrupted\n"
    assert stream.getvalue() == "step 1\nstep 2\ninterrupted\n"


def test_quiet_shows_nothing_and_an_own_listener_goes_before(hasty, monkeypatch) -> None:
    stream = stderr(monkeypatch, False)
    told: list[Progress] = []
    with shown(quiet=True), stage("pressing") as advance:
        advance.describe("unheard")
    with followed(told.append, False), followed(None, None), shown(), stage("pressing"):
        time.sleep(0.02)
    assert stream.getvalue() == ""
    assert [one.stage for one in told] == ["pressing", "pressing"]


def test_a_stderr_that_fails_ends_nothing(hasty, monkeypatch) -> None:
    tries: list[str] = []

    class Failing(Stderr):
        def write(self, text: str) -> int:
            tries.append(text)
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stderr", Failing(terminal=False))
    with shown(), stage("pressing"):
        until(lambda: len(tries) > 2)


def test_a_notebook_gets_a_bar(hasty, monkeypatch) -> None:
    """A stand-in for IPython, which is no dependency: what is displayed, and displayed anew."""
    pages: list[dict[str, str]] = []

    def display(page: dict[str, str], raw: bool, display_id: bool) -> SimpleNamespace:
        return SimpleNamespace(update=lambda page, raw: pages.append(page))

    ipython = ModuleType("IPython")
    vars(ipython).update(
        display=SimpleNamespace(display=display), get_ipython=lambda: SimpleNamespace(kernel=None)
    )
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    with followed(None, None), stage("pressing <1>", 4) as advance:
        advance()
        until(lambda: bool(pages) and pages[-1]["text/plain"].startswith("pressing <1>, 25 %"))
        assert pages[-1]["text/html"].startswith(
            '<progress value="0.250"></progress> pressing &lt;1&gt;, 25 %'
        )
    assert pages[-1] == {"text/plain": "", "text/html": ""}
