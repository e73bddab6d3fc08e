"""The served experiment: answers are on disk when they are confirmed, and strangers are refused."""

import http.client
import json
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from benchmarks.shared.browser import Browser, chromium
from optimize.runs.interrupts import INTERRUPTED
from retouch.commands.main import BAD_INPUT, main
from retouch.laboratory.people.plan import FOLDER, TrialPlan, write_plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import MAGNITUDES, ROUGHER, SAME, SORTS, read_answers
from retouch.laboratory.people.serving.experiment_page import PAGE, write_experiment_page
from retouch.laboratory.people.serving.group import ACTS
from retouch.laboratory.people.serving.server import LARGEST_BODY
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment
from tests.retouch.laboratory.people.test_experiment_page import SOON, complaint, press, shown

pytestmark = pytest.mark.slow


class Served:
    """A server in a process of its own."""

    def __init__(self, folder: Path, plan: TrialPlan) -> None:
        command = [sys.executable, "-m", "retouch", "answers", str(folder), "--serve"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.answers = Path(self.process.stdout.readline().split(" into ")[1].strip())
        self.address = self.process.stdout.readline().split()[4]
        host, self.token = self.address.removeprefix("http://").split("/?token=")
        self.host, self.port, self.plan = host, int(host.split(":")[1]), plan

    def ask(self, method: str, path: str, body: str | bytes = "", **headers: str) -> tuple[int, bytes]:
        """Status and content of an answer to a request that has all that the page's own have."""
        own = {"Origin": f"http://{self.host}"}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        path = path if "?" in path else f"{path}?token={self.token}"
        connection.request(method, path, body, {k: v for k, v in (own | headers).items() if v})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content

    def give(self, *acts: Any, **changed: str) -> int:
        """Status of the answer to acts."""
        there = json.loads(self.ask("GET", "/acts")[1])
        content = {"digest": there["digest"], "group": there["group"], "acts": acts} | changed
        return self.ask("POST", "/acts", json.dumps(content))[0]

    def rows(self, question: str) -> list[str]:
        """Rows of a table on disk, without headings."""
        return (self.answers / f"answers-{question}.csv").read_text().splitlines()[1:]


@contextmanager
def serving(folder: Path, plan: TrialPlan) -> Iterator[Served]:
    served = Served(folder, plan)
    try:
        yield served
    finally:
        served.process.kill()
        served.process.communicate()


@pytest.fixture
def planned(made: Path, tmp_path: Path) -> tuple[Path, TrialPlan]:
    folder = tmp_path / "set"
    folder.mkdir()
    shutil.copy(made / "plates.csv", folder)
    plan = write_plan(folder, Experiment(people=2, pairs=6))
    assert plan is not None
    write_experiment_page(folder, plan, "Experiment")
    return folder, plan


def test_every_kind_of_answer_is_on_disk_when_it_is_confirmed(planned: tuple[Path, TrialPlan]) -> None:
    folder, plan = planned
    sort = plan.trials[SORTS]["P1"][0]
    with serving(*planned) as served:
        assert served.give(["P1", ROUGHER, 0, 0, 1], ["P1", SAME, 0, 0, 0]) == 200
        assert served.give(["P1", SORTS, 0, 0, sort[::-1]], ["P1", MAGNITUDES, 0, 0, 2.5]) == 200
        served.process.kill()
        told = read_answers(sorted(served.answers.glob("*.csv")), read_plates(folder), {}, partial=False)
    first, second = (plan.labels[place] for place in plan.trials[ROUGHER]["P1"][0])
    assert [(pair.first, pair.second, pair.told) for pair in told.pairs[ROUGHER]] == [(first, second, second)]
    assert told.pairs[SAME][0].told == "yes" and told.magnitudes[0].magnitude == 2.5
    assert told.sorts[0].labels == tuple(plan.labels[place] for place in sort[::-1])
    # What a full disk or a kill has left of a line is left out, and the next line is whole.
    with (served.answers / ACTS).open("ab") as journal:
        journal.write(b'\n["P1", "roug')
    with serving(*planned) as again:
        assert again.answers == served.answers and len(json.loads(again.ask("GET", "/acts")[1])["acts"]) == 4
        assert again.give(["P1", ROUGHER, 1, 0, None], ["P1", ROUGHER, 2, 0, 0]) == 200
        assert again.rows(ROUGHER) == [f"P1,1,{first},{second},{first}"]
        assert again.give(["P1", ROUGHER, 3, 0, None]) == 200 and again.rows(ROUGHER) == []
        again.process.send_signal(signal.SIGINT)
        assert again.process.wait(timeout=60) == INTERRUPTED
    assert len((served.answers / ACTS).read_bytes().split()) > 0


def test_strangers_and_what_is_no_answer_are_refused(planned: tuple[Path, TrialPlan]) -> None:
    with serving(*planned) as served:
        for headers in (
            {"Host": f"evil.example:{served.port}"},
            {"Host": "127.0.0.1"},
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Origin": f"http://127.0.0.1:{served.port + 1}"},
        ):
            assert served.ask("GET", "/acts", **headers)[0] == 403, headers
            assert served.ask("POST", "/acts", "{}", **headers)[0] == 403, headers
        assert served.ask("POST", "/acts", "{}", Origin="")[0] == 403
        for token in ("", "token=", f"token={served.token[:-1]}", f"token={served.token}&a"):
            assert served.ask("GET", f"/?{token}")[0] == served.ask("POST", f"/acts?{token}")[0] == 403
        for path in ("/../../plates.csv", "/acts/", "/index.html", "/%2e%2e/plates.csv"):
            assert served.ask("GET", path)[0] == 404, path
        assert served.ask("POST", "/acts", b"x" * (LARGEST_BODY + 1))[0] == 413
        assert served.ask("POST", "/acts", "", **{"Content-Length": "-1"})[0] == 413
        for body in ("", "[]", "{", "[" * 50000, '{"digest": 1}', b"\xff", "9" * 5000):
            assert served.ask("POST", "/acts", body)[0] == 400, body[:20]
        for act in (
            ["P9", ROUGHER, 0, 0, 1],
            ["P1", "../../plates", 0, 0, 1],
            ["P1", ROUGHER, 0, 6, 1],
            ["P1", ROUGHER, 0, -1, 1],
            ["P1", ROUGHER, -1, 0, 1],
            ["P1", ROUGHER, 1 << 60, 0, 1],
            ["P1", ROUGHER, 0, 0, 2],
            ["P1", ROUGHER, 0, 0, True],
            ["P1", ROUGHER, 0, 0, "=1+1"],
            ["P1", SORTS, 0, 0, [0, 0, 1, 2, 3]],
            ["P1", SORTS, 0, 0, 1],
            ["P1", MAGNITUDES, 0, 0, 0],
            ["P1", MAGNITUDES, 0, 0, float("nan")],
            ["P1", MAGNITUDES, 0, 0, 10**400],
            ["P1", ROUGHER, 0, 0],
        ):
            assert served.give(act) == 400, act
        assert served.give(["P1", ROUGHER, 0, 0, 1], digest="0" * 16) == 409
        assert served.give(["P1", ROUGHER, 0, 0, 1], group="../x") == 409
        with socket.create_connection(("127.0.0.1", served.port)) as line:
            line.sendall(b"GET /acts?token=\xe9 HTTP/1.0\r\nHost: %s\r\n\r\n" % served.host.encode())
            assert b"403" in line.recv(100)
        # A good answer beside a bad one is kept.
        assert served.give(["P1", ROUGHER, 0, 0, 1], ["P9", ROUGHER, 0, 0, 1]) == 400
        assert len(served.rows(ROUGHER)) == 1
        assert {file.name for file in served.answers.iterdir()} == {ACTS, "answers-rougher.csv"}


def test_two_writers_lose_nothing(
    planned: tuple[Path, TrialPlan], capsys: pytest.CaptureFixture[str]
) -> None:
    with serving(*planned) as served:
        # A second window asks the same trials; what comes second is not taken.
        assert served.give(["P1", ROUGHER, 0, 0, 1]) == 200
        assert served.give(["P1", ROUGHER, 0, 0, 1]) == 200
        assert served.give(["P1", ROUGHER, 0, 0, 0]) == 409
        with ThreadPoolExecutor(8) as windows:
            acts = [[f"P{1 + k % 2}", MAGNITUDES, k // 2, k // 2, k + 1] for k in range(60)]
            assert set(windows.map(served.give, acts)) == {200}
        assert len(served.rows(ROUGHER)) == 1 and len(served.rows(MAGNITUDES)) == 60
        assert main(["answers", str(planned[0]), "--serve"]) == BAD_INPUT
        assert "another command is writing into this folder" in capsys.readouterr().err


def test_a_folder_of_answers_may_get_a_longer_name(planned: tuple[Path, TrialPlan]) -> None:
    with serving(*planned) as served:
        assert served.give(["P1", ROUGHER, 0, 0, 1]) == 200
    begin, name, end = served.answers.name.split("-")
    served.answers.rename(served.answers.with_name(f"{begin}-{name}-first-group-{end}"))
    with serving(*planned) as again:
        assert again.give(["P1", ROUGHER, 1, 1, 1]) == 200 and len(again.rows(ROUGHER)) == 2


def test_what_cannot_be_served_is_refused(
    planned: tuple[Path, TrialPlan], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = planned
    assert main(["answers", str(folder), "a.csv", "--serve"]) == BAD_INPUT
    assert "--serve: takes a folder alone" in capsys.readouterr().err
    page = folder / FOLDER / PAGE
    whole = page.read_text()
    for damaged in (
        "",
        whole.replace('"rougher"', '"../rougher"'),
        whole.replace('"digest": "', '"digest": "../'),
        whole.replace("connect-src", "img-src"),
    ):
        page.write_text(damaged)
        assert main(["answers", str(folder), "--serve"]) == BAD_INPUT
        assert "is no page of an experiment; retouch stimuli --redraw" in capsys.readouterr().err
    page.unlink()
    assert main(["answers", str(folder), "--serve"]) == BAD_INPUT


@pytest.mark.skipif(chromium() is None, reason="no Chromium here")
def test_answers_outlive_the_server_and_groups_stay_apart(planned: tuple[Path, TrialPlan]) -> None:
    with Browser() as browser:
        with serving(*planned) as served:
            browser.open(served.address, 1280)
            press(browser, "Enter", "Enter", "1", "Enter", "2")
            browser.evaluate(SOON)
            assert len(served.rows(ROUGHER)) == 2
            served.process.kill()
            served.process.wait()
            press(browser, "Enter", "1")
            browser.evaluate(SOON)
            assert "The server does not answer" in complaint(browser)
        with serving(*planned) as served:
            browser.open(served.address, 1280)
            assert browser.dialogs() == ["beforeunload"] and f"Answers kept in {served.answers}: 3" in shown(
                browser
            )
            browser.evaluate(SOON)
            assert len(served.rows(ROUGHER)) == 3
            press(browser, "n")
            browser.evaluate(SOON)
            assert ": 0" in shown(browser) and "earlier groups in this browser: 3" in shown(browser)
            press(browser, "Enter", "Enter", "2")
            browser.evaluate(SOON)
            groups = sorted(served.answers.parent.glob("answers-*"))
            assert groups[0] == served.answers and len(served.rows(ROUGHER)) == 3
            assert len((groups[1] / "answers-rougher.csv").read_text().splitlines()) == 2
