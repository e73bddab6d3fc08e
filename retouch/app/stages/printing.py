"""Print: the file for a printer, of the result of a run."""

from dataclasses import replace
from typing import Any

from nicegui import ui

from relief.ground.formats import FORMATS
from relief.ground.limits import BASE_MM
from relief.printers import PRINTERS
from retouch.app.stages import controls
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.values.document import PrintChoice

BASE_ENDS_MM = (0.2, 50.0)
MOST_REPEATS = 20


class PrintStage(PageStage):
    """The stage on which a file for a printer is written."""

    name = "Print"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._choice = PrintChoice()

    def build_work(self) -> None:
        """Put the relief into the present slot."""
        self._view = self.window.view("result", "")

    def build_side(self) -> None:
        """Put the choices and the written file into the present slot."""
        with controls.section("File"):
            self._what = ui.label().classes("hint")
            suffixes = {suffix: suffix[1:].upper() for suffix in FORMATS}
            formats = controls.choice(suffixes, value=self._choice.suffix).props("spread")
            formats.on_value_change(lambda event: self._change(suffix=str(event.value)))
            controls.printer_select(lambda name: self._change(printer=name))
            with ui.element("div").classes("pair"):
                base = "Base, mm", BASE_ENDS_MM
                self._base = controls.NumberField(*base, lambda mm: self._change(base_mm=mm))
                tiles = "Tiles a side", (1, MOST_REPEATS)
                repeated = controls.NumberField(*tiles, lambda times: self._change(repeat=round(times)))
                repeated.show(self._choice.repeat)
            self._planned = controls.LineTable()
            self._button = controls.button("Write the file", self._write, "primary wide")
            self._fault = controls.fault_label()
        with controls.section("Written"):
            self._written = controls.WrittenFile()

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, sides = self.session, self.session.outcomes.sides.answer
        self._what.set_text(session.outcomes.nothing_to_show() or f"The result of {session.document.run}.")
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
        choice = self._choice
        usual = BASE_MM if choice.printer is None else PRINTERS[choice.printer].base_mm
        return usual if choice.base_mm is None else choice.base_mm

    def _plan(self) -> list[tuple[str, str]]:
        sides = self.session.outcomes.sides.answer
        if sides is None:
            return []
        side_mm = sides.after.width_mm * self._choice.repeat
        top_mm = self._base_mm + float(sides.after.heights.max())
        lines = [("size", f"{side_mm:g} × {side_mm:g} mm"), ("highest point", f"{top_mm:.2f} mm")]
        if self._choice.printer is not None:
            printer = PRINTERS[self._choice.printer]
            layers = round(top_mm / printer.layer_mm)
            made_of = f"{printer.layer_um:g} µm, pixels of {printer.pixel_um:g} µm"
            lines.append(("layers", f"about {layers} of {made_of}"))
        return lines

    def commands(self) -> list[list[str]]:
        """The command that writes the file, without `retouch`."""
        run = self.session.document.run
        return [] if run is None else [self._choice.command(run)]

    def _change(self, **fields: Any) -> None:
        self._choice = replace(self._choice, **fields)
        self.refresh()

    async def _write(self) -> None:
        await self.session.outcomes.write_print(self._choice)
