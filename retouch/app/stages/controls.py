"""Parts that several stages share: sections, figures, fields and tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from nicegui import events, ui


@contextmanager
def section(title: str) -> Iterator[None]:
    """A part of the side with a heading."""
    with ui.element("section").classes("section"):
        heading(title)
        yield


def heading(title: str) -> None:
    """A heading of a part of the side."""
    with ui.element("h2"):
        ui.label(title)


def button(text: str, action: Callable[..., Any], kind: str = "") -> ui.button:
    """A button.

    Args:
        text: of the button.
        action: of a press.
        kind: "primary" for the next step, "quiet" for what stands back, "wide" for the whole width.
    """
    # Without a colour, which Quasar would put before that of the style sheet.
    return ui.button(text, on_click=action, color=None).classes(f"button {kind}").props("flat no-caps")


def choice(options: Any, **settings: Any) -> ui.toggle:
    """One of a few, side by side."""
    toggle = ui.toggle(options, **settings).classes("choice")
    return toggle.props("unelevated no-caps toggle-color=chosen toggle-text-color=chosen")


class Number:
    """A large figure with its unit and what it is."""

    def __init__(self, what: str, unit: str = "") -> None:
        with ui.element("div").classes("number") as self._whole:
            with ui.element("div"):
                self._value = ui.label("–").classes("value").style("display: inline")
                ui.label(unit).classes("unit").style("display: inline; margin-left: 0.3em")
            ui.label(what).classes("what")

    def show(self, value: str | None, stale: bool = False) -> None:
        """Show a value, grey while a newer one is being computed."""
        self._value.set_text("–" if value is None else value)
        self._whole.classes(add="stale" if stale else "", remove="" if stale else "stale")


class NumberField:
    """A field for a number within bounds; tells a value once it is one."""

    def __init__(self, label: str, low: float, high: float, tell: Callable[[float], None]) -> None:
        self._low, self._high, self._tell = low, high, tell
        self._known: float | None = None
        self._field = ui.number(label, min=low, max=high, format="%.6g", on_change=self._changed)
        self._field.props("outlined dense debounce=300")

    def show(self, value: float | None) -> None:
        """Show a value."""
        if value != self._known:
            self._known = value
            self._field.set_value(value)

    def _changed(self, event: events.ValueChangeEventArguments) -> None:
        value = event.value
        if value is None or not self._low <= float(value) <= self._high or float(value) == self._known:
            return
        self._known = float(value)
        self._tell(float(value))


class Told:
    """A table of lines, each a word and a sentence.

    Attributes:
        element: the table.
    """

    def __init__(self) -> None:
        self._lines: tuple[tuple[str, str], ...] | None = None
        with ui.element("table").classes("told") as self.element:
            self._body = ui.element("tbody")

    def show(self, lines: Iterable[tuple[str, str]]) -> None:
        """Show lines; those of the word "warning" stand out."""
        now = tuple(lines)
        if now == self._lines:
            return
        self._lines = now
        self._body.clear()
        with self._body:
            for word, sentence in now:
                with ui.element("tr").classes("warning" if word == "warning" else ""):
                    with ui.element("th").props("scope=row"):
                        ui.label(word)
                    with ui.element("td"):
                        ui.label(sentence)
