"""Print: the file for a printer, of the result of a run or of the picture itself."""

from pathlib import Path

from nicegui import events, ui

from relief.ground.formats import FORMATS
from relief.ground.limits import BASE_MM
from relief.printers import PRINTERS
from retouch.app.stages.controls import NumberField, Told, button, choice, section
from retouch.app.stages.elements import ReliefView
from retouch.app.stages.window import Window

NO_PRINTER = "no printer"
FEWEST_BASE_MM, MOST_BASE_MM = 0.2, 50.0
MOST_REPEATS = 20


class PrintStage:
    """The stage on which a file for a printer is written."""

    name = "Print"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session
        self._suffix, self._printer_name = ".3mf", NO_PRINTER
        self._own_base_mm: float | None = None
        self._repeat = 1.0

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._view = ReliefView(("result", ""))
                self._view.on("lamp", self.window.lamp_moved).on("tilt", self.window.tilted)
            with ui.element("aside").classes("side"):
                self._choices()
                self._written()

    def _choices(self) -> None:
        with section("File"):
            self._what = ui.label().classes("hint")
            suffixes = {suffix: suffix[1:].upper() for suffix in FORMATS}
            self._format = choice(suffixes, value=self._suffix, on_change=self._changed).props("spread")
            self._printer = ui.select(
                [NO_PRINTER, *PRINTERS], label="Printer", value=NO_PRINTER, on_change=self._changed
            )
            self._printer.props("outlined dense options-dense")
            with ui.element("div").classes("pair"):
                self._base = NumberField("Base, mm", FEWEST_BASE_MM, MOST_BASE_MM, self._base_chosen)
                repeat = NumberField("Tiles a side", 1, MOST_REPEATS, self._repeat_chosen)
                repeat.show(self._repeat)
            self._numbers = Told()
            self._button = button("Write the file", self._write, "primary wide")
            self._fault = ui.label().classes("fault").props('role="alert"')

    def _written(self) -> None:
        with section("Written"):
            self._result = Told()
            self._download = ui.link("Save a copy", "").classes("button").props("download")

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, sides = self.session, self.session.outcomes.sides
        missing = "No run has a result yet."
        self._what.set_text(missing if sides is None else f"The result of {session.document.run}.")
        address = "" if sides is None else self.window.shapes.address(sides.after)
        self._view.give(before=address, lamp=self.window.lamp, tilt=self.window.tilt)
        self._view.set_visibility(sides is not None)
        self._button.set_enabled(sides is not None and "print" not in session.activity.under_way)
        self._base.show(self._base_mm)
        self._numbers.show(self._planned())
        self._fault.set_text(session.activity.faults.get("print", ""))
        written = session.outcomes.written
        self._download.set_visibility(written is not None)
        self._result.show(() if written is None else written.lines)
        if written is not None:
            self._download.props["href"] = f"/app/print/{Path(written.file).name}"

    @property
    def _base_mm(self) -> float:
        """Thickness under height 0: the chosen one, or what the printer makes of the usual one."""
        printer = PRINTERS.get(self._printer_name)
        usual = BASE_MM if printer is None else printer.base_mm
        return usual if self._own_base_mm is None else self._own_base_mm

    def _planned(self) -> list[tuple[str, str]]:
        sides = self.session.outcomes.sides
        if sides is None:
            return []
        side_mm = sides.after.size_mm * self._repeat
        lines = [("size", f"{side_mm:g} × {side_mm:g} mm"), ("highest point", f"{self._top_mm():.2f} mm")]
        printer = PRINTERS.get(self._printer_name)
        if printer is not None:
            layers = round(self._top_mm() / printer.layer_mm)
            made_of = f"{printer.layer_um:g} µm, pixels of {printer.pixel_um:g} µm"
            lines.append(("layers", f"about {layers} of {made_of}"))
        return lines

    def _top_mm(self) -> float:
        assert self.session.outcomes.sides is not None
        return self._base_mm + float(self.session.outcomes.sides.after.heights.max())

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        run = self.session.document.run
        if run is None:
            return []
        words = ["export", run, "-o", f"{run}-print{self._suffix}"]
        words += [] if self._own_base_mm is None else ["--base-mm", f"{self._own_base_mm:g}"]
        if self._repeat > 1:
            words += ["--repeat", f"{self._repeat:g}x{self._repeat:g}"]
        return [words + (["--printer", self._printer_name] if self._printer_name in PRINTERS else [])]

    def _changed(self, _event: events.ValueChangeEventArguments) -> None:
        self._suffix, self._printer_name = str(self._format.value), str(self._printer.value)
        self.refresh()

    def _base_chosen(self, value: float) -> None:
        self._own_base_mm = value
        self.refresh()

    def _repeat_chosen(self, value: float) -> None:
        self._repeat = float(round(value))
        self.refresh()

    async def _write(self) -> None:
        printer = self._printer_name if self._printer_name in PRINTERS else None
        await self.session.outcomes.write_print(self._suffix, self._own_base_mm, int(self._repeat), printer)
