"""Drafts follow the latest wish, begin at the nearest known result, and go with picture and finger."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from relief.relief import Relief
from retouch.app.computing import drafts
from retouch.app.state import numbers, session
from retouch.app.state.drafts import STEPS
from retouch.app.state.session import Session
from retouch.app.values.document import FEEL_OF, JND, Wish, usual_numbers
from retouch.app.values.findings import Draft, Map
from tactile.jnd import ROUGHNESS_JND
from tests.retouch.app.test_session import Inline

NO_MAP = Map("", "", -1.0, 1.0, "µm")


def draft_of(relief: Relief, ratios: Mapping[str, float], met: bool = True) -> Draft:
    return Draft(
        replace(relief, heights=relief.heights + 0.0), ratios, 0.1, 1.0, 0.0 if met else 0.5, met, NO_MAP, {}
    )


class Steps:
    """Steps of drafts that arrive at once, or fall short: what they were asked for.

    Attributes:
        begun: wish and ratio of the start of each step; None for the original.
        then: what happens while the first step of a wish is computed, by its number.
        most: the largest ratio that is reached.
    """

    def __init__(self) -> None:
        self.begun: list[tuple[float | str, float | None, bool]] = []
        self.then: dict[float | str, Callable[[], object]] = {}
        self.most = 100.0

    def __call__(self, relief: Relief, wish: Wish, start: Draft | None, going_on: bool) -> Draft:
        quantity = "contact_area_mm2" if wish.goal == "contact_area_scale" else "roughness"
        ratio = None if start is None else start.ratios[quantity]
        self.begun.append((wish.value, ratio, going_on))
        self.then.pop(wish.value, lambda: None)()
        if wish.goal == FEEL_OF:
            wanted = 1.1
        else:
            wanted = ROUGHNESS_JND ** float(wish.value) if wish.goal == JND else float(wish.value)
        return draft_of(relief, {quantity: min(wanted, self.most)}, wanted <= self.most)


@pytest.fixture
def steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Steps:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(session, "Worker", Inline)
    monkeypatch.setattr(numbers, "textures", lambda: ["dots"])
    made = Steps()
    monkeypatch.setattr(drafts, "step", made)
    values = np.random.default_rng(0).random((32, 32))
    Image.fromarray((255 * values).astype(np.uint8)).save("stone.png")
    return made


def want(one: Session, jnd: float) -> None:
    one.history.change_feel(numbers=usual_numbers() | {JND: jnd})


def with_picture(doing: Callable[[Session], object]) -> Session:
    """A session whose page shows the Feel stage of a picture; `doing` is done once all is computed."""
    one = Session()

    async def idle() -> None:
        while not one.activity.idle:
            await asyncio.sleep(0.01)

    async def within() -> None:
        want(one, 0.0)
        await one.choose("stone.png")
        await idle()
        one.activity.listen(one.drafts.want)
        doing(one)
        await idle()

    asyncio.run(asyncio.wait_for(within(), 60.0))
    return one


def shown(one: Session) -> tuple[float | None, bool]:
    """JND of the draft that is shown, and whether it is of the feel that is chosen."""
    draft, own = one.drafts.shown()
    if draft is None:
        return None, own
    return float(np.log(draft.ratios["roughness"]) / np.log(ROUGHNESS_JND)), own


def test_the_latest_wish_is_drafted_and_those_between_never(steps: Steps) -> None:
    def dragged(one: Session) -> None:
        def move_on() -> None:
            for jnd in (1.5, 2.0, 2.5):
                want(one, jnd)

        steps.then[1.0] = move_on
        want(one, 1.0)

    one = with_picture(dragged)
    assert [wish for wish, *_ in steps.begun] == [1.0, 2.5, 2.5]
    assert shown(one) == (pytest.approx(2.5), True)
    # The step that was under way is known, and the next wish begins from it.
    assert steps.begun[0][1:] == (None, False) and steps.begun[1][1] == pytest.approx(ROUGHNESS_JND)
    assert steps.begun[1][2] is False and steps.begun[2][2] is True


def test_the_nearest_known_result_is_shown_at_once_and_a_wish_that_comes_back_is_not_drafted_again(
    steps: Steps,
) -> None:
    seen = []

    def dragged(one: Session) -> None:
        assert one.numbers.relief is not None
        curve = (2.0, 4.0, -2.0)
        relief = one.numbers.relief
        one.numbers.samples = tuple(draft_of(relief, {"roughness": ROUGHNESS_JND**jnd}) for jnd in curve)
        for jnd in (3.4, 0.6, -1.2):
            steps.then[jnd] = lambda: seen.append(shown(one))
        want(one, 3.4)

    one = with_picture(dragged)

    async def on() -> None:
        for jnd in (0.6, -1.2, 3.4):
            want(one, jnd)
            while not one.activity.idle:
                await asyncio.sleep(0.01)

    asyncio.run(on())
    assert seen == [(pytest.approx(4.0), False), (None, False), (pytest.approx(-2.0), False)]
    assert [wish for wish, *_ in steps.begun] == [3.4, 3.4, 0.6, 0.6, -1.2, -1.2]
    # No draft begins beyond its goal.
    assert [start for _, start, going_on in steps.begun if not going_on] == [
        pytest.approx(ROUGHNESS_JND**2),
        None,
        None,
    ]
    assert shown(one) == (pytest.approx(3.4), True)


def test_a_goal_that_is_not_reached_is_the_nearest_so_far(steps: Steps) -> None:
    steps.most = ROUGHNESS_JND**3
    one = with_picture(lambda one: want(one, 5.0))
    draft, own = one.drafts.shown()
    assert draft is not None and own and not draft.met
    assert len(steps.begun) == STEPS and shown(one)[0] == pytest.approx(3.0)


def test_every_kind_of_feel_has_drafts_of_its_own(steps: Steps) -> None:
    one = with_picture(lambda one: want(one, 2.0))

    async def others() -> None:
        for feel in ({"goal": "contact_area_scale"}, {"goal": FEEL_OF, "feel_of": "dots"}):
            one.history.change_feel(**feel)
            while not one.activity.idle:
                await asyncio.sleep(0.01)
            draft, own = one.drafts.shown()
            assert own and draft is not None

    asyncio.run(others())
    area, like = steps.begun[2], steps.begun[4]
    # A change of the roughness is no start for one of the contact area.
    assert area == (0.8, None, False) and like[0] == "dots"


def test_drafts_are_dropped_with_picture_and_finger_and_no_file_holds_any(steps: Steps) -> None:
    one = with_picture(lambda one: want(one, 2.0))
    files = sorted(str(file) for file in Path().rglob("*"))
    assert files == ["runs", "runs/app.json", "stone.png"] or files == ["stone.png"]
    for change in (
        lambda: one.history.change_feel(skin="exploring"),
        lambda: one.history.change_picture(relief_mm=0.4),
    ):

        async def changed(change: Callable[[], object] = change) -> None:
            begun = len(steps.begun)
            change()
            one.drafts.want()
            assert one.drafts.shown() == (None, False)
            while not one.activity.idle:
                await asyncio.sleep(0.01)
            assert steps.begun[begun][1] is None and shown(one) == (pytest.approx(2.0), True)

        asyncio.run(changed())


def test_a_step_that_ends_after_the_picture_has_changed_is_dropped(steps: Steps) -> None:
    def dragged(one: Session) -> None:
        steps.then[2.0] = lambda: one.history.change_picture(relief_mm=0.4)
        want(one, 2.0)

    one = with_picture(dragged)
    assert [start for _, start, _ in steps.begun] == [None, None, pytest.approx(ROUGHNESS_JND**2)]
    draft, _ = one.drafts.shown()
    assert draft is not None and np.ptp(draft.relief.heights) < 0.5


def test_nothing_is_drafted_where_nothing_changes_or_the_feel_is_painted(steps: Steps) -> None:
    Image.fromarray(np.full((32, 32), 255, np.uint8)).save("mask.png")
    one = with_picture(lambda one: one.history.change_feel(region="mask.png", numbers=usual_numbers()))
    assert steps.begun == [] and one.drafts.shown() == (None, False)


def test_an_error_is_told(steps: Steps, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise ArithmeticError("the contact does not converge")

    monkeypatch.setattr(drafts, "step", fail)
    one = with_picture(lambda one: want(one, 2.0))
    assert one.activity.faults["draft"] == "the contact does not converge"


@pytest.mark.slow
def test_real_drafts_of_all_kinds_reach_their_goals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    relief = Relief.of(0.4 + 0.4 * np.random.default_rng(1).random((32, 32)), 10.0)
    for wish, name, wanted in (
        (Wish("paper", JND, 1.0), "roughness", ROUGHNESS_JND),
        (Wish("paper", "contact_area_scale", 0.9), "contact_area_mm2", 0.9),
    ):
        draft = None
        for number in range(STEPS):
            draft = drafts.step(relief, wish, draft, number > 0)
            if draft.met:
                break
        assert draft is not None and draft.met
        assert draft.ratios[name] == pytest.approx(wanted, rel=0.011)
        assert draft.relief.heights.shape == (32, 32) and draft.change.picture.startswith("data:")
    like = drafts.step(relief, Wish("paper", FEEL_OF, "dots"), None, False)
    assert like.ratios["roughness"] != 1.0
