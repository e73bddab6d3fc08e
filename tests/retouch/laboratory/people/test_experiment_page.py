"""The experiment in a real browser: keys answer, answers stay, and the saved tables are read."""

import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from retouch.laboratory.people.plan import TrialPlan, plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import read_answers
from retouch.laboratory.people.serving.experiment_page import write_experiment_page
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]
SOON = "new Promise((done) => setTimeout(done, 300))"
QUOTA = "() => { throw new DOMException('', 'QuotaExceededError'); }"
FULL = f"Storage.prototype.setItem = {QUOTA}; IDBObjectStore.prototype.add = {QUOTA}"
SWITCHED_OFF = """for (const name of ["localStorage", "indexedDB"]) {
  Object.defineProperty(window, name, { get: () => { throw new DOMException("", "SecurityError"); } });
}"""
CODES = {
    "Enter": 13,
    "Backspace": 8,
    "Escape": 27,
    "ArrowRight": 39,
    "ArrowDown": 40,
    ",": 188,
    "-": 189,
    ".": 190,
}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as open_browser:
        yield open_browser


def plan_of(made: Path, tmp_path: Path) -> TrialPlan:
    """A plan of its own, as one browser keeps answers by plan."""
    seed = sum(tmp_path.name.encode())
    return plan(read_plates(made), Experiment(people=2, pairs=6, seed=seed))


def page_of(made: Path, tmp_path: Path, of: TrialPlan | None = None) -> Path:
    """The page in a folder of its own."""
    (tmp_path / "set").mkdir(exist_ok=True)
    shutil.copy(made / "plates.csv", tmp_path / "set")
    title = "Experiment: gravel, bark </script><script>alert(1)</script>"
    return write_experiment_page(tmp_path / "set", of or plan_of(made, tmp_path), title)


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


def complaint(browser: Browser) -> str:
    text: str = browser.evaluate("document.getElementById('storage').innerText")
    return text


def shown(browser: Browser) -> str:
    text: str = browser.evaluate("document.getElementById('stage').innerText")
    return text


@pytest.mark.sentinel
@pytest.mark.parametrize("empty", [False, True], ids=["both copies", "an empty localStorage at every load"])
def test_an_experiment_is_run_by_keys_and_goes_on_after_a_reload(
    made: Path, tmp_path: Path, empty: bool
) -> None:
    with Browser() as browser:
        if empty:  # as headless Chromium gives it to some of the loads from a file
            browser._call("Page.addScriptToEvaluateOnNewDocument", source="localStorage.clear()")
        run_by_keys(browser, made, tmp_path)


def run_by_keys(browser: Browser, made: Path, tmp_path: Path) -> None:
    page = page_of(made, tmp_path)
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
    assert "Answers kept in this browser: 2" in shown(browser)
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
    press(browser, "Enter")
    for typed in ("-3", "1,000", "1.000", "1.000,5", "1,000.5", "1e3", "0x1", "0"):
        press(browser, *typed, "Enter")
        assert "A plain number above 0" in shown(browser), typed
        press(browser, *["Backspace"] * len(typed))
    press(browser, *"2,5", "Enter")
    assert browser.evaluate("csvOf('magnitudes')").splitlines()[1].endswith(",2.5")
    for question in ("sorts", "magnitudes"):
        (tmp_path / f"{question}.csv").write_text(browser.evaluate(f"csvOf('{question}')"), newline="")
    files = [tmp_path / "sorts.csv", tmp_path / "magnitudes.csv"]
    answers = read_answers(files, read_plates(made), {}, partial=False)
    assert len(answers.sorts[0].labels) == 5 and answers.magnitudes[0].magnitude == 2.5


def test_the_table_is_offered_and_closing_asks_until_it_is_saved(
    browser: Browser, made: Path, tmp_path: Path
) -> None:
    page = page_of(made, tmp_path)
    browser._call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    browser.open(page, 1280)
    browser.evaluate("trial('P1', 'sorts')")
    press(browser, "Enter", *"CABDE", "Enter", "Enter", *"CABDE", "Enter")
    assert browser.evaluate("document.activeElement.textContent") == "Save the table (S)"
    browser.open(page, 1280)
    assert browser.dialogs() == ["beforeunload"]
    browser.evaluate("trial('P1', 'sorts')")
    press(browser, "Enter")
    assert "saved as answers-sorts.csv" in shown(browser)
    browser.open(page, 1280)
    press(browser, "ArrowRight")
    browser.open(page, 1280)
    assert browser.dialogs() == []
    saved = read_answers([tmp_path / "answers-sorts.csv"], read_plates(made), {}, partial=False)
    assert len(saved.sorts) == 2


def test_windows_keep_one_anothers_answers(browser: Browser, made: Path, tmp_path: Path) -> None:
    page = page_of(made, tmp_path)
    browser.open(page, 1280)
    browser.evaluate("trial('P1', 'rougher')")
    press(browser, "Enter", "1", "Enter")
    with browser.another():
        browser.open(page, 1280)
        browser.evaluate("trial('P2', 'rougher')")
        press(browser, "Enter", "1", "Enter", "2")
        # Both windows ask the second trial of the same question; the window that answers second is refused.
        browser.evaluate("trial('P1', 'rougher')")
        press(browser, "Enter", "2", "Enter", "2")
    press(browser, "1")
    browser.evaluate(SOON)
    assert "Another window has gone on here" in complaint(browser) and "trial 4 of 6" in shown(browser)
    press(browser, "Enter", "1")
    assert complaint(browser) == ""
    browser.open(page, 1280)
    assert "Answers kept in this browser: 6" in shown(browser)
    assert browser.evaluate("answersOf('P1', 'rougher').map((act) => act.answer)") == [0, 1, 1, 0]


def test_windows_that_answer_at_the_same_time_agree(browser: Browser, made: Path, tmp_path: Path) -> None:
    page = page_of(made, tmp_path)
    at = 1000.0 * (time.time() + 3.0)
    answering = f"setTimeout(() => take('P1', 'rougher', 0, %d), {at} - Date.now())"
    answers = "answersOf('P1', 'rougher').map((act) => act.answer)"
    browser.open(page, 1280)
    browser.evaluate(answering % 0)
    with browser.another():
        browser.open(page, 1280)
        browser.evaluate(answering % 1)
        browser.evaluate(f"new Promise((done) => setTimeout(done, {at + 500} - Date.now()))")
        other = browser.evaluate(answers)
    assert len(other) == 1 and browser.evaluate(answers) == other
    browser.open(page, 1280)
    assert browser.evaluate(answers) == other


def test_answers_to_another_set_or_group_are_offered_and_not_shown(
    browser: Browser, made: Path, tmp_path: Path
) -> None:
    of = plan_of(made, tmp_path)
    page = page_of(made, tmp_path)
    browser.open(page, 1280)
    before = browser.evaluate("earlier().length")
    press(browser, "Enter", "Enter", "1")
    # The same labels, trials and seed.
    plates = tuple(replace(plate, roughness=1.1 * plate.roughness) for plate in of.plates)
    browser.open(page_of(made, tmp_path, replace(of, plates=plates)), 1280)
    assert "Answers kept in this browser: 0" in shown(browser)
    assert "Answers of other plans or earlier groups" in shown(browser)
    assert browser.evaluate("earlier().length") == before + 1
    labels = [of.labels[place] for place in of.trials["rougher"]["P1"][0]]
    row = ",".join(["P1", "1", *labels, labels[0]])
    assert any(row in text for text in browser.evaluate("earlier().map((table) => table[1])"))
    press(browser, "Enter", "Enter", "2", "Escape", "n")
    browser.evaluate(SOON)
    assert browser.dialogs() == ["beforeunload", "confirm"]
    for _ in range(3):
        assert "Answers kept in this browser: 0" in shown(browser)
        assert browser.evaluate("earlier().length") == before + 2
        browser.open(page, 1280)
    # A page of a former version kept all answers of a plan under one key.
    browser.evaluate(
        "localStorage.setItem('retouch-experiment-0123456789abcdef', '{\"P1\":{\"same\":[0,1]}}')"
    )
    assert ["retouch-experiment-0123456789abcdef.json", 2] in browser.evaluate(
        "earlier().map((table) => [table[0], table[2]])"
    )
    browser.evaluate("localStorage.removeItem('retouch-experiment-0123456789abcdef')")


def test_what_is_cleared_while_the_page_is_open_is_kept_again(made: Path, tmp_path: Path) -> None:
    with Browser() as browser:
        page = page_of(made, tmp_path)
        browser.open(page, 1280)
        press(browser, "Enter", "Enter", "1", "Enter", "2")
        browser.evaluate("localStorage.clear(); transact('readwrite', (acts) => acts.clear())")
        press(browser, "Enter", "1")
        browser.evaluate(SOON)
        browser.open(page, 1280)
        assert "Answers kept in this browser: 3" in shown(browser)


@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        (FULL, "The storage of this browser is full, or its window is private. Save the answers (S)"),
        (
            SWITCHED_OFF,
            "The storage of this browser is switched off, private or broken. Save the answers (S)",
        ),
        (f"Storage.prototype.setItem = {QUOTA}", "is full, or its window is private."),
        ("indexedDB.open = () => { throw new Error() }", "is switched off, private or broken."),
        (
            "localStorage.setItem('retouch-experiment/a/0/P1/rougher/0', '{')",
            "Some of what this browser kept is damaged and was left out.",
        ),
    ],
    ids=["full", "switched off", "one full", "no database", "damaged"],
)
def test_what_is_wrong_with_the_storage_is_said(
    made: Path, tmp_path: Path, script: str, sentence: str
) -> None:
    with Browser() as browser:
        browser._call("Page.addScriptToEvaluateOnNewDocument", source=script)
        browser.open(page_of(made, tmp_path), 1280)
        press(browser, "Enter", "Enter", "1")
        browser.evaluate(SOON)
        assert sentence in complaint(browser)
        # The page goes on, and its answers can be saved.
        press(browser, "Enter", "2")
        assert "trial 3 of 6" in shown(browser)
        assert len(browser.evaluate("csvOf('rougher')").splitlines()) == 3


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
