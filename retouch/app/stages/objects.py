"""Object: the result laid over a part, shown before it is written, and its feel in colours."""

from pathlib import Path

from nicegui import events, ui

from relief.printers import PRINTERS
from relief.solids.names import OBJECTS
from retouch.app.stages.controls import NumberField, Told, button, section
from retouch.app.stages.elements import DropZone
from retouch.app.stages.window import Window
from retouch.app.values.folders import PARTS_FOLDER, SUFFIXES

DIRECTIONS = {
    "": "as it is found",
    **{f"{sign}{axis}": f"{sign}{axis}" for axis in "xyz" for sign in ("", "-")},
}
NO_PRINTER = "no printer"
LONGEST_MASK = 300
OLD = "What is shown was made with other choices; Show makes it anew."


class ObjectStage:
    """The stage on which the result is laid over an object."""

    name = "Object"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._frame = ui.element("iframe").classes("object-page")
                self._frame.props('sandbox="allow-scripts" title="the object"')
                self._none = ui.label("Show the result on an object.").classes("hint caption")
            with ui.element("aside").classes("side"):
                self._choices()
                self._results()

    def _choices(self) -> None:
        change = self.session.history.change_part
        with section("Object"):
            self._what = ui.label().classes("hint")
            suffixes = SUFFIXES[PARTS_FOLDER]
            zone = DropZone("Choose a part", "or drop one: STL, OBJ, PLY, GLB, 3MF", "/app/part", suffixes)
            zone.on("kept", lambda event: change(mesh=str(event.args["file"])))
            self._mesh = ui.select({}, label="Object", on_change=self._other_mesh)
            self._along = ui.select(DIRECTIONS, label="The texture's top points", on_change=self._turned_to)
            self._printer = ui.select([NO_PRINTER, *PRINTERS], label="Printer", on_change=self._other_printer)
            for field in (self._mesh, self._along, self._printer):
                field.props("outlined dense options-dense")
            self._turn = NumberField("Turn, degrees", -360.0, 360.0, lambda value: change(turn_deg=value))
            self._mask = ui.input("Where, as in z>2 & angle<80", on_change=self._masked)
            self._mask.props("outlined dense debounce=400")

    def _results(self) -> None:
        with section("Result"):
            with ui.element("div").classes("row-of"):
                self._show = button("Show", self.session.outcomes.preview_part, "primary")
                self._wrap = button("Write the file", self.session.outcomes.wrap_part)
                self._feel = button("Feel in colours", self.session.outcomes.feel_part)
            self._old = ui.label().classes("hint")
            self._told = Told()
            self._written = Told()
            self._save = ui.link("Save a copy", "").classes("button").props("download")
            self._fault = ui.label().classes("fault").props('role="alert"')

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        run = self.session.document.run
        if run is None:
            return []
        return [self.session.document.part.command(run, f"{run}-object.3mf")]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, part = self.session, self.session.document.part
        ready = session.outcomes.sides is not None
        missing = "No run has a result yet."
        self._what.set_text(f"The result of {session.document.run} lies on it." if ready else missing)
        meshes = {name: name for name in OBJECTS}
        if part.mesh not in meshes:
            meshes[part.mesh] = Path(part.mesh).name
        if dict(self._mesh.options) != meshes:
            self._mesh.set_options(meshes)
        self._mesh.set_value(part.mesh)
        self._along.set_value(part.along if part.along in DIRECTIONS else "")
        self._printer.set_value(part.printer or NO_PRINTER)
        self._turn.show(part.turn_deg)
        self._mask.set_value(part.mask)
        if self._frame.props.get("src", "") != session.outcomes.part_page:
            self._frame.props["src"] = session.outcomes.part_page
        self._frame.set_visibility(bool(session.outcomes.part_page))
        self._none.set_visibility(not session.outcomes.part_page)
        idle = ready and "object" not in session.activity.under_way
        self._show.set_enabled(idle)
        self._wrap.set_enabled(idle)
        self._feel.set_enabled(idle and session.outcomes.wrapped is not None)
        shown = session.outcomes.shown_part
        self._old.set_text(OLD if shown not in (None, part) else "")
        self._told.show(session.outcomes.part_lines)
        self._written.show(session.outcomes.wrapped.lines if session.outcomes.wrapped else ())
        self._save.set_visibility(session.outcomes.wrapped is not None)
        if session.outcomes.wrapped is not None:
            self._save.props["href"] = f"/app/print/{Path(session.outcomes.wrapped.file).name}"
        self._fault.set_text(session.activity.faults.get("object", ""))

    def _other_mesh(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.change_part(mesh=str(event.value))

    def _turned_to(self, event: events.ValueChangeEventArguments) -> None:
        if event.value in DIRECTIONS:
            self.session.history.change_part(along=str(event.value))

    def _other_printer(self, event: events.ValueChangeEventArguments) -> None:
        if event.value:
            self.session.history.change_part(printer=None if event.value == NO_PRINTER else str(event.value))

    def _masked(self, event: events.ValueChangeEventArguments) -> None:
        self.session.history.change_part(mask=str(event.value or "").strip()[:LONGEST_MASK])
