"""Routes beside the page: heights for its views, and pictures that come in."""

import errno
import json
import os
import re
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from fastapi import FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, Response
from fastapi.staticfiles import StaticFiles

from mitsuba_scenes import FOLDER
from optimize.run_directory.key import REPORT
from relief.ground.errors import InputError
from relief.ground.formats import FORMATS
from relief.ground.formatting import plain
from retouch.app.state.addresses import PREFIX, Addresses
from retouch.app.state.runs import free_mib
from retouch.app.values.folders import PARTS_FOLDER, PICTURES_FOLDER, RUNS_FOLDER, keep, safe_name
from retouch.pages import plate_viewer

MOST_UPLOADED = 1 << 30
"""Most bytes of a picture: more than 179 million pixels take in any format but numbers."""
MASK = re.compile(r"mask-[0-9a-f]{12}\.png")
"""Names of the files of masks."""
SANDBOX = "sandbox allow-scripts; default-src 'unsafe-inline' data: blob:"
"""Content-Security-Policy of a report, whose file anybody may have changed."""
FRAMED = "<style>header, footer { display: none } main > .wide { margin-top: 0 }</style>"
"""What a page about an object leaves out within the app."""
SPARE_MIB = 64.0
"""Room that a picture leaves on the disk, MiB: a run needs some."""


def add_routes(app: FastAPI, addresses: Addresses) -> None:
    """Add the routes to an application."""
    app.mount("/app/textures", StaticFiles(directory=FOLDER / "textures"))
    app.mount("/app/scripts", StaticFiles(directory=Path(plate_viewer.__file__).parent))
    app.mount("/app/style", StaticFiles(directory=Path(__file__).parent / "style"))

    @app.get(PREFIX + "/{key}")
    def heights(key: str) -> Response:
        relief = addresses.get(key)
        if relief is None:
            return PlainTextResponse("these heights are no longer kept", 404)
        rows, cols = relief.heights.shape
        form = {"rows": rows, "cols": cols, "size_mm": relief.width_mm, "repeats": list(relief.repeats)}
        headers = {"x-form": json.dumps(form), "cache-control": "no-store"}
        content = relief.heights.astype("<f4").tobytes()
        return Response(content, media_type="application/octet-stream", headers=headers)

    @app.get("/app/mask/{name}")
    def mask(name: str) -> Response:
        return _file(PICTURES_FOLDER / name, MASK.fullmatch(name) is not None, media_type="image/png")

    @app.get("/app/print/{name}")
    def plate(name: str) -> Response:
        return _file(RUNS_FOLDER / name, Path(name).suffix in FORMATS, filename=name)

    @app.get("/app/report/{run}/report.html")
    def report(run: str) -> Response:
        # A page that is not the app's own: its scripts may run, but as those of a stranger.
        headers = {"content-security-policy": SANDBOX}
        return _file(RUNS_FOLDER / run / REPORT, True, headers=headers)

    @app.get("/app/page/{name}")
    def page(name: str) -> Response:
        file = RUNS_FOLDER / name
        answer = _file(file, name.endswith(".html"), headers={"content-security-policy": SANDBOX})
        if answer.status_code != 200:
            return answer
        # Within the app, which says the rest, only the object is wanted.
        content = file.read_text(encoding="utf-8", errors="replace").replace("</head>", f"{FRAMED}</head>", 1)
        return HTMLResponse(content, headers={"content-security-policy": SANDBOX})

    @app.post("/app/picture")
    async def picture(request: Request) -> Response:
        return await _kept(request, PICTURES_FOLDER)

    @app.post("/app/part")
    async def part(request: Request) -> Response:
        return await _kept(request, PARTS_FOLDER)


async def _kept(request: Request, folder: Path) -> Response:
    """Keep what a request carries in a folder, and answer with the name of the file, or why not."""
    name = unquote(request.headers.get("x-name", ""))
    try:
        file = await _received(request, name, folder)
    except InputError as error:
        return PlainTextResponse(plain(str(error)), 422)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        text = "the disk is full" if full else str(error.strerror)
        return PlainTextResponse(plain(f"{name[:60]}: {text}; nothing is kept of it"), 507)
    return JSONResponse({"file": str(file)})


def _file(file: Path, allowed: bool, **settings: Any) -> Response:
    """A file of the app's folders; parts of its path come from an address, but never lead elsewhere."""
    plain_names = all(part not in ("", ".", "..") and "\\" not in part for part in file.parts)
    base = Path(file.parts[0]).resolve()
    try:
        there = allowed and plain_names and file.is_file() and file.resolve().is_relative_to(base)
    except (OSError, ValueError):
        there = False
    if not there:
        return PlainTextResponse("no such file", 404)
    return FileResponse(file, **settings)


async def _parts(request: Request) -> AsyncIterator[bytes]:
    """The parts of what a request carries. Raises InputError if it is cut off, which nobody hears."""
    more = True
    while more:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            raise InputError("cut off")
        yield message.get("body", b"")
        more = message.get("more_body", False)


async def _received(request: Request, name: str, folder: Path) -> Path:
    """Write what a request carries into a folder. Raises InputError or OSError."""
    safe_name(name, folder)
    size = request.headers.get("content-length", "0")
    expected = int(size) if size.isdecimal() and len(size) < 20 else 0
    if expected > MOST_UPLOADED:
        raise InputError(f"{name[:60]}: {expected / 2**20:.0f} MiB; at most {MOST_UPLOADED >> 20} are taken")
    folder.mkdir(exist_ok=True)
    if expected / 2**20 + SPARE_MIB > free_mib(folder):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    descriptor, partial = tempfile.mkstemp(dir=folder, prefix=".dropped-")
    try:
        received = 0
        with os.fdopen(descriptor, "wb") as file:
            async for part in _parts(request):
                received += len(part)
                if received > MOST_UPLOADED:
                    raise InputError(f"{name[:60]}: more than {MOST_UPLOADED >> 20} MiB")
                file.write(part)
        return keep(Path(partial), name, folder)
    finally:
        Path(partial).unlink(missing_ok=True)
