"""Chromium without a window, driven through a pipe: what a page asks for, complains of, and looks like.

Nothing but the browser itself is needed. It reads the messages of its DevTools protocol from file descriptor
3 and writes its own to 4 (`--remote-debugging-pipe`), each a line of JSON that ends with a zero byte.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
"""Names of the program, the usual one first."""
FLAGS = (
    *("--headless=new", "--remote-debugging-pipe", "--no-first-run", "--no-default-browser-check"),
    *("--disable-dev-shm-usage", "--disable-background-networking", "--hide-scrollbars"),
    *("--disable-component-update", "--disable-sync", "--disable-extensions", "--force-color-profile=srgb"),
)
SOFTWARE_WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Flags of Chromium by which the CPU draws what pages ask of a graphics card."""
PATIENCE_S = 300.0
"""Longest wait for an answer of the browser or of the app, s; far beyond that of a busy machine."""
ENDING_S = 10.0
"""Longest wait for the browser to end by itself, s; it takes 0.15."""
COMPLAINTS = ("Log.entryAdded", "Runtime.exceptionThrown", "Runtime.consoleAPICalled")
"""Events that the console of the browser would show."""


def chromium() -> str | None:
    """The browser's program; None if there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def _moved(end: int) -> int:
    """The end of a pipe under a number beyond those that a child expects."""
    moved = fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(end)
    return moved


@dataclass
class Page:
    """What was seen of a page.

    Attributes:
        asked: addresses that the page asked for, less its own and `data:`.
        complaints: messages on the console.
    """

    asked: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


class Browser:
    """A browser with one page; a context manager that ends the process.

    Args:
        webgl: whether pages may draw in three dimensions, on the CPU.

    Raises:
        RuntimeError: there is no such program, or the browser gives no answer.
    """

    def __init__(self, *, webgl: bool = False) -> None:
        program = chromium()
        if program is None:
            raise RuntimeError(f"no browser: none of {', '.join(NAMES)} is on the path")
        self._profile = tempfile.mkdtemp(prefix="retouch-browser-")
        # Beyond 4, so that no end of a pipe is where the browser looks for the other.
        (theirs_read, self._write), (self._read, theirs_write) = (map(_moved, os.pipe()) for _ in range(2))
        root = ["--no-sandbox"] if os.geteuid() == 0 else []
        drawing = SOFTWARE_WEBGL if webgl else ("--disable-gpu", "--disable-3d-apis")
        self._process = os.posix_spawn(
            program,
            [program, *FLAGS, *drawing, *root, f"--user-data-dir={self._profile}", "about:blank"],
            os.environ,
            file_actions=[
                (os.POSIX_SPAWN_DUP2, theirs_read, 3),
                (os.POSIX_SPAWN_DUP2, theirs_write, 4),
                *((os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_WRONLY, 0) for stream in (1, 2)),
            ],
        )
        os.close(theirs_read)
        os.close(theirs_write)
        self._buffer, self._last, self._events = b"", 0, list[dict[str, Any]]()
        self._session: str | None = None
        try:
            self._open_window()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the browser, and remove its files."""
        os.close(self._write)
        os.close(self._read)
        # A browser whose pipes are closed ends by itself, and removes its folder in the one for temporary
        # files. One that hangs is killed.
        end = time.monotonic() + ENDING_S
        while not os.waitid(os.P_PID, self._process, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            if time.monotonic() > end:
                os.kill(self._process, signal.SIGKILL)
            time.sleep(0.01)
        os.waitpid(self._process, 0)
        shutil.rmtree(self._profile, ignore_errors=True)

    @contextlib.contextmanager
    def another(self) -> Iterator[Self]:
        """Another window of the same browser, in place of this one until the block ends."""
        session, self._session = self._session, None
        target = self._open_window()
        yield self
        self._session = None
        self._call("Target.closeTarget", targetId=target)
        self._session = session

    def _open_window(self) -> str:
        """Open a window, which calls are for from now on; its name."""
        target: str = self._call("Target.createTarget", url="about:blank", newWindow=True)["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Network", "Log", "Runtime"):
            self._call(f"{domain}.enable")
        return target

    def dialogs(self) -> list[str]:
        """Kinds of the dialogs of the page since it was opened; each is accepted."""
        opened = "Page.javascriptDialogOpening"
        return [event["params"]["type"] for event in self._events if event["method"] == opened]

    def open(self, page: Path | str, width: int, *, dark: bool = False) -> Page:
        """Load a page, a file or an address, in a window of this width in CSS pixels; wait for all of it.

        A page whose script has a promise `ready` is waited for until then.
        """
        phone = width < 600
        self._call(
            "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=phone
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._call("Emulation.setEmulatedMedia", features=[scheme])
        self._events.clear()
        address = page if isinstance(page, str) else page.resolve().as_uri()
        self._call("Page.navigate", url=address)
        self._until("Page.loadEventFired")
        self.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 50)))")
        self.evaluate("typeof ready === 'undefined' || ready")
        seen = Page()
        for event in self._events:
            parameters = event["params"]
            if event["method"] == "Network.requestWillBeSent":
                asked = parameters["request"]["url"]
                if asked != address and not asked.startswith("data:"):
                    seen.asked.append(asked)
        seen.complaints = self.complaints()
        return seen

    def complaints(self) -> list[str]:
        """Messages on the console since the page was opened, as far as answers have been read."""
        return [json.dumps(event["params"])[:300] for event in self._events if event["method"] in COMPLAINTS]

    def evaluate(self, script: str) -> Any:
        """The value of a script's last expression, of JSON types; a promise is waited for."""
        answer = self._call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:500])
        return answer["result"].get("value")

    def picture(self, file: Path, clip: tuple[float, float, float, float] | None = None) -> None:
        """Write a PNG of the whole page, or of x, y, width and height of it in CSS pixels."""
        settings: dict[str, Any] = {"format": "png", "captureBeyondViewport": True}
        if clip is not None:
            settings["clip"] = dict(zip(("x", "y", "width", "height"), clip, strict=True)) | {"scale": 1}
        file.write_bytes(base64.b64decode(self._call("Page.captureScreenshot", **settings)["data"]))

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._last += 1
        message: dict[str, Any] = {"id": self._last, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._last:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                result: dict[str, Any] = answer["result"]
                return result

    def _until(self, method: str) -> None:
        while not any(event["method"] == method for event in self._events):
            self._next()

    def _next(self) -> dict[str, Any]:
        """The next message; an event is kept as well."""
        end = time.monotonic() + PATIENCE_S
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], max(0.0, end - time.monotonic()))
            more = os.read(self._read, 1 << 16) if ready else b""
            if not more:
                raise RuntimeError("the browser gives no answer")
            self._buffer += more
        text, _, self._buffer = self._buffer.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        if "method" in message:
            self._events.append(message)
        if message.get("method") == "Page.javascriptDialogOpening":
            # The answer to the answer is passed over, as nobody waits for it.
            accepting = {"id": 0, "method": "Page.handleJavaScriptDialog", "params": {"accept": True}}
            os.write(
                self._write, json.dumps(accepting | {"sessionId": message["sessionId"]}).encode() + b"\0"
            )
        return message
