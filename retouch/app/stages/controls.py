"""Parts that several stages share: sections, figures, fields and tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import events, ui

from mitsuba_scenes.fingers import bundled_skins
from relief.ground.options import Declared
from relief.printers import PRINTERS
from retouch.app.values.findings import Written
from retouch.app.values.folders import textures

LONGEST_TEXT = 300
"""Most characters of the text of an option."""


@contextmanager
def section(title: str) -> Iterator[ui.element]:
    """A part of the side with a heading."""
    with ui.element("section").classes("section") as part:
        with ui.element("h2"):
            ui.label(title)
        yield part


@contextmanager
def details(title: str) -> Iterator[ui.element]:
    """A part that a press on its title opens."""
    with ui.element("details").classes("more") as part:
        with ui.element("summary"):
            ui.label(title)
        yield part


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


def select(label: str, options: Any, chosen: Callable[[Any], Any], value: Any = None) -> ui.select:
    """One of many, from a list; `chosen` is called with each that is no empty name."""

    def changed(event: events.ValueChangeEventArguments) -> None:
        if event.value not in (None, ""):
            chosen(event.value)

    field = ui.select(options, label=label, value=value, on_change=changed)
    return field.props("outlined dense options-dense")


def offer(field: ui.select, options: dict[str, str], value: str | None) -> None:
    """Give a list its options, the name of each by its value, and a value."""
    if dict(field.options) != options:
        field.set_options(options)
    field.set_value(value)


def finger_select(chosen: Callable[[str], Any]) -> ui.select:
    """The choice of a finger."""
    return select("Finger", list(bundled_skins()), chosen)


def printer_select(chosen: Callable[[str | None], Any]) -> OfferedField:
    """The choice of a printer."""
    return OfferedField("Printer", "no printer", PRINTERS, chosen)


def fault_label() -> ui.label:
    """A line about what is wrong."""
    return ui.label().classes("fault").props('role="alert"')


class Gallery:
    """The bundled textures as small pictures.

    Args:
        action: what a press does, for a screen reader, before the name of the texture.
        chosen: called with the name of a texture that is pressed.

    Attributes:
        names: of the textures.
    """

    def __init__(self, action: str, chosen: Callable[[str], Any]) -> None:
        self.names = textures()
        with ui.element("div").classes("gallery"):
            self._pictures = [self._picture(action, name, partial(chosen, name)) for name in self.names]

    @staticmethod
    def _picture(action: str, name: str, pressed: Callable[[], Any]) -> ui.element:
        picture = ui.element("button").props(f'type="button" title="{name}" aria-label="{action} {name}"')
        with picture.on("click", pressed):
            ui.element("img").props(f'src="/app/textures/{name}.png" alt="" width="44" height="44"')
        return picture

    def show(self, chosen: str) -> None:
        """Mark a texture as the chosen one."""
        for name, picture in zip(self.names, self._pictures, strict=True):
            picture.props(f'aria-pressed="{"true" if name == chosen else "false"}"')


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
    """A field for a number within bounds; calls `chosen` with each value that is one."""

    def __init__(self, label: str, ends: tuple[float, float], chosen: Callable[[float], None]) -> None:
        self._ends, self._chosen = ends, chosen
        self._shown: float | None = None
        self.field = ui.number(label, min=ends[0], max=ends[1], format="%.6g", on_change=self._changed)
        self.field.props("outlined dense debounce=300")

    def show(self, value: float | None) -> None:
        """Show a value."""
        if value != self._shown:
            self._shown = value
            self.field.set_value(value)

    def _changed(self, event: events.ValueChangeEventArguments) -> None:
        value = event.value
        if value is None or not self._ends[0] <= value <= self._ends[1] or value == self._shown:
            return
        self._shown = float(value)
        self._chosen(float(value))


class TextField:
    """A field for a text; calls `chosen` with each, and with None for an empty one."""

    def __init__(self, label: str, chosen: Callable[[str | None], None]) -> None:
        self._chosen = chosen
        self.field = ui.input(label, on_change=self._changed).props("outlined dense debounce=400")

    def show(self, value: str | None) -> None:
        """Show a text."""
        self.field.set_value(value or "")

    def _changed(self, event: events.ValueChangeEventArguments) -> None:
        self._chosen(str(event.value or "").strip()[:LONGEST_TEXT] or None)


class OfferedField:
    """A field for one of a few values, or none; calls `chosen` with the value, or None."""

    def __init__(
        self, label: str, nothing: str, offered: Iterable[str], chosen: Callable[[str | None], None]
    ) -> None:
        self._nothing, self._offered = nothing, [nothing, *offered]
        self.field = select(
            label, self._offered, lambda value: chosen(None if value == nothing else value), nothing
        )

    def show(self, value: str | None) -> None:
        """Show a value."""
        self.field.set_value(value if value in self._offered else self._nothing)


def option_field(one: Declared, chosen: Callable[[Any], None]) -> NumberField | TextField | OfferedField:
    """The field of an option; `chosen` is called with each value, and with None for none."""
    option = one.option
    field: NumberField | TextField | OfferedField
    if option.offered:
        field = OfferedField(option.label, option.default or "", option.offered, chosen)
    elif option.range is not None:
        field = NumberField(option.label, option.range, chosen)
    else:
        field = TextField(option.label, chosen)
    field.field.tooltip(f"{option.help[0].upper()}{option.help[1:]}.")
    return field


class LineTable:
    """A table of lines, each a word and a sentence.

    Attributes:
        element: the table.
    """

    def __init__(self) -> None:
        self._lines: tuple[tuple[str, str], ...] | None = None
        with ui.element("table").classes("lines") as self.element:
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


class WrittenFile:
    """What is known of a file that was written, and a link that saves a copy."""

    def __init__(self) -> None:
        self._table = LineTable()
        self._link = ui.link("Save a copy", "").classes("button").props("download")

    def show(self, written: Written | None) -> None:
        """Show a file; None: nothing was written yet."""
        self._table.show(() if written is None else written.lines)
        self._link.set_visibility(written is not None)
        if written is not None:
            self._link.props["href"] = f"/app/print/{Path(written.file).name}"
