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
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from relief.ground.errors import InputError
from relief.ground.files import only_writer, read_limited, write_atomically
from retouch.laboratory.people.experiment_page import PAGE, PLAN_BEGINS, PLAN_ENDS
from retouch.laboratory.people.plan import FOLDER, csv_bytes
from retouch.laboratory.people.reading import HEADINGS, MAGNITUDES, NO, SAME, SORTS, TRIAL, YES

HOST, PORTS = "127.0.0.1", (*range(8643, 8653), 0)
"""Address; the first free port, as a browser keeps its own copy of the answers by port; else (0) any."""
LARGEST_FILE = 1 << 28
"""Most bytes of the page and of the acts: a plan of 300 people takes 2 MB, their acts take 10."""
LARGEST_BODY = 1 << 17
"""Most bytes of a request: the page sends at most 200 acts of at most 26 plates."""
LARGEST_MAGNITUDE = 1e100
"""Magnitudes are smaller, as on the page."""
PATIENCE_S = 30.0
"""Longest wait for the rest of a request, s."""
ACTS = "acts.jsonl"
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Headers of every answer; the page has a policy of its own besides."""

Question = Literal["rougher", "colder", "same", "sorts", "magnitudes"]
Rows = list[list[Any]]


class Plan(BaseModel):
    """The plan as in the page: see `TrialPlan.as_json`."""

    digest: Annotated[str, Field(pattern="^[0-9a-f]{16}$")]
    labels: list[str]
    trials: dict[Question, dict[str, list[list[int]]]]


class Act(NamedTuple):
    """An answer to a trial, from 0 on; None where that answer is taken back."""

    person: str
    question: Question
    number: Annotated[int, Field(ge=0, lt=1 << 20)]
    trial: Annotated[int, Field(ge=0)]
    answer: int | float | list[int] | None


class Request(BaseModel):
    """What the page posts: acts, or the begin of the next group."""

    digest: str
    group: str
    acts: list[Act] = []
    begin: bool = False


class Group:
    """Answers of a group of people, on disk.

    Args:
        folder: of the plan.
        plan: as in the page.

    Attributes:
        name: of the group; names ascend.
        acts: by person, question and number.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.plan, self._within = plan, folder
        self.acts: dict[tuple[Any, ...], Act] = {}
        groups = folder.glob(f"answers-*-{plan.digest[:8]}")
        self.name = max((group.name.split("-")[1] for group in groups), default="")
        if not self.name:
            self.begin()
        elif (self.folder / ACTS).is_file():
            for line in read_limited(self.folder / ACTS, LARGEST_FILE).splitlines():
                # A line that a full disk cut off was never confirmed to the page, which sends the act again.
                with suppress(ValueError):
                    act = TypeAdapter(Act).validate_json(line)
                    self.acts[act[:3]] = self.checked(act)
            self._write_tables()

    @property
    def folder(self) -> Path:
        """The folder of the group."""
        return self._within / f"answers-{self.name}-{self.plan.digest[:8]}"

    def begin(self) -> None:
        """Begin with a new group, whose name follows that of the last one even if the clock was set back."""
        self.name = max(time.strftime("%Y%m%dT%H%M%S"), f"{self.name}0")
        self.acts = {}
        self.folder.mkdir()

    def add(self, acts: list[Act]) -> bool:
        """Write checked acts to disk; False, and none is written, if one has the number of another act.

        Raises:
            OSError: the disk is full, or the folder is gone.
        """
        if any(self.acts.get(act[:3], act) != act for act in acts):
            return False
        with (self.folder / ACTS).open("ab") as journal:
            # Each line begins anew, behind whatever a full disk has left of the last one.
            journal.write("".join(f"\n{json.dumps(act)}" for act in acts).encode())
            journal.flush()
            os.fsync(journal.fileno())
        self.acts |= {act[:3]: act for act in acts}
        self._write_tables({act.question for act in acts})
        return True

    def checked(self, act: Act) -> Act:
        """The act. Raises InputError if the plan has no such trial, or the act is no answer to the trial."""
        try:
            self._rows(act)
        except (LookupError, TypeError, ValueError):
            raise InputError(f"{act.question}: this is no answer to a trial of the plan") from None
        return act

    def _rows(self, act: Act) -> Rows:
        """Rows of the table. Raises LookupError, TypeError or ValueError for what is no answer."""
        answer: Any = act.answer
        places = self.plan.trials[act.question][act.person][act.trial]
        begin, labels = [act.person, act.trial + 1], [self.plan.labels[place] for place in places]
        if answer is None:
            return []
        if act.question == SORTS:
            if sorted(answer) != sorted(places):
                raise ValueError
            name = f"{TRIAL} {act.trial + 1}"
            return [[*begin, name, k, self.plan.labels[place]] for k, place in enumerate(answer, start=1)]
        if act.question == MAGNITUDES:
            if not 0 < answer < LARGEST_MAGNITUDE:
                raise ValueError
            return [[*begin, *labels, answer]]
        return [[*begin, *labels, ((YES, NO) if act.question == SAME else labels)[(0, 1).index(answer)]]]

    def _write_tables(self, questions: set[Question] | None = None) -> None:
        """Write the tables of these questions; by default, of all that anybody has answered."""
        for question in questions or {act.question for act in self.acts.values()}:
            standing: dict[tuple[str, int], Rows] = {}
            for act in sorted(act for act in self.acts.values() if act.question == question):
                if act.answer is None:
                    standing.pop((act.person, act.trial), None)
                else:
                    standing.setdefault((act.person, act.trial), self._rows(act))
            person, *others = HEADINGS[question]
            rows = [[person, TRIAL, *others], *(row for _, each in sorted(standing.items()) for row in each)]
            write_atomically(self.folder / f"answers-{question}.csv", csv_bytes(rows))


class _Server(ThreadingHTTPServer):
    """The server of a group's page."""

    def __init__(self, group: Group, page: bytes, port: int) -> None:
        super().__init__((HOST, port), _Handler)
        self.group, self.page, self.lock = group, page, Lock()
        self.query = f"token={secrets.token_urlsafe(24)}"
        self.hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}

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
        self._answer(*(self._refused() or self._found()))

    def do_POST(self) -> None:
        """Acts of the page, or the begin of the next group."""
        self._answer(*(self._refused() or self._done()))

    def _refused(self) -> tuple[int, str] | None:
        """Status and sentence where a request may not pass."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0].lower() not in self.server.hosts:
            return 403, "The host of this request is not this server."
        # A browser names the origin of every request that may change something.
        if origins != [f"http://{hosts[0]}"] and (origins or self.command != "GET"):
            return 403, "This request comes from another page."
        path, _, query = self.path.partition("?")
        # Compared as bytes: `compare_digest` takes ASCII texts only.
        if not secrets.compare_digest(query.encode(), self.server.query.encode()):
            return 403, "The token is missing or old: open the address that retouch answers --serve printed."
        return None if path in ("/", "/acts") else (404, "There is no such page.")

    def _found(self) -> tuple[int, str, str]:
        group = self.server.group
        if self.path.startswith("/?"):
            return 200, self.server.page.decode(), "text/html"
        with self.server.lock:
            content = {"digest": group.plan.digest, "group": group.name, "folder": str(group.folder)}
            return 200, json.dumps(content | {"acts": list(group.acts.values())}), "application/json"

    def _done(self) -> tuple[int, str]:
        """Do what a request asks for; acts that are no answers are left out."""
        group, length, wrong = self.server.group, self.headers.get("Content-Length", ""), ""
        if not (length.isdecimal() and len(length) < 8 and int(length) <= LARGEST_BODY):
            return 413, "The request is too long."
        try:
            request = Request.model_validate_json(self.rfile.read(int(length)), strict=True)
        except ValidationError:
            return 400, "This is no request of the page."
        fitting = []
        for act in request.acts:
            try:
                fitting.append(group.checked(act))
            except InputError as error:
                wrong = str(error)
        with self.server.lock:
            try:
                if (request.digest, request.group) != (group.plan.digest, group.name):
                    return 409, "Another group has begun."
                if request.begin:
                    group.begin()
                elif not group.add(fitting):
                    return 409, "Another window has gone on."
            except OSError as error:
                return 507, str(error.strerror)
        return (400, wrong) if wrong else (200, "")

    def _answer(self, status: int, text: str, kind: str = "text/plain") -> None:
        content = text.encode()
        self.send_response(status)
        own = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(content))}
        for name, value in (own | HEADERS).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)


def serve(folder: Path) -> None:
    """Serve the page of a set's experiment until Ctrl-C, and print its address.

    Raises:
        InputError: the folder holds no such page, or another command writes into it.
        KeyboardInterrupt: at the end; every answer that was confirmed is on disk.
    """
    file = folder / FOLDER / PAGE
    page = read_limited(file, LARGEST_FILE)
    try:
        plan = Plan.model_validate_json(page.partition(PLAN_BEGINS)[2].partition(PLAN_ENDS)[0])
    except ValidationError:
        advice = f"retouch stimuli --redraw -o {folder} writes it anew"
        raise InputError(f"{file}: is no page of an experiment; {advice}") from None
    with only_writer(folder):
        group = Group(folder / FOLDER, plan)
        with _bound(group, page) as server:
            print(f"answers are written into {group.folder}")
            address = f"http://{HOST}:{server.server_port}/?{server.query}"
            print(f"The experiment is at {address} (Ctrl-C ends it)", flush=True)
            server.serve_forever()


def _bound(group: Group, page: bytes) -> _Server:
    """The server, at the first port that is free. Raises OSError."""
    for port in PORTS[:-1]:
        with suppress(OSError):
            return _Server(group, page, port)
    return _Server(group, page, PORTS[-1])
