"""What the next start goes on with: all that can be read of the file, and nothing of it is lost."""

import errno
import json
from pathlib import Path
from typing import Any

import pytest

from retouch.app.state.kept import KEPT, read_kept, write_kept
from retouch.app.state.runs import QueuedRun
from retouch.app.values.document import AppDocument, FeelChoice, ObjectChoice, PictureChoice, usual_numbers

FEEL = FeelChoice(numbers=usual_numbers() | {"jnd": -1.5}, settings=("descent.steps=3",))
DOCUMENT = AppDocument(
    PictureChoice("stone.png", (1, 2, 30, 30), relief_mm=0.8, size_mm=10.0),
    FEEL,
    ObjectChoice("parts/knob.stl"),
    "runs/stone-1",
)
RUNS = ["runs/stone-1", "runs/stone-2"]


@pytest.fixture(autouse=True)
def _working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    KEPT.parent.mkdir()


def kept() -> Any:
    """The content of the file that a session has written."""
    write_kept(DOCUMENT, [QueuedRun(Path(run), FEEL) for run in RUNS])
    return json.loads(KEPT.read_text())


def unread() -> Path:
    return Path(f"{KEPT}.unread-1")


def test_what_was_written_is_read_and_the_file_stays() -> None:
    kept()
    document, jobs, fault = read_kept()
    assert document == DOCUMENT and fault == "" and KEPT.is_file() and not unread().exists()
    assert [(str(job.folder), job.feel) for job in jobs] == [(run, FEEL) for run in RUNS]
    KEPT.unlink()
    assert read_kept() == (AppDocument(), [], "")


@pytest.mark.parametrize(
    ("place", "value", "name"),
    [
        (("document", "picture", "crop"), [1], "document.picture.crop"),
        (("document", "picture", "crop"), [1e30, 0, -1e30, 5], "document.picture.crop"),
        (("document", "picture", "crop"), [0, 0, -5, -5], "document.picture.crop"),
        (("document", "picture", "relief_mm"), float("nan"), "document.picture.relief_mm"),
        (("document", "picture", "size_mm"), 10**400, "document.picture.size_mm"),
        (("document", "picture", "of_a_later_version"), 3, "document.picture.of_a_later_version"),
        (("document", "picture", "file"), "caf\udce9.png", "document.picture"),
        (("document", "feel", "skin"), 3, "document.feel.skin"),
        (("document", "feel", "printer"), "\ud800", "document.feel.printer"),
        (("document", "feel", "settings"), ["\ud800"], "document.feel.settings"),
        (("document", "feel", "jnd"), float("inf"), "document.feel.jnd"),
        (("document", "feel", "goal"), "softness", "document.feel.goal"),
        (("document", "part", "turn_deg"), "round", "document.part"),
        (("document", "part", "of_a_later_version"), 10**400, "document.part.of_a_later_version"),
        (("document", "run"), "/elsewhere/run", "document.run"),
        (("document", "run"), "runs/\0", "document.run"),
        (("document", "run"), "runs/\ud800", "document.run"),
        (("document", "of_a_later_version"), "<b>", "document.of_a_later_version"),
        (("document", "\ud800"), 1, "document.?"),
        (("document",), [], "document"),
        (("queue",), 3, "queue"),
        (("of_a_later_version",), 3, "of_a_later_version"),
        (("queue", 0, "folder"), "/etc", "queue.1"),
        (("queue", 0, "folder"), "runs/../../x", "queue.1"),
        (("queue", 0, "folder"), "runs/.x", "queue.1"),
        (("queue", 0, "folder"), "runs/" + "w" * 300, "queue.1"),
        (("queue", 0, "feel"), {"settings": 3}, "queue.1"),
        # The run would be another one without it.
        (("queue", 0, "feel", "of_a_later_version"), 3, "queue.1"),
        (("queue", 0), 3, "queue.1"),
    ],
)
def test_what_cannot_be_read_is_named_and_the_rest_is_taken(place: Any, value: Any, name: str) -> None:
    holder = content = kept()
    for part in place[:-1]:
        holder = holder[part]
    holder[place[-1]] = value
    KEPT.write_text(text := json.dumps(content))
    document, jobs, fault = read_kept()
    assert fault.startswith(f"{KEPT}: not read: {name}") and fault.endswith(
        f"; the file is kept as {unread()}"
    )
    assert unread().read_text() == text and not KEPT.exists()
    document.as_json()
    fault.encode()
    if place[0] == "document":
        assert [str(job.folder) for job in jobs] == RUNS
    if place[0] == "queue":
        assert document == DOCUMENT
        assert [str(job.folder) for job in jobs] == (RUNS[1:] if len(place) > 1 else [])
    if place[0] == "document" and place[1:2] in (("run",), ("part",), ("feel",)):
        assert document.picture == DOCUMENT.picture
    if place[-1] == "crop":
        assert document.picture == PictureChoice("stone.png", relief_mm=0.8, size_mm=10.0)
    if place[-1] == "settings":
        assert document.feel == FeelChoice(numbers=FEEL.numbers)


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"3", b"{" * 10_000, b"[" * 10_000, b'{"document": {}, "q', b"\xff"]
)
def test_a_damaged_file_stays_beside(content: bytes) -> None:
    Path(f"{KEPT}.unread-1").touch()
    KEPT.write_bytes(content)
    document, jobs, fault = read_kept()
    assert document == AppDocument() and jobs == [] and "not read: all of it" in fault
    assert Path(f"{KEPT}.unread-2").read_bytes() == content and unread().read_bytes() == b""


def test_a_file_that_cannot_be_kept_beside_is_not_overwritten(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    KEPT.write_text("[")
    monkeypatch.setattr(Path, "rename", full)
    with pytest.raises(OSError, match="No space left"):
        read_kept()
    assert KEPT.read_text() == "["
