"""Outcomes: what the run that is looked at has made, its files for printers, and objects that carry it."""

import time
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from optimize.run_directory.key import RESULT
from relief.ground.errors import InputError
from relief.ground.formats import RUN_HEIGHTS
from retouch.app.computing import results
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import UndoHistory
from retouch.app.state.latest import Latest
from retouch.app.state.runs import finished_runs
from retouch.app.values.document import AppDocument, ObjectChoice, PrintChoice
from retouch.app.values.findings import Sides, Written

NO_RESULT = "No run has a result yet."


class Outcomes:
    """What is known of the run that is looked at. Errors are kept in `activity.faults`.

    Attributes:
        sides: original and result.
        written, wrapped: the last file for a printer, and the last object.
        page: the last page about the object.
        shown_part: that the page is about.
        address: of the page, another one each time the page is written; empty for none.
    """

    def __init__(self, history: UndoHistory, activity: Activity, live: Worker, slow: Worker) -> None:
        self.written: Written | None = None
        self.wrapped: Written | None = None
        self.page: Written | None = None
        self.shown_part: ObjectChoice | None = None
        self.address = ""
        self._history, self._activity, self._slow = history, activity, slow
        self.sides: Latest[tuple[str, tuple[int, ...]], Sides] = Latest(
            activity, "sides", lambda key: live(results.sides, key[0])
        )
        history.follow(self._changed)

    def _changed(self, before: AppDocument, after: AppDocument) -> None:
        if before.run != after.run:
            self.written = self.page = self.shown_part = None
            self.address = ""
        if (before.run, before.part) != (after.run, after.part):
            self.wrapped = None

    def want_sides(self) -> None:
        """Read original and result of the run that is looked at, if they are not known."""
        run = self._history.document.run
        written = () if run is None else _written_at(Path(run))
        if run is None or not written:
            self.sides.want(None)
        else:
            self.sides.want((run, written), "reading the run", topic=run)

    def nothing_to_show(self) -> str:
        """Why there is no original and result of the run that is looked at; empty if there is."""
        run = self._history.document.run
        if self.sides.answer is not None:
            return ""
        if fault := self._activity.faults.get(self.sides.subject):
            return fault
        if self.sides.key is not None:
            return "The run is being read."
        return f"{Path(run).name} has no result yet." if run and finished_runs() else NO_RESULT

    def _looked_at(self) -> str:
        run = self._history.document.run
        if run is None or self.sides.answer is None:
            raise InputError("no run with a result is looked at")
        return run

    def write_print(self, choice: PrintChoice) -> Coroutine[Any, Any, None]:
        """Write the result of the run that is looked at for a printer."""
        return self._activity.step("print", "writing the file", self._write_print(choice))

    async def _write_print(self, choice: PrintChoice) -> None:
        run = self._looked_at()
        self.written = None
        written = await self._slow(results.export, run, choice)
        if self._history.document.run == run:
            self.written = written

    def preview_part(self) -> Coroutine[Any, Any, None]:
        """Show the result of the run that is looked at on the object."""
        return self._activity.step("object", "wrapping few triangles", self._preview_part())

    async def _preview_part(self) -> None:
        run, part = self._looked_at(), self._history.document.part
        page = await self._slow(results.preview_object, run, part, f"{run}-object.html")
        if self._history.document.run == run:
            self._show(page, part)

    def wrap_part(self) -> Coroutine[Any, Any, None]:
        """Write the object with the result of the run."""
        doing = "wrapping the object; the preview says about how long that takes"
        return self._activity.step("object", doing, self._wrap_part())

    async def _wrap_part(self) -> None:
        run, part = self._looked_at(), self._history.document.part
        self.wrapped = None
        wrapped = await self._slow(results.wrap_object, run, part, f"{run}-object.3mf")
        if (self._history.document.run, self._history.document.part) == (run, part):
            self.wrapped = wrapped

    def feel_part(self) -> Coroutine[Any, Any, None]:
        """Show the roughness of the wrapped object in colours."""
        return self._activity.step("object", "pressing fingers all over the object", self._feel_part())

    async def _feel_part(self) -> None:
        wrapped, part, skin = self.wrapped, self._history.document.part, self._history.document.feel.skin
        if wrapped is None:
            raise InputError("the object is not wrapped yet")
        page = await self._slow(results.feel_object, wrapped.file, part.mesh, skin)
        if self.wrapped is wrapped:
            self._show(page, part)

    def _show(self, page: Written, part: ObjectChoice) -> None:
        self.page, self.shown_part = page, part
        # The time, so that a page of the same name is loaded again.
        self.address = f"/app/page/{Path(page.file).name}?{time.time_ns()}"


def _written_at(run: Path) -> tuple[int, ...]:
    """When the heights of a run and its numbers were written, ns; none without heights.

    The numbers come a little later.
    """
    files = [file for file in (run / RUN_HEIGHTS, run / RESULT) if file.is_file()]
    return tuple(file.stat().st_mtime_ns for file in files) if run / RUN_HEIGHTS in files else ()
