"""Who may speak to the app's server: the page that it served itself, and nobody else."""

import asyncio
from collections.abc import MutableMapping
from typing import Any

import pytest

from retouch.app.guard import Guard

PORT, TOKEN = 8642, "a-token-of-this-start"
HOST = f"127.0.0.1:{PORT}"
OWN = {"host": HOST, "origin": f"http://{HOST}", "cookie": f"retouch-{PORT}={TOKEN}"}
"""Headers of a request of the app's own page."""


class Answered:
    """What came of a request: whether the application saw it, and the messages that were sent."""

    def __init__(self) -> None:
        self.passed = False
        self.sent: list[MutableMapping[str, Any]] = []

    @property
    def status(self) -> int | None:
        return next((one["status"] for one in self.sent if "status" in one), None)

    def header(self, name: str) -> str | None:
        headers = dict(self.sent[0].get("headers", ()))
        value = headers.get(name.encode())
        return None if value is None else value.decode()


def ask(
    headers: dict[str, str], *, kind: str = "http", method: str = "GET", path: str = "/", query: str = ""
) -> Answered:
    answered = Answered()

    async def application(scope: Any, receive: Any, send: Any) -> None:
        answered.passed = True
        if kind == "http":
            await send({"type": "http.response.start", "status": 200, "headers": []})

    async def receive() -> MutableMapping[str, Any]:
        return {"type": "websocket.connect"}

    async def send(message: MutableMapping[str, Any]) -> None:
        answered.sent.append(message)

    scope: dict[str, Any] = {"type": kind, "path": path, "query_string": query.encode()}
    scope["headers"] = [(name.encode(), value.encode("latin-1")) for name, value in headers.items()]
    if kind == "http":
        scope["method"] = method
    asyncio.run(Guard(application, PORT, TOKEN)(scope, receive, send))
    return answered


def without(name: str) -> dict[str, str]:
    return {key: value for key, value in OWN.items() if key != name}


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_the_own_page_passes(kind: str) -> None:
    assert ask(OWN, kind=kind).passed
    assert ask(OWN | {"host": f"localhost:{PORT}", "origin": f"http://localhost:{PORT}"}, kind=kind).passed


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "change",
    [
        {"host": f"evil.example:{PORT}"},  # a name of another site that has been pointed here
        {"host": "127.0.0.1:9999"},
        {"host": f"127.0.0.1.evil.example:{PORT}"},
        {"origin": "https://evil.example"},
        {"origin": "http://127.0.0.1:9999"},
        {"origin": f"https://{HOST}"},
        {"origin": "null"},
        {"cookie": f"retouch-{PORT}=guessed"},
        {"cookie": f"retouch-9999={TOKEN}"},
        {"cookie": f"retouch-{PORT}=\xe9"},
        {"cookie": ""},
    ],
)
def test_another_page_does_not(kind: str, change: dict[str, str]) -> None:
    answered = ask(OWN | change, kind=kind)
    assert not answered.passed
    assert answered.status == 403 if kind == "http" else answered.sent[0]["code"] == 1008


@pytest.mark.parametrize("name", ["host", "cookie"])
def test_what_a_request_has_to_show_may_not_be_left_out(name: str) -> None:
    assert not ask(without(name)).passed


@pytest.mark.parametrize("kind", [{"kind": "websocket"}, {"method": "POST"}, {"method": "PUT"}])
def test_what_can_change_something_states_its_origin(kind: dict[str, str]) -> None:
    assert not ask(without("origin"), **kind).passed
    assert ask(without("origin")).passed


def test_the_token_of_the_address_becomes_a_cookie_and_leaves_the_address() -> None:
    answered = ask({"host": HOST}, query=f"token={TOKEN}&stage=run")
    assert answered.status == 303 and not answered.passed
    assert answered.header("location") == "/?stage=run"
    cookie = answered.header("set-cookie") or ""
    assert cookie.startswith(f"retouch-{PORT}={TOKEN};")
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie


@pytest.mark.parametrize("other", ['other={"a":1}', "other=a b", "[x]=1", "=", ";;"])
def test_cookies_of_other_servers_are_in_nobodys_way(other: str) -> None:
    cookie = OWN["cookie"]
    assert ask(OWN | {"cookie": f"{other}; {cookie}"}).passed
    assert ask(OWN | {"cookie": f"{cookie};{other}"}).passed


def test_a_token_in_any_other_address_counts_for_nothing() -> None:
    assert ask({"host": HOST}, query="token=guessed").status == 403
    assert ask({"host": HOST}, path="/app/relief/1", query=f"token={TOKEN}").status == 403
    posted = ask({"host": HOST, "origin": OWN["origin"]}, query=f"token={TOKEN}", method="POST")
    assert posted.status == 403


def test_every_answer_keeps_the_page_to_this_machine() -> None:
    for answered in (ask(OWN), ask({})):
        policy = answered.header("content-security-policy") or ""
        assert "default-src 'self'" in policy and "frame-ancestors 'none'" in policy
        assert "http:" not in policy and "*" not in policy
