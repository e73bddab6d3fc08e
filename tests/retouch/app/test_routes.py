"""Routes beside the page: heights go out, pictures come in, and no address leads to another file."""

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="without the extra app")

import httpx
from fastapi import FastAPI

from relief.relief import Relief
from retouch.app import routes
from retouch.app.state.addresses import KEPT, Addresses


class Client:
    """Sends requests to the routes without a server between."""

    def __init__(self, app: FastAPI) -> None:
        self.app = app
        self._transport = httpx.ASGITransport(app)

    def get(self, address: str) -> httpx.Response:
        return asyncio.run(self._ask("GET", address))

    def post(self, address: str, content: Any, headers: dict[str, str]) -> httpx.Response:
        return asyncio.run(self._ask("POST", address, content=content, headers=headers))

    async def _ask(self, method: str, address: str, **settings: Any) -> httpx.Response:
        async with httpx.AsyncClient(transport=self._transport, base_url="http://app") as client:
            return await client.request(method, address, **settings)


@pytest.fixture
def addresses() -> Addresses:
    return Addresses()


@pytest.fixture
def client(addresses: Addresses, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Client:
    monkeypatch.chdir(tmp_path)
    Path("runs/stone-1").mkdir(parents=True)
    app = FastAPI()
    routes.add_routes(app, addresses)
    return Client(app)


def test_heights_are_those_that_were_given(client: Client, addresses: Addresses) -> None:
    heights = np.random.default_rng(0).random((3, 4))
    relief = Relief(heights, 7.0, (True, False))
    address = addresses.address(relief)
    assert addresses.address(relief) == address  # the same heights, the same address
    answer = client.get(address)
    form = json.loads(answer.headers["x-form"])
    assert form == {"rows": 3, "cols": 4, "size_mm": 7.0, "repeats": [True, False]}
    assert np.array_equal(np.frombuffer(answer.content, "<f4").reshape(3, 4), heights.astype("<f4"))
    for _ in range(KEPT):
        addresses.address(Relief(heights))
    assert client.get(address).status_code == 404


def sent(client: Client, content: bytes, name: str, path: str = "/app/picture") -> tuple[int, str]:
    answer = client.post(path, content=content, headers={"x-name": name})
    return answer.status_code, answer.text


def test_a_dropped_file_is_kept_under_a_harmless_name(client: Client) -> None:
    status, told = sent(client, b"content", "..%2F..%2F%3Cb%3Estone%3C%2Fb%3E.png")
    assert status == 200
    file = Path(json.loads(told)["file"])
    assert file.parent == Path("pictures") and file.read_bytes() == b"content"
    assert not set("<>/") & set(file.name)
    assert json.loads(sent(client, b"mesh", "part.stl", "/app/part")[1])["file"] == "parts/part.stl"


def left() -> list[Path]:
    return list(Path("pictures").glob("*")) if Path("pictures").exists() else []


def test_what_is_no_picture_is_refused_in_plain_text(client: Client) -> None:
    answer = client.post("/app/picture", content=b"x", headers={"x-name": "%3Cscript%3E.exe"})
    assert answer.status_code == 422 and answer.headers["content-type"].startswith("text/plain")
    assert left() == []


def test_too_large_a_file_leaves_nothing(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes, "MOST_UPLOADED", 1000)
    assert sent(client, b"x" * 1001, "stone.png")[0] == 422

    async def parts() -> AsyncIterator[bytes]:
        for _ in range(2):
            yield b"x" * 600

    assert client.post("/app/picture", content=parts(), headers={"x-name": "a.png"}).status_code == 422
    assert left() == []


def test_a_full_disk_is_told_and_leaves_nothing(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes, "free_mib", lambda folder: 1.0)
    status, told = sent(client, b"content", "stone.png")
    assert status == 507 and told == "stone.png: the disk is full; nothing is kept of it"
    assert left() == []


def test_a_cut_off_file_leaves_nothing_and_is_no_fault_of_the_app(client: Client) -> None:
    async def receive() -> Any:
        return next(messages)

    async def send(message: Any) -> None:
        sent.append(message)

    async def cut_off(path: str, name: bytes) -> None:
        scope = {"type": "http", "method": "POST", "path": path, "headers": [(b"x-name", name)]}
        await client.app(scope | {"query_string": b""}, receive, send)

    sent: list[Any] = []
    begun = {"type": "http.request", "body": b"half of it", "more_body": True}
    for path, name in (("/app/picture", b"stone.png"), ("/app/part", b"knob.stl")):
        messages = iter([begun, {"type": "http.disconnect"}])
        asyncio.run(cut_off(path, name))
    assert [message["status"] for message in sent if "status" in message] == [422, 422]
    assert left() == [] and list(Path("parts").iterdir()) == []


def test_no_address_leads_out_of_the_folders(client: Client) -> None:
    Path("secret.3mf").touch()
    Path("runs/app.json").touch()
    Path("runs/linked.3mf").symlink_to(Path("secret.3mf").resolve())
    Path("pictures").mkdir(exist_ok=True)
    Path("pictures/mask-x.html").touch()
    for address in (
        "/app/print/..%2Fsecret.3mf",
        "/app/print/app.json",
        "/app/print/linked.3mf",
        f"/app/print/{'x' * 300}.3mf",
        "/app/mask/mask-x.html",
        "/app/print/%2Fetc%2Fpasswd",
        "/app/report/..%2F..%2F/report.html",
        "/app/report/../report.html",
        "/app/mask/..%2Frun.toml",
        "/app/mask/stone.png",
        "/app/page/..%2Fx.html",
        "/app/textures/..%2F__init__.py",
        "/app/scripts/..%2Fpage.py",
    ):
        assert client.get(address).status_code == 404, address


def test_a_report_is_shown_as_the_page_of_a_stranger(client: Client) -> None:
    Path("runs/stone-1/report.html").write_text("<script>parent.location = '/'</script>")
    answer = client.get("/app/report/stone-1/report.html")
    assert answer.status_code == 200
    assert answer.headers["content-security-policy"].startswith("sandbox allow-scripts;")
