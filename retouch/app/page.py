"""The page: a bar of stages, the stage, and the line that does the same in a terminal.

A page shows the session and asks it for changes; it keeps nothing but how it looks at things, such as where
its lamp stands. `refresh` brings everything to the state of the session, and may be called at any time.
"""

from __future__ import annotations

from functools import partial

from nicegui import Client, events, ui

from retouch.app.stages.compare import CompareStage
from retouch.app.stages.controls import button
from retouch.app.stages.feel import FeelStage
from retouch.app.stages.objects import ObjectStage
from retouch.app.stages.picture import PictureStage
from retouch.app.stages.printing import PrintStage
from retouch.app.stages.run import RunStage
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.state.addresses import Addresses
from retouch.app.state.session import Session
from retouch.app.values.document import command_line
from retouch.pages.plate_viewer import SCRIPTS

STAGES = (PictureStage, FeelStage, RunStage, CompareStage, ObjectStage, PrintStage)
"""In the order of the work."""
HEAD = f"""
<link rel="stylesheet" href="/app/scripts/plate_viewer.css">
<link rel="stylesheet" href="/app/style/app.css">
{"".join(f'<script src="/app/scripts/{name}"></script>' for name in SCRIPTS)}
"""


class AppPage:
    """One window's page.

    Attributes:
        session: that all windows show.
    """

    def __init__(self, session: Session, addresses: Addresses) -> None:
        self.session = session
        window = AppWindow(session, addresses, self.show)
        self._stages: list[PageStage] = [stage(window) for stage in STAGES]

    def build(self) -> None:
        """Build the page of a window, and keep it up to date as long as the window is there."""
        ui.add_head_html(HEAD)
        with ui.element("div").classes("frame"):
            self._bar()
            with ui.element("main").classes("stages"):
                first = self._stages[0].name
                self._panels = ui.tab_panels(value=first, animated=False, keep_alive=False)
                with self._panels.on_value_change(self.refresh):
                    for stage in self._stages:
                        with ui.tab_panel(stage.name):
                            stage.build()
            self._foot()
        ui.keyboard(self._key, ignore=["input", "select", "textarea"])
        self.refresh()
        client = ui.context.client
        client.on_delete(self.session.activity.listen(lambda: self._refresh(client)))

    def show(self, name: str) -> None:
        """Turn to a stage."""
        self._panels.set_value(name)

    def refresh(self) -> None:
        """Bring all elements to the state of the session."""
        session = self.session
        for name, link in self._links.items():
            link.props(f"aria-current={'page' if name == self._panels.value else 'false'}")
        if self._panels.value == FeelStage.name:
            session.drafts.want()
            session.want_reach()
        else:
            session.drafts.warm()
        session.outcomes.want_sides()
        for stage in self._stages:
            stage.refresh()
        work = session.doing()
        self._fault.set_text(session.fault())
        self._busy.set_text(work)
        self._busy.classes(add="on" if work else "", remove="" if work else "on")
        self._undo.set_enabled(session.history.can_undo)
        self._command.set_text(self._line())

    def _refresh(self, client: Client) -> None:
        with client:
            self.refresh()

    def _bar(self) -> None:
        with ui.element("header").classes("bar"):
            ui.label("Retouch").classes("word")
            with ui.element("nav").props('aria-label="stages"'):
                self._links = {stage.name: self._link(stage.name) for stage in self._stages}
            with ui.element("div").classes("end"):
                self._fault = ui.label().classes("fault").props('role="alert"')
                self._busy = ui.label().classes("busy").props('role="status"')
                self._undo = button("Undo", self.session.history.undo, "quiet")

    def _link(self, name: str) -> ui.element:
        link = ui.element("button").props("type=button").on("click", partial(self.show, name))
        with link:
            ui.label(name)
        return link

    def _foot(self) -> None:
        with ui.element("footer").classes("foot"):
            self._command = ui.label().props('aria-label="the same in a terminal"')
            self._command.classes("command")
            button("Copy", self._copy, "quiet")

    def _line(self) -> str:
        stage = next(one for one in self._stages if one.name == self._panels.value)
        return " && ".join(map(command_line, stage.commands()))

    def _copy(self) -> None:
        ui.clipboard.write(self._line())
        ui.notify("Copied", position="bottom-right", timeout=1200)

    def _key(self, event: events.KeyEventArguments) -> None:
        undoing = event.modifiers.ctrl or event.modifiers.meta
        if event.action.keydown and undoing and event.key == "z":
            self.session.history.undo()
