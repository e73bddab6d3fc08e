"""Feel: how the result is to feel, where, to which finger, and what that costs the look."""

import base64
import binascii
import contextlib
import math
from collections.abc import Callable
from functools import partial
from statistics import fmean
from typing import Any

import numpy as np
from nicegui import events, ui

from relief.ground.limits import PATCH_SIDE_MM
from retouch.app.stages import controls
from retouch.app.stages.compare import MapFigure
from retouch.app.stages.elements import Brush, JndSlider, Range
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.state.runs import finished_runs
from retouch.app.values.document import FEEL_OF, JND, MOST_JND, goals
from retouch.app.values.findings import Draft
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW, smooth_clause
from tactile.quantities import CONTACT_AREA, ROUGHNESS, Quantity

FACTOR_ENDS = (0.4, 1.6)
"""Ends of the slider of a quantity, as factors on the original's value."""
COSTS = 49
"""Changes of the feel whose cost for the look is drawn."""
BRUSHES = {0.06: "small", 0.12: "medium", 0.25: "large"}
"""Diameters of the brush, as shares of the plate."""
WAITING = "How far the look is kept is being estimated."
NO_RUN = ""
"""Value of the choice of runs while another texture is chosen."""
STRENGTHS = (10.0, 100.0)
"""Ends of the slider of the brush: the share of the way from the original's feel to the goal, %."""
MOST_MASK = 900_000
"""Most characters of a painted mask: a message of the page may have 1 MB."""


DRAFT_NOTE = (
    "A draft is a few steps by fast models, at four contact locations of a tile, and no result: it leaves "
    "out the printer and the check by exact models, and a run begins anew."
)


def draft_line(draft: Draft, own: bool, goal: str) -> str:
    """What a draft reaches, in words.

    Args:
        own: whether it was made for the feel that is chosen.
        goal: of this feel.
    """
    words = []
    if (ratio := draft.ratios.get(CONTACT_AREA.name)) is not None and goal not in (JND, FEEL_OF):
        words.append(f"{ratio:.2f} of the original's {CONTACT_AREA.label}")
    if (ratio := draft.ratios.get(ROUGHNESS.name)) is not None:
        words.append(f"{math.log(ratio) / math.log(ROUGHNESS_JND):+.2f} JND")
    white = f"{draft.change_percent_of_white:.2f} % of white"
    words.append(f"pictures change by {white}, {draft.change_percent:.1f} % of the mean picture")
    name = ("Draft" if draft.met else "Nearest so far") if own else "Nearest known"
    return f"{name}: {', '.join(words)}".replace("-", "−")


class FactorGoal:
    """A goal that is a factor on the original's value of a quantity: a sentence, and a slider."""

    def __init__(self, quantity: Quantity, chosen: Callable[[float], None]) -> None:
        self._quantity = quantity
        with ui.element("div").classes("section"):
            self._sentence = ui.label()
            self._slider = Range(f"{quantity.label}, as a factor", "", FACTOR_ENDS, 0.05, chosen)
            ui.label(quantity.meaning).classes("hint")

    def show(self, factor: float, original: float | None) -> None:
        """Show the chosen factor, and what it makes of the original's mean, if that is known."""
        self._slider.give(value=factor)
        text = f"{factor:.2f} of the original's {self._quantity.label}"
        if original is not None:
            text += f": {self._quantity.text(original)} to {self._quantity.text(factor * original)}"
        self._sentence.set_text(text)


class FeelStage(PageStage):
    """The stage on which the feel is chosen."""

    name = "Feel"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._painting = False
        self._percent = STRENGTHS[1]
        self._cleared = self._answered = 0

    def build_work(self) -> None:
        """Put the relief, and the brush over it, into the present slot."""
        self._view = self.window.view("original", "draft")
        with ui.element("div").classes("brush-frame") as self._canvas:
            self._brush = Brush().on("painted", self._painted)
        with ui.element("div").classes("strip draft") as self._strip:
            with ui.element("div").classes("grow"):
                self._draft = ui.label().classes("state").props('role="status"')
                self._draft_fault = controls.fault_label()
                ui.label(DRAFT_NOTE).classes("hint")
            self._change = MapFigure("change of the heights")

    def build_side(self) -> None:
        """Put the goals, the region and the way there into the present slot."""
        with controls.section("The feel to reach"):
            self._build_goals()
            self._fault = controls.fault_label()
        with controls.section("Where"):
            self._build_region()
        change = self.session.history.change_feel
        with controls.section("How"):
            self._skin = controls.finger_select(lambda name: change(skin=name))
            self._printer = controls.printer_select(lambda name: change(printer=name))
            fast = "Fast models for the steps"
            self._fast = ui.switch(fast, on_change=lambda event: change(fast=bool(event.value)))
            ui.label("The result is verified by exact models all the same.").classes("hint")
        controls.button("Go on to the run", lambda: self.window.show("Run"), "primary wide")

    def _build_goals(self) -> None:
        change = self.session.history.change_feel
        names = {goal: quantity.label.capitalize() for goal, quantity in goals().items()}
        names |= {FEEL_OF: "Like another"}
        self._goal = controls.choice(names, on_change=self._other_goal).props("spread")
        self._parts: dict[str, ui.element] = {}
        self._factors: dict[str, FactorGoal] = {}
        for goal, quantity in goals().items():
            with ui.element("div") as self._parts[goal]:
                if goal == JND:
                    self._jnd = JndSlider(MOST_JND, partial(self._number_chosen, JND))
                    self._smooth = ui.label().classes("hint")
                else:
                    self._factors[goal] = FactorGoal(quantity, partial(self._number_chosen, goal))
        with ui.element("div").classes("section") as self._parts[FEEL_OF]:
            self._textures = controls.Gallery("as rough as", lambda name: change(feel_of=name))
            self._runs = controls.select("or the result of a run", {}, lambda run: change(feel_of=run))

    def _build_region(self) -> None:
        self._paint = ui.switch("Only where I paint", on_change=self._painting_turned)
        with ui.element("div").classes("section") as self._tools:
            self._size = controls.choice(BRUSHES, value=0.12, on_change=self.refresh).props("spread")
            self._strength_text = ui.label()
            label = "share of the way to the goal"
            self._strength = Range(label, "%", STRENGTHS, 5.0, self._strength_chosen)
            with ui.element("div").classes("row-of"):
                self._soft = ui.switch("Soft edge", on_change=self.refresh)
                self._erase = ui.switch("Erase", on_change=self.refresh)
                controls.button("Clear", self._clear)
        self._where = ui.label().classes("hint")

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, feel = self.session, self.session.document.feel
        painting = (self._painting or feel.region is not None) and feel.goal != FEEL_OF
        self._show_draft()
        self._view.set_visibility(not painting)
        self._strip.set_visibility(not painting)
        self._show_goals()
        self._show_brush(painting)
        # Before its value, which a person could not have set then.
        self._paint.set_enabled(feel.goal != FEEL_OF)
        self._paint.set_value(painting)
        self._where.set_text(self._where_text(painting))
        self._skin.set_value(feel.skin)
        self._printer.show(feel.printer)
        self._fast.set_value(feel.fast)
        self._fault.set_text("" if self._smooth.text else session.activity.faults.get("reach", ""))

    def _show_draft(self) -> None:
        session = self.session
        draft, own = session.drafts.shown()
        drafting = "draft" in session.activity.under_way
        line = "A draft is being made." if drafting else "This is the original."
        if draft is not None:
            line = draft_line(draft, own, session.document.feel.goal)
        self._draft.set_text(line)
        self._draft_fault.set_text("" if self._smooth.text else session.activity.faults.get("draft", ""))
        self._change.element.set_visibility(draft is not None)
        if draft is not None:
            self._change.show(draft.change)
        original = session.numbers.relief
        # While a draft is being made the original stands in for it, as a view of two is slow to build.
        after = draft.relief if draft is not None else original if drafting else None
        self.window.light_up(self._view, original, after)

    def _show_goals(self) -> None:
        numbers, feel = self.session.numbers, self.session.document.feel
        self._goal.set_value(feel.goal)
        for goal, part in self._parts.items():
            part.set_visibility(goal == feel.goal)
        self._show_jnd()
        for goal, factor in self._factors.items():
            name = goals()[goal].name
            factor.show(feel.numbers[goal], None if numbers.felt is None else fmean(numbers.felt[name]))
        self._textures.show(feel.feel_of)
        runs = {NO_RUN: "none", **{str(folder): folder.name for folder in finished_runs()}}
        controls.offer(self._runs, runs, feel.feel_of if feel.feel_of in runs else NO_RUN)

    def _show_jnd(self) -> None:
        felt = self.session.numbers.felt
        roughness = math.inf if felt is None else fmean(felt[ROUGHNESS.name])
        smooth = roughness < SMOOTH_BELOW
        advice = f"The texture is {smooth_clause(roughness)}. Choose “Like another” or a deeper relief."
        self._smooth.set_text(advice if smooth else "")
        self._jnd.set_visibility(not smooth)
        reach = self.session.numbers.reach.answer
        waiting = WAITING if "reach" in self.session.activity.under_way else ""
        curve: dict[str, Any] = {"costs": [], "smoother": 0.0, "rougher": 0.0}
        if reach is not None:
            # Of the mean picture, as everywhere on the page.
            scale = 100.0 / reach.mean_percent_of_white
            ends = np.linspace(-MOST_JND, MOST_JND, COSTS).tolist()
            curve["costs"] = [[jnd, scale * reach.change_percent(jnd)] for jnd in ends]
            curve |= {"smoother": reach.smoother.jnd, "rougher": reach.rougher.jnd}
            curve["limit"] = reach.limit_percent_of_mean
        self._jnd.give(value=self.session.document.feel.numbers[JND], waiting=waiting, **curve)

    def _show_brush(self, painting: bool) -> None:
        self._canvas.set_visibility(painting)
        self._tools.set_visibility(painting)
        region = self.session.document.feel.region
        self._brush.give(
            heights=self.window.address(self.session.numbers.relief),
            mask=f"/app/mask/{region.rpartition('/')[2]}" if region else "",
            answered=self._answered,
            cleared=self._cleared,
            strength=self._percent / 100.0,
            erase=bool(self._erase.value),
            soft=bool(self._soft.value),
            size=float(self._size.value or 0.12),
        )
        self._strength.give(value=self._percent)
        self._strength_text.set_text(f"{self._percent:.0f} % of the way to the goal")

    def _where_text(self, painting: bool) -> str:
        feel = self.session.document.feel
        if feel.goal == FEEL_OF:
            return "Another texture's feel holds all over."
        if not painting:
            return "The feel changes all over."
        paint = "Paint where the feel is to change." if feel.region is None else "The rest keeps its feel."
        paint += " A painted feel has no draft."
        return f"{paint} A finger covers {PATCH_SIDE_MM:g} mm and feels the mean of what is painted under it."

    def _other_goal(self, event: events.ValueChangeEventArguments) -> None:
        if event.value in self._parts:
            self.session.history.change_feel(goal=str(event.value))

    def _number_chosen(self, goal: str, number: float) -> None:
        numbers = {**self.session.document.feel.numbers, goal: number}
        self.session.history.change_feel(slid=goal, numbers=numbers)

    def _strength_chosen(self, percent: float) -> None:
        self._percent = percent
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
        # What could not be taken is refused as what is no picture.
        await self.session.paint(content)
        self._answered = int(event.args["number"])
        self.refresh()
