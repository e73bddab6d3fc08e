"""Compare: original and result of a run under one lamp, what differs, and the numbers."""

from pathlib import Path

from nicegui import events, ui

from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import REPORT
from optimize.verification.verification import Verification
from relief.ground.limits import PATCH_SIDE_MM
from retouch.app.stages.controls import Number, Told, button, choice, section
from retouch.app.stages.elements import ReliefView
from retouch.app.stages.window import Window
from retouch.app.state.runs import earlier_runs, state_of
from retouch.app.values.findings import Map, Sides

WAYS = ("Swipe", "Side by side", "Blink", "Change", "Feel", "Strain")
MAPS = {
    "Change": ("change of the heights",),
    "Strain": ("original: strain under a finger in the middle", "result"),
}
"""Ways that show maps as pictures, and their names."""
PLACES_TOLD = (
    f"Each disc is the middle of a finger, which covers {PATCH_SIDE_MM:g} mm; those with a dark ring were "
    "steered. By the model that verified the run."
)


class CompareStage:
    """The stage on which original and result are looked at together."""

    name = "Compare"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session
        self._way = WAYS[0]

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._ways = choice(list(WAYS), value=self._way, on_change=self._other_way).classes("ways")
                self._pictures()
            with ui.element("aside").classes("side"):
                with section("Run"):
                    self._run = ui.select({}, label="Run", on_change=self._other_run)
                    self._run.props("outlined dense options-dense")
                    self._stop = ui.label().classes("hint")
                    self._fault = ui.label().classes("fault").props('role="alert"')
                self._numbers()

    def _pictures(self) -> None:
        with ui.element("div").classes("compared"):
            self._one = ReliefView()
            with ui.element("div").classes("views") as self._two:
                self._each = [self._named(name) for name in ("original", "result")]
            with ui.element("div").classes("views") as self._map_part:
                self._maps = [(way, self._map(name)) for way, names in MAPS.items() for name in names]
            with ui.element("div").classes("felt-places") as self._felt_part:
                ui.label(PLACES_TOLD).classes("hint")
                # The maps of the report: no text in them comes from a person.
                self._felt = ui.html(sanitize=False).classes("boards")
        for view in (self._one, *self._each):
            view.on("lamp", self._lamp).on("tilt", self._tilt)
        self._none = ui.label("No run has a result yet.").classes("hint")

    @staticmethod
    def _named(name: str) -> ReliefView:
        with ui.element("div").classes("named"):
            ui.label(name).classes("name")
            return ReliefView((name, ""), tools=name == "result")

    @staticmethod
    def _map(name: str) -> tuple[ui.element, ui.element, ui.element, ui.label]:
        with ui.element("figure").classes("named map") as whole:
            ui.label(name).classes("name")
            picture = ui.element("img").props(f'alt="map: {name}"')
            bar = ui.element("img").classes("colours").props('alt=""')
            ends = ui.label().classes("hint")
        return whole, picture, bar, ends

    def _numbers(self) -> None:
        with section("Numbers"):
            with ui.element("div").classes("numbers"):
                self._jnd = Number("from the original", "JND")
                self._look = Number("change of the pictures", "%")
            self._table = Told()
            with ui.element("div").classes("row-of"):
                self._report = ui.link("Open the report", "", new_tab=True).classes("button")
                button("Go on to the print", lambda: self.window.show("Print"), "primary")

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        run = self.session.document.run
        return [] if run is None else [["compare", run, "-o", f"{run}-comparison.html"]]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session = self.session
        names = {str(folder): folder.name for folder in earlier_runs()}
        if dict(self._run.options) != names:
            self._run.set_options(names)
        run = session.document.run
        self._run.set_value(run if run in names else None)
        sides = session.outcomes.sides
        self._none.set_visibility(sides is None and "sides" not in session.activity.under_way)
        self._fault.set_text(session.activity.faults.get("sides", ""))
        self._show_ways(sides)
        if sides is not None:
            before, after = map(self.window.shapes.address, (sides.before, sides.after))
            shared = {"lamp": self.window.lamp, "tilt": self.window.tilt}
            self._one.give(before=before, after=after, blink=self._way == "Blink", **shared)
            for view, address in zip(self._each, (before, after), strict=True):
                view.give(before=address, **shared)
            for (_, parts), content in zip(self._maps, (sides.change, *sides.strain), strict=True):
                self._show_map(parts, content)
            if self._felt.content != sides.places:
                self._felt.set_content(sides.places)
        self._show_numbers(run)

    def _show_ways(self, sides: Sides | None) -> None:
        # One place of the finger is a number, not a map.
        possible = [way for way in WAYS if way != "Feel" or (sides is not None and sides.places)]
        if sides is not None and self._ways.options != possible:
            way = self._way if self._way in possible else "Strain"
            self._ways.set_options(possible, value=way)
        known = sides is not None
        self._one.set_visibility(known and self._way in ("Swipe", "Blink"))
        self._two.set_visibility(known and self._way == "Side by side")
        self._felt_part.set_visibility(known and self._way == "Feel")
        self._map_part.set_visibility(known and self._way in MAPS)
        for way, (whole, *_) in self._maps:
            whole.set_visibility(self._way == way)

    @staticmethod
    def _show_map(parts: tuple[ui.element, ui.element, ui.element, ui.label], content: Map | None) -> None:
        _, picture, bar, ends = parts
        for element in (picture, bar):
            element.set_visibility(content is not None)
        if content is None:
            ends.set_text("The two have different grids.")
            return
        if picture.props.get("src") != content.picture:
            picture.props["src"], bar.props["src"] = content.picture, content.bar
        ends.set_text(f"{content.low:.3g} to {content.high:.3g} {content.unit}")

    def _show_numbers(self, run: str | None) -> None:
        result = None if run is None else read_verification(Path(run))
        self._report.set_visibility(result is not None)
        if run is None or result is None:
            self._jnd.show(None)
            self._look.show(None)
            self._table.show(())
            self._stop.set_text("" if run is None else state_of(Path(run)).value)
            return
        touch, look = result.touch, result.look
        jnd = touch.jnd_from_original
        self._jnd.show(None if jnd is None else f"{jnd:+.2f}")
        self._look.show(f"{look.change_percent:.2f}")
        self._stop.set_text(result.stop.message)
        self._table.show(_lines(result))
        self._report.props["href"] = f"/app/report/{Path(run).name}/{REPORT}"

    def _other_way(self, event: events.ValueChangeEventArguments) -> None:
        self._way = str(event.value)
        self.refresh()

    def _other_run(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.look_at(str(event.value))

    def _lamp(self, event: events.GenericEventArguments) -> None:
        self.window.lamp_moved(event)
        self.refresh()

    def _tilt(self, event: events.GenericEventArguments) -> None:
        self.window.tilted(event)
        self.refresh()


def _lines(result: Verification) -> list[tuple[str, str]]:
    """What was measured of a result: a word and a sentence each."""
    lines = []
    for name, label, unit in (("roughness", "roughness V", ""), ("contact_area_mm2", "contact area", " mm²")):
        before, after = result.touch.initial.get(name), result.touch.final(name)
        if before is not None and after is not None:
            lines.append((label, f"{before:.4g} to {after:.4g}{unit}"))
    if result.touch.verified_by is not None:
        lines.append(("verified by", result.touch.verified_by))
    if (fingers := result.touch.fingers) is not None and fingers.jnd_min is not None:
        lines.append(("other fingers", f"{fingers.jnd_min:+.2f} to {fingers.jnd_max:+.2f} JND"))
    white = f"{result.look.change_percent_of_white:.2f} % of white"
    lines.append(("pictures", f"changed by {result.look.change_percent:.2f} % of the mean, {white}"))
    lines.append(("time", f"{result.time_s.get('total', 0.0):.0f} s"))
    return lines
