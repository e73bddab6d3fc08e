"""Stages of the page show the session as it is now; without a browser, by the elements that they make."""

from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="without the extra app")

from nicegui import Client, ui
from nicegui.page import page

from retouch.app.stages.printing import PrintStage
from retouch.app.stages.window import Window
from retouch.app.state.addresses import Addresses
from retouch.app.state.session import Session
from retouch.app.values.findings import Written


def test_a_file_for_a_printer_is_not_shown_as_that_of_the_next_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session()

    with Client(page("")) as client:
        stage = PrintStage(Window(session, Addresses(), lambda _: None))
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
