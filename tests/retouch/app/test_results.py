"""What the app shows of a run with a printer: both sides are prints, on one grid."""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="without the extra app")

from nicegui import Client
from nicegui.page import page

from optimize.descent.correction import CorrectionState
from optimize.descent.driver import Iterate
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.run_directory.checkpoint import Checkpoint, save_checkpoint
from optimize.run_directory.key import RESULT
from optimize.run_directory.results import write_relief, write_settings
from optimize.settings.run_file import run_from_scene
from relief.heightmap import save_heights_exr, save_heights_png
from retouch.app.computing import results
from retouch.app.stages.compare import CompareStage
from retouch.app.stages.objects import ObjectStage
from retouch.app.stages.printing import PrintStage
from retouch.app.stages.run import RunStage
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.state.activity import Activity
from retouch.app.state.addresses import Addresses
from retouch.app.state.runs import QueuedRun
from retouch.app.state.session import Session
from retouch.app.values.document import AppDocument, FeelChoice, usual_numbers
from tests.retouch.app.test_stages import texts
from tests.retouch.pages.plausible import of_a_print

NO_RESULT = "No run has a result yet."
PIXELS = 25
"""Pixels a side of a plate of 10 mm with the usual nozzle."""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a run with a printer, whose design has a finer grid than its print."""
    monkeypatch.chdir(tmp_path)
    at = np.arange(48) / 48
    waves = 0.3 * (2.0 + np.sin(8 * np.pi * at)[:, None] + np.cos(6 * np.pi * at)[None, :])
    folder = Path("runs/a-1")
    save_heights_png(f"{folder}.png", waves, 1.2, 10.0)
    settings = run_from_scene("studio", f"{folder}.png", ["touch.jnd=1", 'print.printer="filament"'])
    folder.mkdir()
    write_settings(folder, settings)
    write_relief(folder, settings.relief(10.0))
    return folder


def test_original_and_result_of_a_run_with_a_printer_are_both_prints(run: Path) -> None:
    sides = results.sides(str(run))
    assert sides.before.heights.shape == sides.after.heights.shape == (PIXELS, PIXELS)
    assert sides.change is not None and sides.before.printer is not None


def test_sides_of_two_grids_have_no_change_and_strains_all_the_same(run: Path) -> None:
    """As where somebody has put another picture in the original's place."""
    save_heights_exr(run / "heights.exr", np.zeros((32, 32)), 10.0)
    sides = results.sides(str(run))
    assert sides.change is None and sides.strain[0].high == sides.strain[1].high


def test_the_best_so_far_of_a_run_with_a_printer_lies_beside_the_print_of_its_original(run: Path) -> None:
    best = np.zeros((PIXELS, PIXELS))
    values = {"roughness": np.array([0.1]), "contact_area_mm2": np.array([50.0])}
    at = Iterate(1, best, values, 0.5, 1.0, 1.0, {"trust": np.ones(2)})
    state = CorrectionState(Targets.of(0.01, roughness=0.1))
    save_checkpoint(run, Checkpoint(at, at, state, 1.0))
    original, found = results.best_so_far(str(run))
    assert original.heights.shape == found.heights.shape == (PIXELS, PIXELS)
    assert original.printer is not None and original.heights.any()


@pytest.mark.parametrize("stage", [CompareStage, PrintStage, ObjectStage])
def test_a_result_that_cannot_be_shown_is_not_said_to_be_missing(
    run: Path, stage: Callable[[AppWindow], PageStage]
) -> None:
    session = Session()
    with Client(page("")) as client:
        built = stage(AppWindow(session, Addresses(), lambda _: None))
        built.build()
        built.refresh()
        session.history.look_at("runs/b-1")
        built.refresh()
        assert "b-1 has no result yet." in texts(client)
        session.activity.faults["sides"] = "ValueError: unforeseen"
        built.refresh()
        assert "ValueError: unforeseen" in texts(client)
        (run / "heights.exr").unlink()
        session.activity.faults.clear()
        built.refresh()
        assert NO_RESULT in texts(client)
    client.delete()


def test_a_fault_that_no_check_has_found_leaves_a_traceback_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    activity = Activity()
    with caplog.at_level(logging.WARNING):
        try:
            np.stack([np.zeros(2), np.zeros(3)])
        except ValueError as error:
            activity.fail("sides", error)
    assert activity.faults["sides"].startswith("ValueError: ")
    (record,) = caplog.records
    assert record.exc_info is not None and record.exc_info[0] is ValueError


def test_the_run_page_says_why_a_run_ended_short_and_what_its_printer_does(run: Path) -> None:
    stop = {"reason": "swinging", "message": StopReason.SWINGING.value}
    verification = of_a_print(design=17.2, change=3.3, stop=stop)
    (run / RESULT).write_text(verification.model_dump_json(by_alias=True))
    session = Session()
    session.history.document = AppDocument(run=str(run))
    session.running.queue.jobs.append(QueuedRun(run, FeelChoice(printer="filament")))
    with Client(page("")) as client:
        stage = RunStage(AppWindow(session, Addresses(), lambda _: None))
        stage.build()
        stage.refresh()
        said = texts(client)
    client.delete()
    assert "a-1: ended short of the target" in said and StopReason.SWINGING.value in said
    assert any(
        "changes the look of the original by 17\N{NARROW NO-BREAK SPACE}% of the mean picture" in text
        for text in said
    )


def test_the_goal_of_a_run_names_its_printer() -> None:
    feel = FeelChoice(numbers=usual_numbers() | {"jnd": 2.0}, printer="filament")
    assert feel.sentence().endswith("to the finger paper, as printed by filament.")
    assert "printed" not in FeelChoice().sentence()
