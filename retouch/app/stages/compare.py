"""Compare: original and result of a run under one lamp, what differs, and the numbers."""

from pathlib import Path

from nicegui import events, ui

from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import REPORT
from optimize.verification.verification import Verification
from relief.ground.limits import PATCH_SIDE_MM
from retouch.app.stages import controls
from retouch.app.stages.elements import ReliefView
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.state.runs import earlier_runs, state_of
from retouch.app.values.findings import Lines, Map, Sides
from retouch.pages.sentences import change_by_printing, smooth_change, surface_band
from tactile.quantities import QUANTITIES, ROUGHNESS

WAYS = ("Swipe", "Side by side", "Blink", "Change", "Feel", "Strain")
MAPS = {
    "Change": ("change of the heights",),
    "Strain": ("original: strain under a finger in the middle", "result"),
}
"""Ways that show maps as pictures, and their names."""
PLACES_NOTE = (
    f"Each disc is the middle of a finger, which covers {PATCH_SIDE_MM:g} mm; those with a dark ring were "
    "optimised. By the model that verified the run."
)


class MapFigure:
    """A map in colours with its name and the ends of its colours.

    Attributes:
        element: the whole figure.
    """

    def __init__(self, name: str) -> None:
        with ui.element("figure").classes("named map") as self.element:
            ui.label(name).classes("name")
            self._picture = ui.element("img").props(f'alt="map: {name}"')
            self._bar = ui.element("img").classes("colours").props('alt=""')
            self._ends = ui.label().classes("hint")

    def show(self, content: Map | None) -> None:
        """Show a map; None: the reliefs cannot be subtracted."""
        for element in (self._picture, self._bar):
            element.set_visibility(content is not None)
        if content is None:
            self._ends.set_text("The two have different grids.")
            return
        if self._picture.props.get("src") != content.picture:
            self._picture.props["src"], self._bar.props["src"] = content.picture, content.bar
        self._ends.set_text(f"{content.low:.3g} to {content.high:.3g} {content.unit}")


class CompareStage(PageStage):
    """The stage on which original and result are looked at together."""

    name = "Compare"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._way = WAYS[0]

    def build_work(self) -> None:
        """Put the views and maps into the present slot."""
        self._ways = controls.choice(list(WAYS), value=self._way, on_change=self._other_way).classes("ways")
        with ui.element("div").classes("compared"):
            self._one = self.window.view("original", "result", moved=self.refresh)
            with ui.element("div").classes("views") as self._two:
                self._each = [self._named(name) for name in ("original", "result")]
            with ui.element("div").classes("views") as self._map_part:
                self._maps = [(way, MapFigure(name)) for way, names in MAPS.items() for name in names]
            with ui.element("div").classes("felt-places") as self._felt_part:
                ui.label(PLACES_NOTE).classes("hint")
                # The maps of the report: no text in them comes from a person.
                self._felt = ui.html(sanitize=False).classes("boards")
        self._none = ui.label().classes("hint")

    def _named(self, name: str) -> ReliefView:
        with ui.element("div").classes("named"):
            ui.label(name).classes("name")
            return self.window.view(name, "", tools=name == "result", moved=self.refresh)

    def build_side(self) -> None:
        """Put the choice of the run and its numbers into the present slot."""
        with controls.section("Run"):
            self._run = controls.select("Run", {}, self.session.history.look_at)
            self._stop = ui.label().classes("hint")
            self._fault = controls.fault_label()
        with controls.section("Numbers"):
            with ui.element("div").classes("numbers"):
                self._jnd = controls.Number("from the original", "JND")
                self._look = controls.Number("change of the pictures", "%")
            self._table = controls.LineTable()
            with ui.element("div").classes("row-of"):
                self._report = ui.link("Open the report", "", new_tab=True).classes("button")
                controls.button("Go on to the print", lambda: self.window.show("Print"), "primary")

    def commands(self) -> list[list[str]]:
        """The command that compares, without `retouch`."""
        run = self.session.document.run
        return [] if run is None else [["compare", run, "-o", f"{run}-comparison.html"]]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session = self.session
        names = {str(folder): folder.name for folder in earlier_runs()}
        run = session.document.run
        controls.offer(self._run, names, run if run in names else None)
        sides = session.outcomes.sides.answer
        self._none.set_text(session.outcomes.nothing_to_show())
        self._fault.set_text(session.activity.faults.get("sides", ""))
        self._show_ways(sides)
        if sides is not None:
            self.window.light_up(self._one, sides.before, sides.after, blink=self._way == "Blink")
            for view, relief in zip(self._each, (sides.before, sides.after), strict=True):
                self.window.light_up(view, relief)
            for (_, figure), content in zip(self._maps, (sides.change, *sides.strain), strict=True):
                figure.show(content)
            if self._felt.content != sides.places:
                self._felt.set_content(sides.places)
        self._show_numbers(run)

    def _show_ways(self, sides: Sides | None) -> None:
        # One place of the finger is a number, not a map.
        possible = [way for way in WAYS if way != "Feel" or (sides is not None and sides.places)]
        if sides is not None and self._ways.options != possible:
            self._ways.set_options(possible, value=self._way if self._way in possible else "Strain")
        for part, ways in (
            (self._one, ("Swipe", "Blink")),
            (self._two, ("Side by side",)),
            (self._felt_part, ("Feel",)),
            (self._map_part, tuple(MAPS)),
        ):
            part.set_visibility(sides is not None and self._way in ways)
        for way, figure in self._maps:
            figure.element.set_visibility(self._way == way)

    def _show_numbers(self, run: str | None) -> None:
        result = None if run is None else read_verification(Path(run))
        self._report.set_visibility(result is not None)
        if run is None or result is None:
            self._jnd.show(None)
            self._look.show(None)
            self._table.show(())
            self._stop.set_text("" if run is None else state_of(Path(run)).value)
            return
        jnd = result.touch.jnd_from_original
        self._jnd.show(None if jnd is None else f"{jnd:+.2f}")
        self._look.show(f"{result.look.change_percent:.2f}")
        self._stop.set_text(result.stop.message)
        self._table.show(_lines(result))
        self._report.props["href"] = f"/app/report/{Path(run).name}/{REPORT}"

    def _other_way(self, event: events.ValueChangeEventArguments) -> None:
        self._way = str(event.value)
        self.refresh()


def _lines(result: Verification) -> Lines:
    """What was measured of a result."""
    lines = []
    for quantity in QUANTITIES.values():
        before, after = result.touch.initial.get(quantity.name), result.touch.final(quantity.name)
        if before is not None and after is not None:
            values = f"{before:.4g} to {after:.4g} {quantity.unit}"
            lines.append((f"{quantity.label} {quantity.symbol}", values.rstrip()))
    if result.touch.jnd_from_original is None:
        lines.append(("feel", smooth_change(*result.touch.ends_of(ROUGHNESS.name))))
        lines += [("skin's surface", surface_band(band)) for band in result.touch.surface_bands or ()]
    if (change := change_by_printing(result)) is not None:
        lines.append(("printer", change))
    if result.touch.verified_by is not None:
        lines.append(("verified by", result.touch.verified_by))
    if (fingers := result.touch.fingers) is not None and fingers.jnd_min is not None:
        lines.append(("other fingers", f"{fingers.jnd_min:+.2f} to {fingers.jnd_max:+.2f} JND"))
    white = f"{result.look.change_percent_of_white:.2f} % of white"
    lines.append(("pictures", f"changed by {result.look.change_percent:.2f} % of the mean, {white}"))
    lines.append(("time", f"{result.time_s.get('total', 0.0):.0f} s"))
    return tuple(lines)
