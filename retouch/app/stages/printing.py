"""Print: the file for a printer, of the result of a run."""

from nicegui import events, ui

from relief.ground.formats import FORMATS
from relief.ground.limits import BASE_MM
from relief.printers import PRINTERS
from retouch.app.stages import controls
from retouch.app.stages.window import AppWindow, PageStage

BASE_ENDS_MM = (0.2, 50.0)
MOST_REPEATS = 20


class PrintStage(PageStage):
    """The stage on which a file for a printer is written."""

    name = "Print"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._suffix, self._repeat = ".3mf", 1
        self._printer: str | None = None
        self._own_base_mm: float | None = None

    def build_work(self) -> None:
        """Put the relief into the present slot."""
        self._view = self.window.view("result", "")

    def build_side(self) -> None:
        """Put the choices and the written file into the present slot."""
        with controls.section("File"):
            self._what = ui.label().classes("hint")
            suffixes = {suffix: suffix[1:].upper() for suffix in FORMATS}
            controls.choice(suffixes, value=self._suffix, on_change=self._format_chosen).props("spread")
            controls.printer_select(self._printer_chosen)
            with ui.element("div").classes("pair"):
                self._base = controls.NumberField("Base, mm", BASE_ENDS_MM, self._base_chosen)
                controls.NumberField("Tiles a side", (1, MOST_REPEATS), self._repeat_chosen).show(
                    self._repeat
                )
            self._planned = controls.LineTable()
            self._button = controls.button("Write the file", self._write, "primary wide")
            self._fault = controls.fault_label()
        with controls.section("Written"):
            self._written = controls.WrittenFile()

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, sides = self.session, self.session.outcomes.sides.answer
        self._what.set_text(controls.NO_RESULT if sides is None else f"The result of {session.document.run}.")
        self.window.light_up(self._view, None if sides is None else sides.after)
        self._view.set_visibility(sides is not None)
        self._button.set_enabled(sides is not None and "print" not in session.activity.under_way)
        self._base.show(self._base_mm)
        self._planned.show(self._plan())
        self._fault.set_text(session.activity.faults.get("print", ""))
        self._written.show(session.outcomes.written)

    @property
    def _base_mm(self) -> float:
        """Thickness under height 0: the chosen one, or what the printer makes of the usual one."""
        usual = BASE_MM if self._printer is None else PRINTERS[self._printer].base_mm
        return usual if self._own_base_mm is None else self._own_base_mm

    def _plan(self) -> list[tuple[str, str]]:
        sides = self.session.outcomes.sides.answer
        if sides is None:
            return []
        side_mm = sides.after.width_mm * self._repeat
        top_mm = self._base_mm + float(sides.after.heights.max())
        lines = [("size", f"{side_mm:g} × {side_mm:g} mm"), ("highest point", f"{top_mm:.2f} mm")]
        if self._printer is not None:
            printer = PRINTERS[self._printer]
            layers = round(top_mm / printer.layer_mm)
            made_of = f"{printer.layer_um:g} µm, pixels of {printer.pixel_um:g} µm"
            lines.append(("layers", f"about {layers} of {made_of}"))
        return lines

    def commands(self) -> list[list[str]]:
        """The command that writes the file, without `retouch`."""
        run = self.session.document.run
        if run is None:
            return []
        words = ["export", run, "-o", f"{run}-print{self._suffix}"]
        words += [] if self._own_base_mm is None else ["--base-mm", f"{self._own_base_mm:g}"]
        words += ["--repeat", f"{self._repeat}x{self._repeat}"] if self._repeat > 1 else []
        return [words + ([] if self._printer is None else ["--printer", self._printer])]

    def _format_chosen(self, event: events.ValueChangeEventArguments) -> None:
        self._suffix = str(event.value)
        self.refresh()

    def _printer_chosen(self, name: str | None) -> None:
        self._printer = name
        self.refresh()

    def _base_chosen(self, value: float) -> None:
        self._own_base_mm = value
        self.refresh()

    def _repeat_chosen(self, value: float) -> None:
        self._repeat = round(value)
        self.refresh()

    async def _write(self) -> None:
        choices = self._suffix, self._own_base_mm, self._repeat, self._printer
        await self.session.outcomes.write_print(*choices)
