"""The experiment in a real browser: keys answer, answers stay, and the saved tables are read."""

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from retouch.laboratory.people.experiment_page import write_experiment_page
from retouch.laboratory.people.plan import plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import read_answers
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]
CODES = {"Enter": 13, "Backspace": 8, "Escape": 27, "ArrowRight": 39, "ArrowDown": 40}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as open_browser:
        yield open_browser


class Silent(SimpleHTTPRequestHandler):
    """Serves files and logs nothing."""

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def served() -> Iterator[Callable[[Path], str]]:
    """Gives a page the address of a server that lasts as long as the test.

    Headless Chromium gives a page that is opened as a file an empty storage of its own at some loads.
    """
    with ExitStack() as servers:

        def serve(page: Path) -> str:
            handler = partial(Silent, directory=str(page.parent))
            server = servers.enter_context(ThreadingHTTPServer(("127.0.0.1", 0), handler))
            threading.Thread(target=server.serve_forever, daemon=True).start()
            servers.callback(server.shutdown)
            return f"http://127.0.0.1:{server.server_port}/{page.name}"

        yield serve


def page_of(made: Path, tmp_path: Path) -> Path:
    """The page in a folder of its own, with a plan of its own, as one browser keeps answers by plan."""
    folder = tmp_path / "set"
    folder.mkdir()
    shutil.copy(made / "plates.csv", folder)
    of = plan(read_plates(folder), Experiment(people=2, pairs=6, seed=sum(tmp_path.name.encode())))
    return write_experiment_page(folder, of, "Experiment: gravel, bark </script><script>alert(1)</script>")


def press(browser: Browser, *keys: str) -> None:
    for key in keys:
        text = "\r" if key == "Enter" else key if len(key) == 1 else ""
        for kind in ("keyDown", "keyUp"):
            browser._call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                text=text if kind == "keyDown" else "",
                windowsVirtualKeyCode=CODES.get(key, ord(key[0].upper())),
            )


def shown(browser: Browser) -> str:
    text: str = browser.evaluate("document.getElementById('stage').innerText")
    return text


@pytest.mark.sentinel
def test_an_experiment_is_run_by_keys_and_goes_on_after_a_reload(
    browser: Browser, made: Path, tmp_path: Path, served: Callable[[Path], str]
) -> None:
    page = served(page_of(made, tmp_path))
    browser.open(page, 1280)
    press(browser, "Enter")
    assert "trial 1 of 6" in shown(browser) and "Lay these two plates out" in shown(browser)
    press(browser, "Enter")
    # The second screen names no plate.
    assert "Which plate feels rougher?" in shown(browser) and "gravel" not in shown(browser)
    press(browser, "2", "Enter", "1", "Enter", "1", "Backspace")
    assert "trial 3 of 6" in shown(browser)
    browser.open(page, 1280)
    assert browser.evaluate("document.activeElement.textContent") == "2 of 6"
    press(browser, "Enter")
    for key in "1212":
        press(browser, "Enter", key)
    assert "All trials are done" in shown(browser)
    told = browser.evaluate("csvOf('rougher')")
    plates = read_plates(made)
    (tmp_path / "a.csv").write_text(told, newline="")
    answers = read_answers([tmp_path / "a.csv"], plates, {}, partial=False)
    assert [pair.second_told for pair in answers.pairs["rougher"]] == [True, False, False, True, False, True]


def test_sorts_and_numbers_are_typed(browser: Browser, made: Path, tmp_path: Path) -> None:
    browser.open(page_of(made, tmp_path), 1280)
    browser.evaluate("trial('P2', 'sorts')")
    press(browser, "Enter", *"CABD", "Enter")
    assert "Type each letter from A to E once" in shown(browser)
    press(browser, "E", "Enter")
    assert "trial 2 of 2" in shown(browser)
    browser.evaluate("trial('P1', 'magnitudes')")
    press(browser, "Enter", *"-3", "Enter")
    assert "A number above 0" in shown(browser)
    press(browser, "Backspace", "Backspace", *"2,5", "Enter")
    assert browser.evaluate("csvOf('magnitudes')").splitlines()[1].endswith(",2.5")
    for question in ("sorts", "magnitudes"):
        (tmp_path / f"{question}.csv").write_text(browser.evaluate(f"csvOf('{question}')"), newline="")
    files = [tmp_path / "sorts.csv", tmp_path / "magnitudes.csv"]
    answers = read_answers(files, read_plates(made), {}, partial=False)
    assert len(answers.sorts[0].labels) == 5 and answers.magnitudes[0].magnitude == 2.5


def test_the_page_is_whole_on_every_screen(browser: Browser, made: Path, tmp_path: Path) -> None:
    page = page_of(made, tmp_path)
    assert {width: faults(browser, page, width) for width in WIDTHS} == {width: [] for width in WIDTHS}


def test_the_page_of_the_answers_is_whole_on_every_screen(
    browser: Browser, made: Path, tmp_path: Path
) -> None:
    import retouch

    files = sorted((made / "answers").glob("*.csv"))
    page = retouch.answers(made, files, tmp_path).page
    assert page is not None
    assert {width: faults(browser, page, width) for width in WIDTHS} == {width: [] for width in WIDTHS}
