"""The app, and a window of it in headless Chromium: what a person does, by mouse and keys."""

import base64
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Self

from benchmarks.shared.browser import COMPLAINTS, PATIENCE_S, Browser
from benchmarks.shared.common import ROOT

KEYS = {
    "Tab": 9,
    "Enter": 13,
    "Escape": 27,
    "Space": 32,
    "End": 35,
    "Home": 36,
    "ArrowLeft": 37,
    "ArrowUp": 38,
    "ArrowRight": 39,
    "ArrowDown": 40,
}
"""Virtual codes of the keys that are no letters."""
TEXTS = {"Enter": "\r", "Space": " "}
SHOWN = "document.querySelector('.relief-stage')?.dataset.shown"
"""Script: whether a relief is lit."""
FELT = "!document.querySelector('.number.stale')"
"""Script: whether the numbers of the picture are those of what is shown, all over."""
COMMAND = "document.querySelector('.command').innerText"
"""Script: the line that does the same in a terminal."""


class App:
    """The app in a folder of its own; `address` is the one that it prints.

    Args:
        folder: where the app is started.
        words: further arguments of `retouch app`.
    """

    def __init__(self, folder: Path, *words: str) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "retouch", "app", "--port", "0", "--no-browser", *words]
        paths = f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
        self.process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": paths}
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line)
        if found is None:
            self.close()
            raise RuntimeError(f"the app printed no address: {line!r}")
        self.address = found[0]

    def close(self) -> int:
        """Close the app as Ctrl-C does; returns its exit status."""
        assert self.process.stdout is not None
        self.process.send_signal(signal.SIGINT)
        with self.process.stdout:
            return self.process.wait(PATIENCE_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.close()


class Window(Browser):
    """A window on an address of this machine."""

    def visit(self, address: str, width: int = 1280, height: int = 800) -> None:
        """Open an address in a window of this size."""
        self.size(width, height)
        # The page before is left first: it may complain that its app is closed.
        for page in ("about:blank", address):
            self._events.clear()
            self._call("Page.navigate", url=page)
            self._until("Page.loadEventFired")

    def size(self, width: int, height: int) -> None:
        """Give the window another size, CSS pixels."""
        screen = {"deviceScaleFactor": 1, "mobile": False}
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, **screen)

    def wait(self, condition: str, seconds: float = PATIENCE_S) -> float:
        """Wait until an expression is true; returns how long that took, s."""
        begun = time.monotonic()
        while not self.evaluate(f"Boolean({condition})"):
            if time.monotonic() - begun > seconds:
                text = self.evaluate("document.body.innerText.slice(0, 2000)")
                raise AssertionError(f"not within {seconds:g} s: {condition}\n{text}\n{self.complaints()}")
            time.sleep(0.05)
        return time.monotonic() - begun

    def place(self, selector: str) -> tuple[float, float, float, float]:
        """Left, top, width and height of an element, scrolled into view."""
        box = self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'nearest'}); const b = e.getBoundingClientRect();"
            "return [b.left, b.top, b.width, b.height] })()"
        )
        return (box[0], box[1], box[2], box[3])

    def click(self, selector: str) -> None:
        """Click the middle of an element."""
        left, top, width, height = self.place(selector)
        self.drag([(left + width / 2, top + height / 2)])

    def click_text(self, tag: str, text: str) -> None:
        """Click the element of a tag with this text."""
        found = (
            f"[...document.querySelectorAll('{tag}')].find((e) => e.innerText.trim() === {json.dumps(text)})"
        )
        self.wait(found)
        self.evaluate(f"{found}.setAttribute('data-clicked-by-test', '')")
        self.click("[data-clicked-by-test]")
        self.evaluate(
            "document.querySelector('[data-clicked-by-test]')?.removeAttribute('data-clicked-by-test')"
        )

    def drag(self, points: list[tuple[float, float]]) -> None:
        """Press the mouse at the first point, move over the others, and let go at the last."""
        button = {"button": "left", "clickCount": 1}
        kinds = ["mouseMoved", "mousePressed", *["mouseMoved"] * (len(points) - 1), "mouseReleased"]
        for kind, (x, y) in zip(kinds, [points[0], *points, points[-1]], strict=True):
            held = {} if kind == "mouseMoved" and points.index((x, y)) == 0 else button
            self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=1 if held else 0, **held)

    def key(self, name: str, *, shift: bool = False, control: bool = False) -> None:
        """Press a key."""
        code: dict[str, Any] = {"key": " " if name == "Space" else name, "code": name}
        code |= {"windowsVirtualKeyCode": KEYS.get(name, ord(name[0].upper()))}
        modifiers = 8 * shift + 2 * control
        text = {"text": TEXTS[name]} if name in TEXTS else {}
        self._call("Input.dispatchKeyEvent", type="keyDown", modifiers=modifiers, **code, **text)
        self._call("Input.dispatchKeyEvent", type="keyUp", modifiers=modifiers, **code)

    def write(self, text: str) -> None:
        """Type a text into what has the focus."""
        self._call("Input.insertText", text=text)

    def choose_file(self, selector: str, file: Path) -> None:
        """Choose a file for an input element."""
        root = self._call("DOM.getDocument")["root"]["nodeId"]
        node = self._call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self._call("DOM.setFileInputFiles", nodeId=node, files=[str(file.resolve())])

    def shot(self, file: Path) -> None:
        """Write a picture of what the window shows."""
        answer = self._call("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(answer["data"]))

    def asked(self) -> list[str]:
        """Addresses that were asked for since the visit, also by scripts and websockets."""
        self.evaluate("1")
        addresses = []
        for event in self._events:
            parameters = event["params"]
            if event["method"] == "Network.requestWillBeSent":
                addresses.append(parameters["request"]["url"])
            elif event["method"] == "Network.webSocketCreated":
                addresses.append(parameters["url"])
        return addresses

    def faults(self) -> list[str]:
        """Messages on the console since the visit."""
        self.evaluate("1")
        return [json.dumps(e["params"])[:400] for e in self._events if e["method"] in COMPLAINTS]
