"""The server of the app: bound to this machine, behind its guard, until Ctrl-C."""

import asyncio
import contextlib
import logging
import signal
import socket
import sys
import webbrowser
from collections.abc import Iterator
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import ui

from optimize.run_directory.earlier import resume_advice
from relief.ground.errors import option_error
from retouch.app.guard import Guard, new_token
from retouch.app.page import AppPage
from retouch.app.routes import add_routes
from retouch.app.state.addresses import Addresses
from retouch.app.state.runs import Queue, State
from retouch.app.state.session import FIRST_TEXTURE, Session

HOST = "127.0.0.1"
PATIENCE_S = 60.0
"""Longest wait, when the app is closed, for a run to write its best relief, s. It goes on by itself then."""
LOOK_S = 0.5
"""Time between two looks at the runs, s."""
RECONNECT_S = 30.0
"""How long a window that was cut off finds its page as it was, s; later, it loads the page again."""


def serve(session: Session, picture: str | None, port: int, browser: bool) -> None:
    """Serve the page until Ctrl-C.

    Args:
        session: that the page shows.
        picture: file, or name of a bundled texture, to begin with; None: what was chosen last.
        port: 0 for any that is free.
        browser: whether to open the page in the person's browser.

    Raises:
        InputError: the port cannot be had.
    """
    with bound(port) as listening:
        port, token = listening.getsockname()[1], new_token()
        application = _application(session, Addresses())
        config = uvicorn.Config(
            Guard(application, port, token),
            log_level="error",
            timeout_graceful_shutdown=1,
            server_header=False,
            ws_max_size=1 << 20,
        )
        address = f"http://{HOST}:{port}/?token={token}"
        print(f"Retouch is at {address} (Ctrl-C closes it)", flush=True)
        asyncio.run(_serving(_Server(config), listening, session, picture, address if browser else None))


@contextlib.contextmanager
def bound(port: int) -> Iterator[socket.socket]:
    """A socket of this machine alone. Raises InputError."""
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
            # Before the address is printed, at which somebody may ask at once.
            listening.listen()
        except OSError as error:
            raise option_error("port", f"{port}: {error.strerror}") from error
        yield listening


def _application(session: Session, addresses: Addresses) -> FastAPI:
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    add_routes(application, addresses)

    @ui.page("/")
    def index() -> None:
        AppPage(session, addresses).build()

    ui.run_with(
        application,
        title="Retouch",
        favicon=Path(__file__).parent / "style" / "favicon.svg",
        dark=None,
        show_welcome_message=False,
        reconnect_timeout=RECONNECT_S,
        tailwind=False,
    )
    return application


class _Server(uvicorn.Server):
    """A server that leaves signals to the app."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


async def _serving(
    server: _Server, listening: socket.socket, session: Session, picture: str | None, address: str | None
) -> None:
    loop = asyncio.get_running_loop()

    def close() -> None:
        server.should_exit = True

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, close)
    looking = asyncio.ensure_future(_look_after(session))
    if picture is not None or session.document.picture is None:
        session.activity.in_background(session.choose(picture or FIRST_TEXTURE))
    else:
        session.numbers.follow()
    if address is not None:
        session.activity.in_background(asyncio.to_thread(webbrowser.open, address))
    try:
        await server.serve(sockets=[listening])
    finally:
        looking.cancel()
        session.close()
        _stop_runs(session.running.queue)


async def _look_after(session: Session) -> None:
    """Start the runs of the queue one after another, and notify the windows how far they are."""
    while True:
        await asyncio.sleep(LOOK_S)
        try:
            session.look()
        except Exception:
            # A fault here must not end the looking: the queue would stand still in silence.
            logging.getLogger(__name__).exception("the queue could not be looked after")


def _stop_runs(queue: Queue) -> None:
    """Ask the runs under way to stop, and say how they go on."""
    if not any(job.started_here for job in queue.jobs):
        return
    print("the run under way is asked to stop; its best relief is being written", file=sys.stderr)
    for job in queue.stop_all(PATIENCE_S):
        advice = resume_advice(job.folder) if job.state in (State.STOPPED, State.SHORT) else ""
        print("; ".join(filter(None, (f"{job.folder}: {job.state.value}", advice))), file=sys.stderr)
