"""The page of an experiment in headless Chromium: is an answer lost by reloads, windows, sets made anew?

python -m benchmarks.people.page

Each of 100 loads from a file and of 100 from `retouch answers --serve` answers a trial, waits 0 to 3 s (0 s
in a third of the loads), loads again, and counts what is kept; ten browsers do so in turn. Numbers go to
results/people_page.json.
"""

from __future__ import annotations

import csv
import random
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.shared.browser import Browser
from benchmarks.shared.common import machine, save
from retouch.laboratory.people.plan import TrialPlan, write_plan
from retouch.laboratory.people.serving.experiment_page import write_experiment_page
from retouch.laboratory.stimulus_sets.document import PLATES
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment

BROWSERS, LOADS = 10, 10
"""Browsers, each with an empty storage, and loads of each."""
LONGEST_WAIT_S = 3.0
ROUNDS, SETS = 20, 10
KEPT = "plan.people.flatMap((person) => Object.values(answersOf(person, 'rougher'))).length"
"""Script: number of answers that the page has."""
EMPTY = "localTexts('/').length === 0"
"""Script: whether this load got a localStorage of its own."""


def made(folder: Path) -> tuple[TrialPlan, Path]:
    """A set of two textures at five levels, its plan, and its page."""
    heads = ["texture", "label", "kind", "level", "roughness", "contact_area_mm2"]
    plates = [
        [name, f"{name} {level:+d}", "roughness", level, 0.04 * 1.19**level, 30.0]
        for name in ("gravel", "bark")
        for level in range(-2, 3)
    ]
    folder.mkdir(parents=True)
    with (folder / PLATES).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([heads, *plates])
    plan = write_plan(folder, Experiment(people=3, pairs=120, seed=1))
    assert plan is not None
    return plan, write_experiment_page(folder, plan, "Experiment")


def answer(browser: Browser, person: str = "P1") -> None:
    """Answer the next trial of a person by a key."""
    browser.evaluate(f"trial('{person}', 'rougher')")
    browser.evaluate("document.activeElement.click()")
    for kind in ("keyDown", "keyUp"):
        browser._call("Input.dispatchKeyEvent", type=kind, key="1", text="1" if kind == "keyDown" else "")


def reloads(
    page: Path | str, rng: random.Random, longest_wait_s: float = LONGEST_WAIT_S, script: str = ""
) -> dict[str, Any]:
    """Answers that are missing after a load, over all browsers; a script runs before that of the page."""
    missing = alone = 0
    for _ in range(BROWSERS):
        with Browser() as browser:
            browser._call("Page.addScriptToEvaluateOnNewDocument", source=script)
            browser.open(page, 1280)
            before = int(browser.evaluate(KEPT))
            for given in range(1, LOADS + 1):
                answer(browser)
                wait = max(0.0, rng.uniform(-0.5, 1.0)) * longest_wait_s
                if wait:
                    browser.evaluate(f"new Promise((done) => setTimeout(done, {1000 * wait}))")
                browser.open(page, 1280)
                missing = max(missing, before + given - int(browser.evaluate(KEPT)))
                alone += bool(browser.evaluate(EMPTY))
    loads = BROWSERS * LOADS
    return {"loads": loads, "most_answers_missing": missing, "loads_with_empty_local_storage": alone}


def served(folder: Path, rng: random.Random) -> dict[str, Any]:
    """As `reloads`, from the server, which is killed at the end; its table is counted then."""
    command = [sys.executable, "-m", "retouch", "answers", str(folder), "--serve"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        answers = Path(server.stdout.readline().split(" into ")[1].strip())
        found = reloads(server.stdout.readline().split()[4], rng)
        server.kill()
    rows = (answers / "answers-rougher.csv").read_text().splitlines()[1:]
    return found | {"rows_missing_on_disk": BROWSERS * LOADS - len(rows)}


def windows(browser: Browser, page: Path) -> dict[str, Any]:
    """Answers that are missing after two windows answered in turns, the second of them new in each round."""
    browser.open(page, 1280)
    for _ in range(ROUNDS):
        answer(browser)
        with browser.another():
            browser.open(page, 1280)
            answer(browser, "P2")
        answer(browser, "P3")
    browser.open(page, 1280)
    return {"answers": 3 * ROUNDS, "answers_missing": 3 * ROUNDS - int(browser.evaluate(KEPT))}


def sets(browser: Browser, folder: Path, plan: TrialPlan) -> dict[str, Any]:
    """Sets made anew under the same labels and seed: answers shown as theirs, and answers not offered."""
    shown = 0
    for number in range(SETS):
        plates = tuple(replace(plate, roughness=plate.roughness + 1e-6 * number) for plate in plan.plates)
        browser.open(write_experiment_page(folder, replace(plan, plates=plates), "Experiment"), 1280)
        shown += int(browser.evaluate(KEPT))
        answer(browser)
    browser.open(write_experiment_page(folder, replace(plan, seed=2), "Experiment"), 1280)
    offered = browser.evaluate("earlier().reduce((sum, table) => sum + table[2], 0)")
    return {"sets": SETS, "answers_of_others_shown": shown, "answers_not_offered": SETS - int(offered)}


def main() -> None:
    rng = random.Random(1)
    content: dict[str, Any] = {"machine": machine()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        content["file"] = reloads(made(folder / "file")[1], rng)
        # A localStorage of its own at every load, and no wait before any.
        page = made(folder / "emptied")[1]
        content["file_by_the_database_alone"] = reloads(page, rng, 0.0, "localStorage.clear()")
        made(folder / "served")
        content["served"] = served(folder / "served", rng)
        with Browser() as browser:
            content["two_windows"] = windows(browser, made(folder / "windows")[1])
        with Browser() as browser:
            content["sets_made_anew"] = sets(browser, folder / "sets", made(folder / "sets")[0])
    print(content)
    save("people_page", content)


if __name__ == "__main__":
    main()
