"""Stages of the page show the session as it is now; without a browser, by the elements that they make."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="without the extra app")

from nicegui import Client, ui
from nicegui.page import page

from relief.ground.files import only_writer
from retouch.app.stages.elements import JndSlider
from retouch.app.stages.feel import FeelStage
from retouch.app.stages.picture import PictureStage
from retouch.app.stages.printing import PrintStage
from retouch.app.stages.run import ELSEWHERE, RunStage
from retouch.app.stages.window import AppWindow
from retouch.app.state import runs
from retouch.app.state.addresses import Addresses
from retouch.app.state.runs import QueuedRun
from retouch.app.state.session import Session
from retouch.app.values.document import AppDocument, FeelChoice, PictureChoice
from retouch.app.values.findings import Written
from tactile.quantities import QUANTITIES, GoalKey, Quantity


def test_a_file_for_a_printer_is_not_shown_as_that_of_the_next_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session()

    with Client(page("")) as client:
        stage = PrintStage(AppWindow(session, Addresses(), lambda _: None))
        stage.build()

        def shown() -> bool:
            stage.refresh()
            return any(isinstance(one, ui.label) and one.text == "3 MiB" for one in client.elements.values())

        session.history.look_at("runs/a-1")
        session.outcomes.written = Written("runs/a-1-print.3mf", (("file", "3 MiB"),))
        assert shown()
        session.history.look_at("runs/b-1")
        assert not shown()
    client.delete()


def test_stop_is_offered_where_it_does_something(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session, job = Session(), QueuedRun(Path("runs/a-1"), FeelChoice())
    session.running.queue.jobs.append(job)
    with Client(page("")) as client, only_writer(job.folder):
        stage = RunStage(AppWindow(session, Addresses(), lambda _: None))
        stage.build()
        (stop,) = (
            one for one in client.elements.values() if isinstance(one, ui.button) and one.text == "Stop"
        )
        stage.refresh()
        assert stop.visible and ELSEWHERE not in texts(client)
        # As on a system without a table of locks.
        monkeypatch.setattr(runs, "lock_holder", lambda folder: None)
        stage.refresh()
        assert not stop.visible and ELSEWHERE in texts(client)
    client.delete()


def texts(client: Client) -> set[str]:
    """Texts of the labels of a page, and names of the choices."""
    labels = {one.text for one in client.elements.values() if isinstance(one, ui.label)}
    choices = [one.options for one in client.elements.values() if isinstance(one, ui.toggle)]
    return labels | {str(name) for names in choices if isinstance(names, dict) for name in names.values()}


def test_a_smooth_texture_offers_no_just_noticeable_differences(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session()
    with Client(page("")) as client:
        feel = FeelStage(AppWindow(session, Addresses(), lambda _: None))
        feel.build()
        (slider,) = (one for one in client.elements.values() if isinstance(one, JndSlider))
        for roughness, shown in ((3e-5, False), (0.05, True)):
            session.numbers.felt = {
                "roughness": np.array([roughness]),
                "contact_area_mm2": np.array([90.0]),
            }
            feel.refresh()
            assert slider.visible == shown
            line = "smooth: V 0.00003 is below 0.004, the least that people have judged"
            assert any(line in text for text in texts(client)) != shown
    client.delete()


def test_a_new_quantity_is_a_goal_and_a_number_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    softness = Quantity(
        *("softness", "softness", "S", "mm/N", 2),
        value=lambda touch: touch.contact_fraction,
        goals=(GoalKey("softness_scale", "X", "softness as a factor", relative=True),),
        meaning="How far the plate gives way.",
    )
    monkeypatch.setitem(QUANTITIES, "softness", softness)
    session = Session()
    session.history.document = AppDocument(PictureChoice("gravel"))
    with Client(page("")) as client:
        window = AppWindow(session, Addresses(), lambda _: None)
        feel, picture = FeelStage(window), PictureStage(window)
        for stage in (feel, picture):
            stage.build()
        session.history.change_feel(goal="softness_scale")
        feel.refresh()
        assert {"Roughness", "Contact area", "Softness", "Like another"} <= texts(client)
        assert {softness.meaning, "softness S", "mm/N"} <= texts(client)
        assert "0.80 of the original's softness" in texts(client)
        assert "--softness-scale=0.8" in feel.commands()[1]
        assert session.document.feel.sentence().startswith("0.8 of the original's softness, all over")
    client.delete()
