"""`retouch app` in a folder: one app at a time, and pictures of any name."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.shared.app_window import App
from mitsuba_scenes import FOLDER
from relief.ground.files import only_writer
from retouch.app.state.kept import KEPT
from retouch.commands.main import main

httpx = pytest.importorskip("httpx", reason="without the extra app")
pytest.importorskip("nicegui", reason="without the extra app")

BUSY = "retouch: runs: the app is open in this folder already; go on in its page, or close it first\n"


def test_a_second_app_in_a_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    KEPT.parent.mkdir()
    KEPT.write_text("of the first app")
    with only_writer(KEPT.parent):
        assert main(["app", "gravel", "--no-browser", "--port", "0"]) == 2
    assert capsys.readouterr() == ("", BUSY)
    assert [file.name for file in KEPT.parent.iterdir()] == [KEPT.name]
    assert KEPT.read_text() == "of the first app"


@pytest.mark.slow
def test_a_picture_whose_name_is_no_utf8_is_shown_at_this_start_and_the_next(tmp_path: Path) -> None:
    name = os.fsdecode(b"caf\xe9.png")
    shutil.copy(FOLDER / "textures" / "dots.png", tmp_path / name)
    for words in ([name], []):
        with App(tmp_path, *words) as app:
            end = time.monotonic() + 60.0
            while (
                "pictures/caf.png"
                not in httpx.get(app.address, follow_redirects=True).raise_for_status().text
            ):
                assert time.monotonic() < end
                time.sleep(0.1)
            another = [sys.executable, "-m", "retouch", "app", "--no-browser", "--port", "0"]
            second = subprocess.run(another, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert (second.returncode, second.stdout, second.stderr) == (2, "", BUSY)
            assert app.close() == 0
    kept = json.loads((tmp_path / KEPT).read_text())
    assert kept["document"]["picture"]["file"] == "pictures/caf.png"
    assert (tmp_path / "pictures" / "caf.png").read_bytes() == (tmp_path / name).read_bytes()
    assert list((tmp_path / "runs").glob("app.json.unread-*")) == []
