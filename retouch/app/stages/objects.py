"""Object: the result laid over a part, shown before it is written, and its feel in colours."""

from functools import partial
from pathlib import Path

from nicegui import ui

from relief.solids.names import OBJECTS
from retouch.app.stages import controls
from retouch.app.stages.elements import DropZone
from retouch.app.stages.window import PageStage
from retouch.app.values.document import object_options
from retouch.app.values.folders import PARTS_FOLDER, SUFFIXES

OLD = "What is shown was made with other choices; Show makes it anew."


class ObjectStage(PageStage):
    """The stage on which the result is laid over an object."""

    name = "Object"

    def build_work(self) -> None:
        """Put the page about the object into the present slot."""
        self._frame = ui.element("iframe").classes("object-page")
        self._frame.props('sandbox="allow-scripts" title="the object"')
        self._none = ui.label("Show the result on an object.").classes("hint caption")

    def build_side(self) -> None:
        """Put the choices and the result into the present slot."""
        change, outcomes = self.session.history.change_part, self.session.outcomes
        with controls.section("Object"):
            self._what = ui.label().classes("hint")
            hint = "or drop one: STL, OBJ, PLY, GLB, 3MF, STEP"
            zone = DropZone("Choose a part", hint, "/app/part", SUFFIXES[PARTS_FOLDER])
            zone.on("kept", lambda event: change(mesh=str(event.args["file"])))
            self._mesh = controls.select("Object", {}, lambda mesh: change(mesh=mesh))
            self._fields = {
                name: controls.option_field(one, partial(self._chosen, name))
                for name, one in object_options().items()
            }
        with controls.section("Result"):
            with ui.element("div").classes("row-of"):
                self._show = controls.button("Show", outcomes.preview_part, "primary")
                self._wrap = controls.button("Write the file", outcomes.wrap_part)
                self._feel = controls.button("Feel in colours", outcomes.feel_part)
            self._old = ui.label().classes("hint")
            self._lines = controls.LineTable()
            self._written = controls.WrittenFile()
            self._fault = controls.fault_label()

    def commands(self) -> list[list[str]]:
        """The command that wraps, without `retouch`."""
        run = self.session.document.run
        return [] if run is None else [self.session.document.part.command(run, f"{run}-object.3mf")]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        activity, outcomes, document = self.session.activity, self.session.outcomes, self.session.document
        ready = outcomes.sides.answer is not None
        self._what.set_text(outcomes.nothing_to_show() or f"The result of {document.run} lies on it.")
        self._show_choices()
        if self._frame.props.get("src", "") != outcomes.address:
            self._frame.props["src"] = outcomes.address
        self._frame.set_visibility(outcomes.page is not None)
        self._none.set_visibility(outcomes.page is None)
        idle = ready and "object" not in activity.under_way
        self._show.set_enabled(idle)
        self._wrap.set_enabled(idle)
        self._feel.set_enabled(idle and outcomes.wrapped is not None)
        self._old.set_text(OLD if outcomes.shown_part not in (None, document.part) else "")
        self._lines.show(() if outcomes.page is None else outcomes.page.lines)
        self._written.show(outcomes.wrapped)
        self._fault.set_text(activity.faults.get("object", ""))

    def _show_choices(self) -> None:
        part = self.session.document.part
        meshes = {name: name for name in OBJECTS} | {part.mesh: Path(part.mesh).name}
        controls.offer(self._mesh, meshes, part.mesh)
        for name, one in object_options().items():
            self._fields[name].show(part.options.get(name, one.value))

    def _chosen(self, name: str, value: object) -> None:
        self.session.history.change_option(name, value)
