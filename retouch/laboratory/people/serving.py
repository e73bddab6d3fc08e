"""Serves the page of an experiment to this machine alone, and writes each answer to disk as it is given.

Each group of people has a folder in that of the plan, named by its begin and the digest of plan and plates:
no answer counts for other plates, and a new group changes no file of the last one. `acts.jsonl` there gets a
line for each answer and each one taken back, as the page numbers them (`experiment_answers.js`); the tables,
which `retouch answers` reads, are written whole after each of them.

The server listens on the machine itself alone, but every page that the same browser shows can send requests
there. So, as in the app's guard, a request must name this server as its host, come from no other origin, and
show the token of this start.
"""

import json
import os
import secrets
import sys
import time
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from relief.ground.errors import InputError
from relief.ground.files import only_writer, read_limited, write_atomically
from retouch.laboratory.people.experiment_page import PAGE, PLAN_BEGINS, PLAN_ENDS
from retouch.laboratory.people.plan import FOLDER, csv_bytes
from retouch.laboratory.people.reading import HEADINGS, MAGNITUDES, NO, SAME, SORTS, TRIAL, YES

HOST, PORT = "127.0.0.1", 8643
"""Address; where the port is taken, any free one. A browser keeps its own copy of the answers by port."""
LARGEST_PAGE = 1 << 25
"""Most bytes of the page: a plan of 300 people takes 2 MB."""
LARGEST_JOURNAL = 1 << 28
LARGEST_BODY = 1 << 17
"""Most bytes of a request: the page sends at most 200 acts of at most 26 plates."""
LARGEST_NUMBER = 1e100
"""Magnitudes are smaller, as on the page."""
PATIENCE_S = 30.0
"""Longest wait for the rest of a request, s."""
ACTS = "acts.jsonl"


class Plan(BaseModel):
    """The plan as in the page: see `TrialPlan.as_json`."""

    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
    labels: list[str]
    trials: dict[str, dict[str, list[list[int]]]]


class Act(NamedTuple):
    """An answer, or None where the answer to a trial (from 0 on) is taken back."""

    person: str
    question: str
    number: Annotated[int, Field(ge=0, lt=1 << 20)]
    trial: Annotated[int, Field(ge=0)]
    answer: int | float | list[int] | None


class Request(BaseModel):
    """What the page posts."""

    digest: str
    group: str
    acts: list[Act] = []


_ACT = TypeAdapter(Act)


class Group:
    """Answers of a group of people, on disk.

    Args:
        folder: of the plan.
        plan: as in the page.

    Attributes:
        name: of the group; names ascend.
        books: acts by person and question, and by number.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.plan, self._within = plan, folder
        names = [found.name.split("-")[1] for found in folder.glob(f"answers-*-{plan.digest[:8]}")]
        self.name = max(names, default="")
        self.books: dict[tuple[str, str], dict[int, Act]] = {}
        if not self.name:
            self.begin()
        elif (self.folder / ACTS).is_file():
            self._read(read_limited(self.folder / ACTS, LARGEST_JOURNAL))

    @property
    def folder(self) -> Path:
        """The folder of the group."""
        return self._within / f"answers-{self.name}-{self.plan.digest[:8]}"

    def begin(self) -> None:
        """Begin with a new group, whose name follows that of the last one even if the clock was set back."""
        self.name = max(time.strftime("%Y%m%dT%H%M%S"), f"{self.name}0")
        self.books = {}
        self.folder.mkdir()

    def _read(self, lines: bytes) -> None:
        for line in lines.splitlines():
            # A line that a full disk cut off was never confirmed to the page, which sends the act again.
            with suppress(ValidationError, InputError):
                act = _ACT.validate_json(line)
                self.check(act)
                self._enter(act)
        for question in self.plan.trials:
            self._write(question)

    def _enter(self, act: Act) -> None:
        self.books.setdefault((act.person, act.question), {})[act.number] = act

    def check(self, act: Act) -> None:
        """Raise InputError unless the plan has the trial, and the answer is one to it."""
        trials = self.plan.trials.get(act.question, {}).get(act.person, [])
        if act.trial >= len(trials):
            raise InputError("the plan has no such person, question or trial")
        answer, places = act.answer, trials[act.trial]
        if act.question == SORTS:
            fits = isinstance(answer, list) and sorted(answer) == sorted(places)
        elif act.question == MAGNITUDES:
            fits = isinstance(answer, int | float) and 0 < answer < LARGEST_NUMBER
        else:
            fits = isinstance(answer, int) and answer in (0, 1)
        if answer is not None and not fits:
            raise InputError(f"{act.question}: is no answer to trial {act.trial + 1} of {act.person}")

    def add(self, acts: list[Act]) -> bool:
        """Write acts to disk; False, and none is written, if another act has one of their numbers.

        Raises:
            OSError: the disk is full, or the folder is gone.
        """
        known = [self.books.get(act[:2], {}).get(act.number) for act in acts]
        if any(one is not None and one != act for one, act in zip(known, acts, strict=True)):
            return False
        # Each line begins anew, behind whatever a full disk has left of the last one.
        lines = "".join(f"\n{json.dumps(act)}" for act, one in zip(acts, known, strict=True) if one is None)
        with (self.folder / ACTS).open("ab") as journal:
            journal.write(lines.encode())
            journal.flush()
            os.fsync(journal.fileno())
        for act in acts:
            self._enter(act)
        for question in {act.question for act in acts}:
            self._write(question)
        return True

    def _write(self, question: str) -> None:
        """Write the table of a question."""
        person, *others = HEADINGS[question]
        rows: list[list[object]] = [[person, TRIAL, *others]]
        for name in self.plan.trials[question]:
            answers: dict[int, Any] = {}
            for _, act in sorted(self.books.get((name, question), {}).items()):
                if act.answer is None:
                    answers.pop(act.trial, None)
                else:
                    answers.setdefault(act.trial, act.answer)
            for trial, answer in sorted(answers.items()):
                rows += self._rows(question, name, trial, answer)
        if len(rows) > 1 or (self.folder / f"answers-{question}.csv").is_file():
            write_atomically(self.folder / f"answers-{question}.csv", csv_bytes(rows))

    def _rows(self, question: str, person: str, trial: int, answer: Any) -> list[list[object]]:
        begin, labels = [person, trial + 1], self.plan.labels
        if question == SORTS:
            name = f"{TRIAL} {trial + 1}"
            return [[*begin, name, rank, labels[place]] for rank, place in enumerate(answer, start=1)]
        plates = [labels[place] for place in self.plan.trials[question][person][trial]]
        if question == MAGNITUDES:
            return [[*begin, *plates, answer]]
        return [[*begin, *plates, (YES, NO)[answer] if question == SAME else plates[answer]]]


class _Server(ThreadingHTTPServer):
    """The server of a group's page."""

    def __init__(self, group: Group, page: bytes, port: int) -> None:
        super().__init__((HOST, port), _Handler)
        self.group, self.page, self.lock = group, page, Lock()
        self.token = secrets.token_urlsafe(24)
        self.hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}
        # Browsers keep one jar of cookies for all ports of a machine.
        self.cookie = f"retouch-{self.server_port}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = PATIENCE_S
    server_version, sys_version = "Retouch", ""

    def log_message(self, *_: object) -> None:
        """Log nothing."""

    def do_GET(self) -> None:
        """The page, or the acts of the group."""
        if fault := self._fault():
            self._answer(HTTPStatus.FORBIDDEN, fault.encode())
        elif self.path == f"/?token={self.server.token}":
            cookie = f"{self.server.cookie}={self.server.token}; Path=/; HttpOnly; SameSite=Strict"
            self._answer(HTTPStatus.SEE_OTHER, headers={"Location": "/", "Set-Cookie": cookie})
        elif self.path == "/":
            self._answer(HTTPStatus.OK, self.server.page, "text/html")
        elif self.path == "/acts":
            group = self.server.group
            with self.server.lock:
                acts = [act for book in group.books.values() for act in book.values()]
                content = {"digest": group.plan.digest, "group": group.name, "folder": str(group.folder)}
            self._answer(HTTPStatus.OK, json.dumps(content | {"acts": acts}).encode(), "application/json")
        else:
            self._answer(HTTPStatus.NOT_FOUND, b"There is no such page.")

    def do_POST(self) -> None:
        """Acts of the page, or the begin of the next group."""
        length = self.headers.get("Content-Length", "")
        if fault := self._fault():
            return self._answer(HTTPStatus.FORBIDDEN, fault.encode())
        if not (length.isdecimal() and len(length) < 8 and int(length) <= LARGEST_BODY):
            return self._answer(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, b"The request is too long.")
        try:
            request = Request.model_validate_json(self.rfile.read(int(length)), strict=True)
            with self.server.lock:
                status, text = self._done(request)
        except ValidationError:
            status, text = HTTPStatus.BAD_REQUEST, "The request is none of the page's."
        except OSError as error:
            status, text = HTTPStatus.INSUFFICIENT_STORAGE, str(error.strerror)
        self._answer(status, text.encode())

    def _done(self, request: Request) -> tuple[HTTPStatus, str]:
        """Do what a request asks for; acts that are no answers are left out, and the first is named."""
        group, wrong = self.server.group, []
        if (request.digest, request.group) != (group.plan.digest, group.name):
            return HTTPStatus.CONFLICT, "Another group has begun."
        if self.path == "/group":
            group.begin()
            return HTTPStatus.OK, ""
        if self.path != "/acts":
            return HTTPStatus.NOT_FOUND, "There is no such page."
        fitting = []
        for act in request.acts:
            try:
                group.check(act)
                fitting.append(act)
            except InputError as error:
                wrong.append(str(error))
        if not group.add(fitting):
            return HTTPStatus.CONFLICT, "Another window has gone on."
        return (HTTPStatus.BAD_REQUEST, wrong[0]) if wrong else (HTTPStatus.OK, "")

    def _fault(self) -> str | None:
        """Why a request is refused; None if it may pass."""
        server, read = self.server, self.path == f"/?token={self.server.token}"
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0].lower() not in server.hosts:
            return "The host of this request is not this server."
        states_origin = self.command != "GET"
        if (states_origin and len(origins) != 1) or not set(origins) <= {
            f"http://{one}" for one in server.hosts
        }:
            return "This request comes from another page."
        cookies = [part.strip() for one in self.headers.get_all("Cookie", []) for part in one.split(";")]
        own = f"{server.cookie}={server.token}"
        # Compared as bytes: `compare_digest` takes ASCII texts only.
        if read or any(secrets.compare_digest(one.encode(), own.encode()) for one in cookies):
            return None
        return "The token is missing or old: open the address that retouch answers --serve printed."

    def _answer(
        self,
        status: HTTPStatus,
        content: bytes = b"",
        kind: str = "text/plain",
        headers: dict[str, str] | None = None,
    ) -> None:
        own = {
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Length": str(len(content)),
            "Cache-Control": "no-store",
            "Content-Security-Policy": "frame-ancestors 'none'",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
        }
        self.send_response(status)
        for name, value in (own | (headers or {})).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)


def serve(folder: Path) -> None:
    """Serve the page of a set's experiment until Ctrl-C, and print its address.

    Raises:
        InputError: the folder holds no such page, or another command writes into it.
        KeyboardInterrupt: at the end; every answer that was given is on disk.
    """
    file = folder / FOLDER / PAGE
    page = read_limited(file, LARGEST_PAGE)
    plan = _plan_of(file, page)
    with only_writer(folder):
        group = Group(folder / FOLDER, plan)
        try:
            server = _Server(group, page, PORT)
        except OSError:
            server = _Server(group, page, 0)
        with server:
            print(f"answers are written into {group.folder}")
            address = f"http://{HOST}:{server.server_port}/?token={server.token}"
            print(f"The experiment is at {address} (Ctrl-C ends it)", flush=True)
            server.serve_forever()


def _plan_of(file: Path, page: bytes) -> Plan:
    """The plan within a page. Raises InputError."""
    try:
        plan = Plan.model_validate_json(page.partition(PLAN_BEGINS)[2].partition(PLAN_ENDS)[0])
        places = {
            place
            for each in plan.trials.values()
            for trials in each.values()
            for trial in trials
            for place in trial
        }
        if not plan.trials.keys() <= HEADINGS.keys() or not places <= set(range(len(plan.labels))):
            raise InputError("has other questions or plates")
    except (ValidationError, InputError):
        advice = "retouch stimuli --redraw -o SET writes it anew"
        raise InputError(f"{file}: is no page of an experiment; {advice}") from None
    return plan
