"""The session: what a person changes is followed, kept and undone, and what goes wrong is told."""

import asyncio
import errno
import json
import os
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from optimize.estimates.change_curves import ChangeCurve, Reach
from optimize.run_directory.key import RESULT
from relief.ground.formats import RUN_HEIGHTS
from relief.relief import Relief
from retouch.app.computing import drafts, results, touch
from retouch.app.state import kept, numbers, running, session
from retouch.app.state.kept import KEPT
from retouch.app.state.runs import State
from retouch.app.state.session import Session
from retouch.app.values.document import AppDocument, FeelChoice, PictureChoice, PrintChoice, usual_numbers
from retouch.app.values.findings import Map, Sides, Written


class Inline:
    """A worker that computes at once, in this process."""

    progress = ""

    async def __call__(self, function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        await asyncio.sleep(0)
        return function(*arguments, **named)

    def close(self) -> None:
        pass


def jnds(jnd: float) -> dict[str, float]:
    """Numbers of the goals with this change of the roughness."""
    return usual_numbers() | {"jnd": jnd}


@pytest.fixture(autouse=True)
def _working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(session, "Worker", Inline)
    monkeypatch.setattr(numbers, "textures", lambda: ["dots"])


def settled(work: Callable[[Session], Coroutine[Any, Any, None]], one: Session | None = None) -> Session:
    """A session after some work, once all that follows from it is computed."""
    one = one or Session()

    async def doing() -> None:
        await work(one)
        while not one.activity.idle:
            await asyncio.sleep(0.01)

    asyncio.run(doing())
    return one


async def chosen(one: Session) -> None:
    values = np.random.default_rng(0).random((32, 32))
    Image.fromarray((255 * values).astype(np.uint8)).save("stone.png")
    await one.choose("stone.png")


def test_a_chosen_picture_is_felt() -> None:
    one = settled(chosen)
    assert one.document.picture == PictureChoice("stone.png", relief_mm=0.8, size_mm=10.0)
    assert one.numbers.relief is not None and one.numbers.relief.heights.shape == (32, 32)
    assert np.isclose(np.ptp(one.numbers.relief.heights), 0.8, rtol=1e-3)
    assert one.numbers.felt is not None and 0.0 < one.numbers.felt["roughness"][0] < 0.5
    assert one.numbers.felt is one.numbers.felt_here  # a plate of 10 mm is one place
    assert list(one.numbers.scale) == ["dots"] and one.activity.faults == {}


def test_heights_and_feel_follow_a_change() -> None:
    async def changed(one: Session) -> None:
        await chosen(one)
        one.history.change_picture(relief_mm=0.4)
        one.history.change_picture(relief_mm=0.2, rotate=90)

    one, before = (settled(work).numbers for work in (changed, chosen))
    assert one.relief is not None and before.relief is not None and one.felt and before.felt
    assert np.allclose(one.relief.heights, 0.25 * np.rot90(before.relief.heights), atol=1e-4)
    assert one.felt["roughness"] < before.felt["roughness"]


def test_a_tile_is_felt_all_over() -> None:
    async def tiled(one: Session) -> None:
        await chosen(one)
        one.history.change_picture(tile="blend")

    one = settled(tiled).numbers
    assert one.felt is not None and len(one.felt["roughness"]) == 16
    assert one.felt_here is not None and len(one.felt_here["roughness"]) == 1


def test_the_last_step_is_undone() -> None:
    async def undone(one: Session) -> None:
        await chosen(one)
        assert not one.history.can_undo
        one.history.change_picture(relief_mm=0.4)
        one.history.change_feel(numbers=jnds(-1.0))
        one.history.undo()
        assert one.document.picture is not None and one.document.picture.relief_mm == 0.4
        one.history.undo()

    one = settled(undone)
    assert one.document == AppDocument(PictureChoice("stone.png", relief_mm=0.8, size_mm=10.0))
    assert one.numbers.relief is not None and np.isclose(np.ptp(one.numbers.relief.heights), 0.8, rtol=1e-3)


def test_what_is_no_picture_is_told_and_changes_nothing() -> None:
    async def broken(one: Session) -> None:
        await chosen(one)
        Path("broken.png").write_bytes(b"no picture")
        await one.choose("broken.png")

    one = settled(broken)
    assert "broken.png" in one.activity.faults["picture"]
    assert one.document.picture is not None and one.document.picture.file == "stone.png"


@pytest.mark.parametrize("number", [np.nan, np.inf, 1e308])
def test_a_file_without_a_height_is_named_and_changes_nothing(number: float) -> None:
    async def without(one: Session) -> None:
        await chosen(one)
        np.save("heights.npy", np.full((32, 32), number))
        await one.choose("heights.npy")

    one = settled(without)
    fault = "heights.npy: nothing was measured in it; all its numbers are NaN or too large"
    assert one.activity.faults == {"picture": fault}
    assert one.document.picture is not None and one.document.picture.file == "stone.png"


@pytest.mark.parametrize("relief_mm", [1e308, np.inf, np.nan, 0.0, -1.0])
def test_a_relief_that_no_plate_can_have_is_told_with_the_file(relief_mm: float) -> None:
    async def wrong(one: Session) -> None:
        await chosen(one)
        one.history.change_picture(relief_mm=relief_mm)

    fault = settled(wrong).activity.faults["numbers"]
    assert fault.startswith(f"stone.png: relief_mm: {relief_mm} is not a number from ")


def test_a_relief_that_no_finger_can_follow_is_told() -> None:
    async def steep(one: Session) -> None:
        await chosen(one)
        one.history.change_picture(samples=8)

    assert "samples" in settled(steep).activity.faults["numbers"]


def test_every_window_hears_of_a_change_until_it_is_closed() -> None:
    one, heard = Session(), []
    ends = [one.activity.listen(lambda number=number: heard.append(number)) for number in (1, 2)]  # type: ignore[misc]
    one.history.change_feel(numbers=jnds(1.0))
    ends[0]()
    one.history.change_feel(numbers=jnds(2.5))
    assert heard == [1, 2, 2]


def test_numbers_of_another_picture_are_never_settled() -> None:
    async def undone_early(one: Session) -> None:
        await chosen(one)
        while not one.activity.idle:
            await asyncio.sleep(0.01)
        assert one.numbers.settled
        one.history.change_picture(relief_mm=2.0)
        while one.numbers.relief is None or np.ptp(one.numbers.relief.heights) < 1.9:
            await asyncio.sleep(0)
        one.history.undo()
        assert not one.numbers.settled

    numbers = settled(undone_early).numbers
    assert numbers.settled and numbers.relief is not None and np.ptp(numbers.relief.heights) < 0.9


def test_a_window_that_fails_does_not_keep_the_news_from_others() -> None:
    def fail() -> None:
        raise RuntimeError("unforeseen")

    one, heard = Session(), []
    one.activity.listen(fail)
    one.activity.listen(lambda: heard.append(one.document.feel.numbers["jnd"]))
    one.history.change_feel(numbers=jnds(1.0))
    assert heard == [1.0] and "unforeseen" in one.fault()


def test_the_next_start_goes_on_with_what_was_chosen() -> None:
    async def with_feel(one: Session) -> None:
        await chosen(one)
        one.history.change_feel(numbers=jnds(-1.5), settings=("descent.steps=3",))

    one, other = settled(with_feel), Session()
    other.restore()
    assert other.document == one.document


def test_a_full_disk_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(kept, "write_atomically", full)
    one = Session()
    one.history.change_feel(numbers=jnds(1.0))
    assert "No space left" in one.fault() and one.document.feel.numbers["jnd"] == 1.0
    monkeypatch.undo()


def test_a_run_waits_in_the_queue_and_is_there_at_the_next_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running.Queue, "advance", lambda queue: False)

    async def queued(one: Session) -> None:
        await chosen(one)
        one.history.change_feel(numbers=jnds(1.0))
        await one.start_run()
        await one.start_run()

    one, other = settled(queued), Session()
    other.restore()
    assert [str(job.folder) for job in other.running.queue.jobs] == ["runs/stone-1", "runs/stone-2"]
    assert [job.feel for job in other.running.queue.jobs] == [FeelChoice(numbers=jnds(1.0))] * 2
    assert other.running.queue.jobs[0].state is State.WAITING
    assert Path("runs/stone-1.png").is_file()
    assert json.loads(KEPT.read_text())["document"]["run"] == one.document.run == "runs/stone-2"
    one.drop(one.running.queue.jobs[0])
    assert len(one.running.queue.jobs) == 1 and Path("runs/stone-1.png").is_file()


def test_a_run_is_in_the_list_after_a_kill_although_one_of_its_name_was_deleted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    at_start = []
    monkeypatch.setattr(
        running.Queue, "advance", lambda queue: at_start.append(json.loads(KEPT.read_text())["queue"])
    )

    async def anew(one: Session) -> None:
        await chosen(one)
        one.history.look_at("runs/stone-1")
        await one.start_run()
        Path("runs/stone-2.png").unlink()
        one.history.look_at("runs/other-1")
        await one.start_run()

    settled(anew)
    # Neither name is taken again: what a deleted run has written would be shown as that of the next one. The
    # list is kept before the command begins, so that no kill comes between.
    names = [[entry["folder"] for entry in queue] for queue in at_start]
    assert names == [["runs/stone-2"], ["runs/stone-2", "runs/stone-1"]]


def test_a_run_whose_command_cannot_be_started_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(queue: running.Queue) -> bool:
        raise OSError(errno.EAGAIN, "no process can be made")

    monkeypatch.setattr(running.Queue, "advance", refuse)

    async def started(one: Session) -> None:
        await chosen(one)
        await one.start_run()

    assert "no process" in settled(started).activity.faults["run"]
    assert [entry["folder"] for entry in json.loads(KEPT.read_text())["queue"]] == ["runs/stone-1"]


def test_what_could_not_be_read_is_told_and_not_overwritten() -> None:
    KEPT.parent.mkdir()
    KEPT.write_text(content := '{"document": {"feel": {"jnd": 1.5}, "picture": {"file": "a.png"}}, "que')
    one = Session()
    one.restore()
    one.history.change_feel(numbers=jnds(3.0))
    assert Path(f"{KEPT}.unread-1").read_text() == content
    assert f"{KEPT}.unread-1" in one.fault() and "not read: all of it" in one.fault()
    other = Session()
    other.restore()
    assert other.fault() == "" and other.document == one.document


def test_a_name_that_is_no_utf8_is_shown_plainly() -> None:
    name = os.fsdecode(b"caf\xe9.png")

    async def missing(one: Session) -> None:
        await one.choose(name)

    one = settled(missing)
    assert one.activity.faults["picture"] == "caf?.png: no such file"


def test_a_painted_mask_becomes_a_region_in_grades() -> None:
    canvas = np.zeros((32, 32), np.uint8)
    canvas[8:24, 8:24] = np.arange(16, 256, 15)

    async def painted(one: Session) -> None:
        await chosen(one)
        Image.fromarray(canvas).save("canvas.png")
        await one.paint(Path("canvas.png").read_bytes())

    one = settled(painted)
    region = one.document.feel.region
    assert region is not None and np.array_equal(np.asarray(Image.open(region)), canvas)
    assert "where it is painted" in one.document.feel.sentence()

    async def emptied(one: Session) -> None:
        Image.fromarray(0 * canvas).save("canvas.png")
        await one.paint(Path("canvas.png").read_bytes())

    assert settled(emptied, one).document.feel.region is None


def test_a_moved_slider_is_one_step_and_each_stroke_another() -> None:
    one = Session()
    for jnd in (1.0, 1.5, 3.0):
        one.history.change_feel(slid="jnd", numbers=jnds(jnd))
    for mask in ("a", "b"):
        one.history.change_feel(region=f"pictures/mask-{mask}.png")
    undone = []
    while one.history.can_undo:
        one.history.undo()
        undone.append((one.document.feel.region, one.document.feel.numbers["jnd"]))
    assert undone == [("pictures/mask-a.png", 3.0), (None, 3.0), (None, FeelChoice().numbers["jnd"])]


def test_a_slider_that_came_back_leaves_nothing_to_undo() -> None:
    one = Session()
    for jnd in (3.0, FeelChoice().numbers["jnd"]):
        one.history.change_feel(slid="jnd", numbers=jnds(jnd))
    assert not one.history.can_undo


def test_of_strokes_in_quick_succession_none_is_lost() -> None:
    async def painted(one: Session) -> None:
        await chosen(one)
        masks = []
        for rows in (5, 9):
            canvas = np.zeros((32, 32), np.uint8)
            canvas[:rows] = 255
            Image.fromarray(canvas).save("canvas.png")
            masks.append(Path("canvas.png").read_bytes())
        await asyncio.gather(*map(one.paint, masks))

    one = settled(painted)
    assert np.count_nonzero(np.asarray(Image.open(str(one.document.feel.region)))[:, 0]) == 9
    one.history.undo()
    assert np.count_nonzero(np.asarray(Image.open(str(one.document.feel.region)))[:, 0]) == 5


def test_how_far_the_feel_can_change_is_of_the_picture_that_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    found = Reach(ChangeCurve(1.0, True, ()), ChangeCurve(2.0, True, ()), "quick", "fast", 50.0)
    monkeypatch.setattr(drafts, "reach", lambda *_: (found, ()))

    async def estimated(one: Session) -> None:
        await chosen(one)
        while not one.activity.idle:
            await asyncio.sleep(0.01)
        one.want_reach()

    one = settled(estimated)
    assert one.numbers.reach.answer == found

    async def another(one: Session) -> None:
        await one.choose("dots")

    assert settled(another, one).numbers.reach.answer is None


def test_how_far_the_feel_can_change_is_estimated_again_after_an_undone_change(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reliefs = []

    def reach(relief: Relief, skin: str) -> tuple[Reach, tuple[()]]:
        reliefs.append(relief)
        return Reach(ChangeCurve(1.0, True, ()), ChangeCurve(2.0, True, ()), "quick", "fast", 50.0), ()

    monkeypatch.setattr(drafts, "reach", reach)

    async def undone(one: Session) -> None:
        await chosen(one)
        for change in (lambda: one.history.change_picture(relief_mm=0.4), one.history.undo):
            while not one.activity.idle:
                await asyncio.sleep(0.01)
            one.want_reach()
            await one.numbers.reach.finished()
            change()
        while not one.activity.idle:
            await asyncio.sleep(0.01)
        assert one.numbers.reach.answer is None
        one.want_reach()

    one = settled(undone)
    assert one.numbers.reach.answer is not None and len(reliefs) == 3 and reliefs[-1] is one.numbers.relief


def test_a_file_is_told_of_the_run_that_it_was_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    one, flat, none = Session(), Relief(np.zeros((2, 2))), Map("", "", 0.0, 1.0, "")
    (folder := Path("runs/a-1")).mkdir(parents=True)
    (folder / RUN_HEIGHTS).touch()
    monkeypatch.setattr(results, "sides", lambda _: Sides(flat, flat, None, (none, none)))

    def export(*_: Any) -> Written:
        one.history.look_at("runs/b-1")
        return Written("runs/a-1-print.3mf", ())

    monkeypatch.setattr(results, "export", export)

    async def printed(one: Session) -> None:
        one.history.look_at("runs/a-1")
        while one.outcomes.sides.answer is None:
            await asyncio.sleep(0)
        await one.outcomes.write_print(PrintChoice())

    settled(printed, one)
    assert one.document.run == "runs/b-1"
    assert one.outcomes.written is None and one.activity.faults == {}


def test_an_undone_change_leaves_the_run_that_is_looked_at() -> None:
    one = Session()
    one.history.change_feel(numbers=jnds(1.0))
    one.history.look_at("runs/stone-1")
    one.history.undo()
    assert one.document == AppDocument(run="runs/stone-1")


def test_a_result_is_read_again_once_its_numbers_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    monkeypatch.setattr(
        results, "sides", lambda run: read.append(sorted(f.name for f in Path(run).iterdir()))
    )

    async def looked_at(one: Session) -> None:
        (folder := Path("runs/stone-1")).mkdir(parents=True)
        for name in (RUN_HEIGHTS, RESULT):
            (folder / name).touch()
            one.history.look_at(str(folder))
            for _ in range(2):
                one.outcomes.want_sides()
                while not one.activity.idle:
                    await asyncio.sleep(0)

    settled(looked_at)
    assert read == [[RUN_HEIGHTS], [RUN_HEIGHTS, RESULT]]


def test_of_two_pictures_chosen_at_once_the_later_counts() -> None:
    async def both(one: Session) -> None:
        await asyncio.gather(one.choose("brick"), one.choose("knit"))

    document = settled(both).document
    assert document.picture is not None and document.picture.file == "knit"


def test_a_broken_picture_is_not_reported_once_another_is_chosen() -> None:
    async def both(one: Session) -> None:
        Path("broken.png").write_bytes(b"no picture")
        await asyncio.gather(one.choose("broken.png"), one.choose("brick"))

    one = settled(both)
    assert one.document.picture is not None and one.document.picture.file == "brick"
    assert one.activity.faults == {}


def test_a_forecast_is_not_shown_for_another_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(touch, "forecast", lambda *_: (("time", "about 3 s"),))

    async def estimated(one: Session) -> None:
        await chosen(one)
        await one.running.estimate()

    one = settled(estimated)
    assert one.running.forecast == (("time", "about 3 s"),) and list(Path("runs").glob("stone*")) == []
    one.history.change_feel(numbers=jnds(3.0))
    assert one.running.forecast == ()


def test_what_is_no_mask_is_told() -> None:
    async def painted(one: Session) -> None:
        await one.paint(b"no picture")

    assert "mask" in settled(painted).fault()


def test_a_failure_beyond_all_checks_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise RuntimeError("unforeseen")

    monkeypatch.setattr(touch, "felt", fail)
    assert settled(chosen).activity.faults["numbers"] == "RuntimeError: unforeseen"


def test_another_finger_feels_anew() -> None:
    async def lighter(one: Session) -> None:
        await chosen(one)
        one.history.change(replace(one.document, feel=replace(one.document.feel, skin="exploring")))

    felt, before = settled(lighter).numbers.felt, settled(chosen).numbers.felt
    assert felt is not None and before is not None
    assert felt["contact_area_mm2"] < before["contact_area_mm2"]
