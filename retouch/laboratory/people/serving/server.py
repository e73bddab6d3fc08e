"""Serves the page of an experiment to this machine alone, and hands answers to `Group`, which writes them.

The server listens on the machine itself alone, but every page that the same browser shows can send requests
there. So, as in the app's guard, a request must name this server as its host, come from no other origin, and
show the token of this start.
"""

import json
import secrets
import sys
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic import BaseModel, ValidationError

from relief.ground.errors import InputError
from relief.ground.files import only_writer, read_limited
from retouch.laboratory.people.plan import FOLDER
from retouch.laboratory.people.serving.experiment_page import PAGE, PLAN_BEGINS, PLAN_ENDS
from retouch.laboratory.people.serving.group import LARGEST_FILE, Act, Group, Plan

HOST, PORTS = "127.0.0.1", (*range(8643, 8653), 0)
"""Address; the first free port, as a browser keeps its own copy of the answers by port; else (0) any."""
LARGEST_BODY = 1 << 17
"""Most bytes of a request: the page sends at most 200 acts of at most 26 plates."""
PATIENCE_S = 30.0
"""Longest wait for the rest of a request, s."""
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Headers of every answer; the page has a policy of its own besides."""


class Request(BaseModel):
    """What the page posts: acts, or the begin of the next group."""

    digest: str
    group: str
    acts: list[Act] = []
    begin: bool = False


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
        if b"connect-src" not in page:
            raise InputError  # Pages of former versions send nothing.
        plan = Plan.model_validate_json(page.partition(PLAN_BEGINS)[2].partition(PLAN_ENDS)[0])
    except ValueError:
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
