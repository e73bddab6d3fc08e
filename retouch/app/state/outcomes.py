"""Outcomes: what the run that is looked at has made, its files for printers, and objects that carry it."""

from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from optimize.run_directory.key import RESULT
from relief.ground.errors import InputError
from relief.ground.formats import RUN_HEIGHTS
from retouch.app.computing import results
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import History
from retouch.app.values.document import Document, Part
from retouch.app.values.findings import Lines, Sides, Written


class Outcomes:
    """What is known of the run that is looked at.

    Attributes:
        sides: original and result; None until there is a result.
        written, wrapped: the last file for a printer, and the last object.
        part_page, part_lines: address of the page about the object, and what it tells.
        shown_part: that the page is about.
    """

    def __init__(self, history: History, activity: Activity, live: Worker, slow: Worker) -> None:
        self.sides: Sides | None = None
        self.written: Written | None = None
        self.wrapped: Written | None = None
        self.part_page = ""
        self.part_lines: Lines = ()
        self.shown_part: Part | None = None
        self._history, self._activity, self._live, self._slow = history, activity, live, slow
        self._pages = 0
        self._sides_of: tuple[str | None, tuple[int, ...]] = (None, ())
        history.follow(self._changed)

    def _changed(self, before: Document, after: Document) -> None:
        if before.run != after.run:
            self.written = self.shown_part = None
            self.part_page, self.part_lines = "", ()
        if (before.run, before.part) != (after.run, after.part):
            self.wrapped = None

    def want_sides(self) -> None:
        """Read original and result of the run that is looked at, if they are not known."""
        run = self._history.document.run
        stamps = () if run is None else _written_at(Path(run))
        if self._sides_of == (run, stamps) or "sides" in self._activity.under_way:
            return
        if self._sides_of[0] != run or not stamps:
            self.sides = None
        self._sides_of = (run, stamps)
        if run is not None and stamps:
            work = self._read_sides(run)
            self._activity.in_background(self._activity.step("sides", "reading the run", work))

    async def _read_sides(self, run: str) -> None:
        sides = await self._live(results.sides, run)
        if self._history.document.run == run:
            self.sides = sides

    def _looked_at(self) -> str:
        run = self._history.document.run
        if run is None or self.sides is None:
            raise InputError("no run with a result is looked at")
        return run

    def write_print(
        self, suffix: str, base_mm: float | None, repeat: int, printer: str | None
    ) -> Coroutine[Any, Any, None]:
        """Write the result of the run that is looked at for a printer; what hinders is a fault."""
        work = self._write_print(suffix, base_mm, repeat, printer)
        return self._activity.step("print", "writing the file", work)

    async def _write_print(
        self, suffix: str, base_mm: float | None, repeat: int, printer: str | None
    ) -> None:
        run = self._looked_at()
        self.written = None
        out = f"{run}-print{suffix}"
        written = await self._slow(results.export, run, out, base_mm, repeat, printer)
        if self._history.document.run == run:
            self.written = written

    def preview_part(self) -> Coroutine[Any, Any, None]:
        """Show the result of the run that is looked at on the object; what hinders is a fault."""
        return self._activity.step("object", "wrapping few triangles", self._preview_part())

    async def _preview_part(self) -> None:
        run, part = self._looked_at(), self._history.document.part
        page = f"{run}-object.html"
        lines = await self._slow(results.preview_object, run, part, page)
        if self._history.document.run == run:
            self._show_part(part, page, lines)

    def wrap_part(self) -> Coroutine[Any, Any, None]:
        """Write the object with the result of the run; what hinders is a fault."""
        told = "wrapping the object; the preview told about how long"
        return self._activity.step("object", told, self._wrap_part())

    async def _wrap_part(self) -> None:
        run, part = self._looked_at(), self._history.document.part
        self.wrapped = None
        wrapped = await self._slow(results.wrap_object, run, part, f"{run}-object.3mf")
        if (self._history.document.run, self._history.document.part) == (run, part):
            self.wrapped = wrapped

    def feel_part(self) -> Coroutine[Any, Any, None]:
        """Show the roughness of the wrapped object in colours; what hinders is a fault."""
        return self._activity.step("object", "pressing fingers all over the object", self._feel_part())

    async def _feel_part(self) -> None:
        wrapped, part, skin = self.wrapped, self._history.document.part, self._history.document.feel.skin
        if wrapped is None:
            raise InputError("the object is not wrapped yet")
        made = await self._slow(results.feel_object, wrapped.file, part.mesh, skin)
        if self.wrapped is wrapped:
            self._show_part(part, *made)

    def _show_part(self, part: Part, page: str, lines: Lines) -> None:
        self._pages += 1
        self.shown_part = part
        # A number, so that a page of the same name is loaded again.
        self.part_page, self.part_lines = f"/app/page/{Path(page).name}?{self._pages}", lines


def _written_at(run: Path) -> tuple[int, ...]:
    """When the heights of a run and its numbers were written, ns; none without heights.

    The numbers come a little later.
    """
    files = [file for file in (run / RUN_HEIGHTS, run / RESULT) if file.is_file()]
    return tuple(file.stat().st_mtime_ns for file in files) if run / RUN_HEIGHTS in files else ()
