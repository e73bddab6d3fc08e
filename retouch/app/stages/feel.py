"""Feel: how the result is to feel, where, to which finger, and what that costs the look."""

import base64
import binascii
import contextlib
from functools import partial
from statistics import fmean
from typing import Any, cast

from nicegui import events, ui

from mitsuba_scenes.fingers import bundled_skins
from relief.ground.limits import PATCH_SIDE_MM
from relief.printers import PRINTERS
from retouch.app.stages.controls import button, choice, section
from retouch.app.stages.elements import Brush, JndSlider, Range, ReliefView
from retouch.app.stages.window import Window
from retouch.app.state.runs import finished_runs
from retouch.app.values.document import MOST_JND, Goal
from retouch.app.values.folders import textures

GOALS: dict[Goal, str] = {"jnd": "Roughness", "contact_area_scale": "Contact area", "feel_of": "Like another"}
NO_PRINTER = "no printer"
AREA_ENDS = (0.4, 1.6)
"""Ends of the slider of the contact area, as factors on the original's."""
BRUSHES = {0.06: "small", 0.12: "medium", 0.25: "large"}
"""Diameters of the brush, as shares of the plate."""
WAITING = "How far the look is kept is being estimated."
NO_RUN = ""
"""Value of the choice of runs while another texture is chosen."""
STRENGTHS = (10.0, 100.0)
"""Ends of the slider of the brush: the share of the way from the original's feel to the goal, %."""
MOST_MASK = 900_000
"""Most characters of a painted mask: a message of the page may have 1 MB."""


class FeelStage:
    """The stage on which the feel is chosen."""

    name = "Feel"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session
        self._painting = False
        self._percent = STRENGTHS[1]
        self._cleared = self._answered = 0

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._view = ReliefView(("relief", ""))
                self._view.on("lamp", self.window.lamp_moved).on("tilt", self.window.tilted)
                with ui.element("div").classes("brush-frame") as self._canvas:
                    self._brush = Brush().on("painted", self._painted)
            with ui.element("aside").classes("side"):
                self._goals()
                self._where()
                self._how()

    def _goals(self) -> None:
        with section("The feel to reach"):
            self._goal = choice(GOALS, on_change=self._other_goal).props("spread")
            with ui.element("div") as self._jnd_part:
                self._jnd = JndSlider().on("jnd", self._jnd_chosen)
            with ui.element("div").classes("section") as self._area_part:
                self._area_told = ui.label()
                self._area = Range("contact area, as a factor", AREA_ENDS, 0.05)
                self._area.on("slid", self._area_chosen)
                ui.label("A smaller area feels warmer, a larger one colder.").classes("hint")
            with ui.element("div").classes("section") as self._like_part:
                with ui.element("div").classes("gallery"):
                    self._likes = {name: self._like(name) for name in textures()}
                self._like_run = ui.select({}, label="or the result of a run", on_change=self._other_run)
                self._like_run.props("outlined dense options-dense")
            self._fault = ui.label().classes("fault").props('role="alert"')

    def _like(self, name: str) -> Any:
        like = ui.element("button").props(f'type="button" title="{name}" aria-label="as rough as {name}"')
        with like.on("click", partial(self.session.history.change_feel, feel_of=name)):
            ui.element("img").props(f'src="/app/textures/{name}.png" alt="" width="44" height="44"')
        return like

    def _where(self) -> None:
        with section("Where") as self._where_part:
            self._paint = ui.switch("Only where I paint", on_change=self._painting_turned)
            with ui.element("div").classes("section") as self._tools:
                self._size = choice(BRUSHES, value=0.12, on_change=self.refresh).props("spread")
                self._strength_told = ui.label()
                self._strength = Range("share of the way to the goal", STRENGTHS, 5.0, "%")
                self._strength.on("slid", self._strength_chosen)
                with ui.element("div").classes("row-of"):
                    self._soft = ui.switch("Soft edge", on_change=self.refresh)
                    self._erase = ui.switch("Erase", on_change=self.refresh)
                    button("Clear", self._clear)
            self._where_told = ui.label().classes("hint")

    def _how(self) -> None:
        with section("How"):
            fingers = list(bundled_skins())
            self._skin = ui.select(fingers, label="Finger", on_change=self._other_finger)
            self._printer = ui.select([NO_PRINTER, *PRINTERS], label="Printer", on_change=self._other_printer)
            for field in (self._skin, self._printer):
                field.props("outlined dense options-dense")
            self._fast = ui.switch("Fast models for the steps", on_change=self._fast_turned)
            ui.label("The result is verified by exact models all the same.").classes("hint")
        button("Go on to the run", lambda: self.window.show("Run"), "primary wide")

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        return self.session.running.commands()

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, feel = self.session, self.session.document.feel
        address = self.window.shapes.address(session.numbers.shape)
        painting = (self._painting or feel.region is not None) and feel.goal != "feel_of"
        self._view.give(before=address, lamp=self.window.lamp, tilt=self.window.tilt)
        self._view.set_visibility(not painting)
        self._canvas.set_visibility(painting)
        mask = f"/app/mask/{feel.region.rpartition('/')[2]}" if feel.region else ""
        self._brush.give(heights=address, mask=mask, answered=self._answered, cleared=self._cleared)
        self._brush.give(
            strength=self._percent / 100.0,
            erase=bool(self._erase.value),
            soft=bool(self._soft.value),
            size=float(self._size.value or 0.12),
        )
        self._strength.give(value=self._percent)
        self._strength_told.set_text(f"{self._percent:.0f} % of the way to the goal")
        self._goal.set_value(feel.goal)
        for goal, part in zip(GOALS, (self._jnd_part, self._area_part, self._like_part), strict=True):
            part.set_visibility(goal == feel.goal)
        self._show_jnd()
        self._area.give(value=feel.contact_area_scale)
        self._area_told.set_text(self._area_text())
        self._show_runs(feel.feel_of)
        for name, like in self._likes.items():
            like.props(f'aria-pressed="{"true" if name == feel.feel_of else "false"}"')
        # Before its value, which a person could not have set then.
        self._paint.set_enabled(feel.goal != "feel_of")
        self._paint.set_value(painting)
        self._tools.set_visibility(painting)
        self._where_told.set_text(self._where_text(painting))
        self._skin.set_value(feel.skin)
        self._printer.set_value(feel.printer or NO_PRINTER)
        self._fast.set_value(feel.fast)
        self._fault.set_text(session.activity.faults.get("reach", ""))

    def _show_jnd(self) -> None:
        reach, feel = self.session.numbers.reach, self.session.document.feel
        waiting = WAITING if "reach" in self.session.activity.under_way else ""
        known: dict[str, Any] = {"costs": [], "smoother": 0.0, "rougher": 0.0}
        if reach is not None:
            costs = [list(cost) for cost in reach.costs]
            known = {"costs": costs, "smoother": reach.smoother, "rougher": reach.rougher}
            known["limit"] = reach.limit_percent
        self._jnd.give(value=feel.jnd, most=MOST_JND, waiting=waiting, **known)

    def _show_runs(self, feel_of: str) -> None:
        names = {NO_RUN: "none", **{str(folder): folder.name for folder in finished_runs()}}
        if dict(self._like_run.options) != names:
            self._like_run.set_options(names)
        self._like_run.set_value(feel_of if feel_of in names else NO_RUN)

    def _area_text(self) -> str:
        scale, felt = self.session.document.feel.contact_area_scale, self.session.numbers.felt
        if felt is None:
            return f"{scale:.2f} of the original's contact area"
        area = fmean(felt.contact_area_mm2)
        return f"{scale:.2f} of the original's: {area:.1f} to {scale * area:.1f} mm²"

    def _where_text(self, painting: bool) -> str:
        feel = self.session.document.feel
        if feel.goal == "feel_of":
            return "Another texture's feel holds all over."
        if not painting:
            return "The feel changes all over."
        paint = "Paint where the feel is to change." if feel.region is None else "The rest keeps its feel."
        return f"{paint} A finger covers {PATCH_SIDE_MM:g} mm and feels the mean of what is painted under it."

    def _other_goal(self, event: events.ValueChangeEventArguments) -> None:
        if event.value in GOALS:
            self.session.history.change_feel(goal=cast(Goal, event.value))

    def _jnd_chosen(self, event: events.GenericEventArguments) -> None:
        jnd = round(float(event.args), 2)
        if -MOST_JND <= jnd <= MOST_JND:
            self.session.history.change_feel(slid="jnd", jnd=jnd)

    def _area_chosen(self, event: events.GenericEventArguments) -> None:
        if AREA_ENDS[0] <= float(event.args) <= AREA_ENDS[1]:
            self.session.history.change_feel(slid="area", contact_area_scale=round(float(event.args), 3))

    def _other_run(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.change_feel(feel_of=str(event.value))

    def _strength_chosen(self, event: events.GenericEventArguments) -> None:
        if STRENGTHS[0] <= float(event.args) <= STRENGTHS[1]:
            self._percent = float(event.args)
            self.refresh()

    def _painting_turned(self, event: events.ValueChangeEventArguments) -> None:
        if not self._paint.enabled:
            return
        self._painting = bool(event.value)
        if not event.value and self.session.document.feel.region is not None:
            self.session.history.change_feel(region=None)
        else:
            self.refresh()

    def _clear(self) -> None:
        self._cleared += 1
        self._painting = True
        self.session.history.change_feel(region=None)
        self.refresh()

    async def _painted(self, event: events.GenericEventArguments) -> None:
        kind, _, data = str(event.args["mask"]).partition(",")
        content = b""
        if kind == "data:image/png;base64" and len(data) <= MOST_MASK:
            with contextlib.suppress(binascii.Error):
                content = base64.b64decode(data, validate=True)
        # What could not be taken is told as what is no picture.
        await self.session.paint(content)
        self._answered = int(event.args["number"])
        self.refresh()

    def _other_finger(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.change_feel(skin=str(event.value))

    def _other_printer(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.change_feel(printer=None if event.value == NO_PRINTER else str(event.value))

    def _fast_turned(self, event: events.ValueChangeEventArguments) -> None:
        self.session.history.change_feel(fast=bool(event.value))
