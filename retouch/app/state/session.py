"""Session: the document that is being made, what is known of it, and who is told when either changes.

There is one session for one start of the app. Every window shows this session: what is changed in one is seen
in all, and a window that is closed or loaded again loses nothing. The document and the queue are kept in a
file as well, so that the next start goes on with them.
"""

import asyncio
import hashlib
import json
import logging
import time
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from relief.common.errors import InputError
from relief.common.files import read_limited, write_atomically
from relief.common.formats import RUN_CHECKPOINT, RUN_HEIGHTS
from retouch.app.state import measuring
from retouch.app.state.document import Document, Feel, Picture
from retouch.app.state.folders import PICTURES_FOLDER, RUNS_FOLDER, UNUSUAL, next_run, textures
from retouch.app.state.measuring import FeltPlaces, Reachable, Shape, Sides, Source, Written
from retouch.app.state.runs import Job, Queue, State
from retouch.app.state.workers import Superseded, Worker

_log = logging.getLogger(__name__)

FIRST_TEXTURE = "gravel"
"""Bundled texture that is shown where no picture was chosen yet."""
ONE_CHANGE_S = 0.7
"""Changes that follow one another faster, as those of a slider, are undone together, s."""
ORDER = ("object", "print", "run", "sides", "picture", "paint", "numbers", "reach")
"""Subjects of what is under way, those first that a person waits for."""
MOST_UNDONE = 50
"""Steps that can be undone."""
PLACES_AT_ONCE = 4
"""Places that are pressed in one go: a fifth of a second, the longest wait of the next change."""
KEPT = RUNS_FOLDER / "app.json"
"""File that keeps the document and the queue."""
LARGEST_KEPT = 1 << 20
"""Most bytes of this file; a thousand times the usual."""


class Session:
    """The state of the app.

    Attributes:
        document: what is chosen.
        source, shape, felt_here, felt: of the picture; None until known.
        scale: roughness of the bundled textures, by name.
        reach: how far the feel can change; None until known.
        forecast: what a run would take, a word and a sentence each.
        best, run_original: of the run that is shown, while it is under way.
        sides: original and result of the run that is looked at.
        written, wrapped: the last file for a printer, and the last object.
        part_page, part_lines: address of the page about the object, and what it tells.
        queue: the runs.
        faults: what is wrong, a line for each subject.
        under_way: what is being computed, by subject.
    """

    def __init__(self) -> None:
        self.document = Document()
        self.source: Source | None = None
        self.shape: Shape | None = None
        self.felt_here: FeltPlaces | None = None
        self.felt: FeltPlaces | None = None
        self.scale: dict[str, float] = {}
        self.reach: Reachable | None = None
        self.forecast: list[tuple[str, str]] = []
        self.best: Shape | None = None
        self.run_original: Shape | None = None
        self.sides: Sides | None = None
        self.written: Written | None = None
        self.wrapped: Written | None = None
        self.part_page = ""
        self.part_lines: tuple[tuple[str, str], ...] = ()
        self._pages = 0
        self.queue = Queue()
        self.faults: dict[str, str] = {}
        self.under_way: dict[str, str] = {}
        # What follows the hand, what a person waits for, and what nobody waits for.
        self.live, self.slow, self.idle = Worker(), Worker(), Worker()
        self._listeners: list[Callable[[], None]] = []
        self._sources: dict[str, Source] = {}
        self._undo: list[Document] = []
        self._changed_at = 0.0
        self._following: asyncio.Task[None] | None = None
        self._again = False
        self._tasks: set[asyncio.Task[Any]] = set()
        self._seen: tuple[list[Any], str] = ([], "")
        self._best_of: tuple[str, int] | None = None
        self._sides_of: tuple[str | None, int | None] = (None, None)
        self._scale_of: str | None = None
        self._scale_found: dict[str, float] = {}
        self._reach_of: tuple[Picture | None, str] | None = None

    def open(self, picture: str | None) -> None:
        """Take up what was chosen last, and let the worker begin with the picture that is to be shown.

        Args:
            picture: that is chosen now; None: the last one.
        """
        self.restore()
        last = self.document.picture
        self.live.begin(measuring.warm, picture or (FIRST_TEXTURE if last is None else last.file))

    # Who is told.

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after every change; returns the function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def tell(self) -> None:
        """Tell the listeners that something has changed."""
        for listener in list(self._listeners):
            listener()

    # What is changed.

    def change(self, document: Document, undoable: bool = True) -> None:
        """Take another document, and compute what follows from it."""
        before = self.document
        if document == before:
            return
        now = time.monotonic()
        if undoable and now - self._changed_at > ONE_CHANGE_S:
            self._undo = [*self._undo, before][-MOST_UNDONE:]
        self._changed_at = now
        self.document = document
        self._keep()
        if document.picture != before.picture:
            file = None if document.picture is None else document.picture.file
            if before.picture is None or before.picture.file != file:
                self.source = self._sources.get(file or "")
            self.follow()
        if document.feel.skin != before.feel.skin:
            self.follow()
        if document.run != before.run:
            self.best = self.run_original = self.written = self.wrapped = None
            self.part_page, self.part_lines = "", ()
        self.tell()

    def change_picture(self, **fields: Any) -> None:
        """Change fields of the picture."""
        if self.document.picture is not None:
            self.change(replace(self.document, picture=replace(self.document.picture, **fields)))

    def change_feel(self, **fields: Any) -> None:
        """Change fields of the feel."""
        self.change(replace(self.document, feel=replace(self.document.feel, **fields)))

    def undo(self) -> None:
        """Go back to the document before the last change."""
        if self._undo:
            self.change(self._undo.pop(), undoable=False)

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return bool(self._undo)

    async def choose(self, file: str) -> None:
        """Begin with a picture, or a bundled texture by its name."""
        self.under_way["picture"] = f"reading {Path(file).name}"
        self.tell()
        try:
            source = await self.live(measuring.source, file)
        except (InputError, OSError) as error:
            self.faults["picture"] = str(error)
        else:
            self._sources = {file: source}
            picture = Picture(file, relief_mm=source.relief_mm, size_mm=source.size_mm)
            self.faults.pop("picture", None)
            feel = replace(self.document.feel, region=None)
            first = self.document.picture is None
            self.change(replace(self.document, picture=picture, feel=feel), undoable=not first)
            if self.shape is None:
                # The picture of the last start, chosen again.
                self.follow()
        finally:
            self.under_way.pop("picture", None)
            self.tell()

    # What is computed.

    def in_background(self, work: Coroutine[Any, Any, Any]) -> None:
        """Let a computation go on by itself."""
        task = asyncio.ensure_future(work)
        # The loop itself keeps weak references only.
        self._tasks.add(task)
        task.add_done_callback(self._over)

    def _over(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("a computation for the page has failed", exc_info=task.exception())
            self.faults["kept"] = f"{type(task.exception()).__name__}: {task.exception()}"
            self.tell()

    def follow(self) -> None:
        """Compute heights and feel of the document anew; a computation under way begins again when it can."""
        self._again = True
        self.felt = None
        self.under_way["numbers"] = "pressing"
        if self._following is None or self._following.done():
            self._following = asyncio.ensure_future(self._compute())
            self._following.add_done_callback(self._over)

    async def _compute(self) -> None:
        while self._again:
            self._again = False
            picture, skin = self.document.picture, self.document.feel.skin
            if picture is None:
                return
            await self._guarded("numbers", self._numbers(picture, skin))
            if not self._again:
                self.under_way.pop("numbers", None)
            self.tell()

    async def _numbers(self, picture: Picture, skin: str) -> None:
        if self.source is None:
            self.source = await self.live(measuring.source, picture.file)
        self.shape = await self.live(measuring.shape, picture)
        self.tell()
        shape = self.shape
        self.felt_here = await self.live(measuring.felt, shape, skin)
        self.tell()
        await self._all_over(shape, skin)
        await self._scale(skin)

    async def _all_over(self, shape: Shape, skin: str) -> None:
        """Press all over, in parts, so that the next change need not wait."""
        count, felt = await self.live(measuring.count_places, shape), FeltPlaces()
        for first in range(0, count, PLACES_AT_ONCE):
            if self._again:
                return
            part = slice(first, first + PLACES_AT_ONCE)
            felt += await self.live(measuring.felt, shape, skin, part)
        self.felt = felt
        self.tell()

    async def _scale(self, skin: str) -> None:
        """Press the bundled textures with the finger, one by one for the same reason."""
        if self._scale_of != skin:
            self._scale_of, self._scale_found = skin, {}
        for name in textures():
            if self._again:
                return
            if name not in self._scale_found:
                self._scale_found[name] = await self.live(measuring.texture_roughness, name, skin)
        self.scale = dict(sorted(self._scale_found.items(), key=lambda item: item[1]))

    async def _guarded(self, subject: str, work: Awaitable[None]) -> None:
        """Do work whose failure is a line about the subject."""
        try:
            await work
        except (InputError, OSError, ArithmeticError) as error:
            self.faults[subject] = str(error)
        except Exception as error:
            # Of the models: a contact that does not converge, for one.
            _log.info("%s", subject, exc_info=error)
            self.faults[subject] = f"{type(error).__name__}: {error}"
        else:
            self.faults.pop(subject, None)

    def want_reach(self) -> None:
        """Compute in the background how far the feel can change, if that is not known."""
        asked = (self.document.picture, self.document.feel.skin)
        unready = self.felt is None or self.under_way.keys() & {"numbers", "picture"}
        if self.shape is None or unready or self._reach_of == asked or self.queue.under_way():
            return
        self.forget_reach()
        self._reach_of = asked
        self.under_way["reach"] = "estimating how far the feel can change"
        self.in_background(self._guarded("reach", self._reach(self.shape, asked[1])))
        self.tell()

    async def _reach(self, shape: Shape, skin: str) -> None:
        asked = self._reach_of
        try:
            found = await self.idle(measuring.reach, shape, skin)
        except Superseded:
            return
        finally:
            if self._reach_of == asked:
                self.under_way.pop("reach", None)
                self.tell()
        self.reach = found
        self.tell()

    def forget_reach(self) -> None:
        """End the estimate of how far the feel can change: it is of another picture, or in the way."""
        self.reach = self._reach_of = None
        if self.under_way.pop("reach", None):
            self.idle.close()

    # Runs.

    def goal_told(self) -> str:
        """What the next run is to reach, in a sentence."""
        feel = self.document.feel
        if feel.goal == "feel_of":
            goal = f"As rough as {feel.feel_of}"
        elif feel.goal == "jnd":
            goal = f"{abs(feel.jnd):g} JND {'rougher' if feel.jnd > 0 else 'smoother'} than the original"
        else:
            goal = f"{feel.contact_area_scale:g} of the original's contact area"
        where = "all over" if feel.region is None or feel.goal == "feel_of" else "where it is painted"
        return f"{goal}, {where}, to the finger {feel.skin}."

    async def estimate(self) -> None:
        """Ask what a run with this document would take; the answer is `forecast`, or a fault."""
        self.forecast = []
        await self._step("run", "checking the run", self._estimate())

    async def _estimate(self) -> None:
        picture, folder = self._chosen(), next_run(self._chosen().file)
        heights = await self._heights_of_run(picture, folder)
        try:
            self.forecast = await self.slow(measuring.forecast, heights, self.document.feel, str(folder))
        finally:
            Path(heights).unlink(missing_ok=True)

    async def start_run(self) -> None:
        """Write the height map and put a run into the queue; what hinders is a fault."""
        await self._step("run", "writing the height map", self._start_run())

    async def _start_run(self) -> None:
        picture, folder = self._chosen(), next_run(self._chosen().file)
        await self._heights_of_run(picture, folder)
        self.forecast = []
        self.forget_reach()
        self.queue.add(Job(folder, self.document.feel))
        self.change(replace(self.document, run=str(folder)), undoable=False)
        self._keep()

    async def _step(self, subject: str, told: str, work: Coroutine[Any, Any, None]) -> None:
        """Do what a person has asked for, told while it goes on; a failure is a fault of the subject."""
        if subject in self.under_way:
            work.close()
            return
        self.under_way[subject] = told
        self.tell()
        try:
            await self._guarded(subject, work)
        finally:
            self.under_way.pop(subject, None)
            self.tell()

    def shown_job(self) -> Job | None:
        """The run that is shown as under way: the one that runs, or else the last one looked at."""
        busy = next((job for job in self.queue.jobs if job.state.busy), None)
        chosen = next((job for job in self.queue.jobs if str(job.folder) == self.document.run), None)
        return busy or chosen

    def go_on(self, job: Job) -> None:
        """Go on with a run that was stopped."""
        try:
            if self.queue.under_way():
                raise InputError("another run is under way; stop it first, or wait for it")
            job.begin()
        except (InputError, OSError) as error:
            self.faults["run"] = str(error)
        self.tell()

    def drop(self, job: Job) -> None:
        """Take a run from the list; its files stay."""
        self.queue.remove(job)
        self._keep()
        self.tell()

    def look_at(self, folder: str) -> None:
        """Look at a run: its original and its result, if there is one."""
        self.change(replace(self.document, run=folder), undoable=False)
        self.want_sides()

    def want_sides(self) -> None:
        """Read original and result of the run that is looked at, if they are not known."""
        run = self.document.run
        result = None if run is None else Path(run) / RUN_HEIGHTS
        stamp = result.stat().st_mtime_ns if result is not None and result.is_file() else None
        if self._sides_of == (run, stamp) or "sides" in self.under_way:
            return
        self._sides_of, self.sides = (run, stamp), None
        if run is not None and stamp is not None:
            self.in_background(self._step("sides", "reading the run", self._read_sides(run)))

    async def _read_sides(self, run: str) -> None:
        self.sides = await self.live(measuring.sides, run, self.document.feel.skin)

    async def write_print(self, suffix: str, base_mm: float | None, repeat: int, printer: str | None) -> None:
        """Write the result of the run that is looked at for a printer; what hinders is a fault."""
        await self._step("print", "writing the file", self._write_print(suffix, base_mm, repeat, printer))

    async def _write_print(
        self, suffix: str, base_mm: float | None, repeat: int, printer: str | None
    ) -> None:
        run = self._looked_at()
        self.written = None
        self.written = await self.slow(
            measuring.export, run, f"{run}-print{suffix}", base_mm, repeat, printer
        )

    async def preview_part(self) -> None:
        """Show the result of the run that is looked at on the object; what hinders is a fault."""
        await self._step("object", "wrapping few triangles", self._preview_part())

    async def _preview_part(self) -> None:
        run, part = self._looked_at(), self.document.part
        page = f"{run}-object.html"
        self.part_lines = await self.slow(measuring.preview_object, run, part, page)
        self._show_part(page)

    async def wrap_part(self) -> None:
        """Write the object with the result of the run; what hinders is a fault."""
        await self._step("object", "wrapping the object; the preview told about how long", self._wrap_part())

    async def _wrap_part(self) -> None:
        run, part = self._looked_at(), self.document.part
        self.wrapped = None
        self.wrapped = await self.slow(measuring.wrap_object, run, part, f"{run}-object.3mf")

    async def feel_part(self) -> None:
        """Show the roughness of the wrapped object in colours; what hinders is a fault."""
        await self._step("object", "pressing fingers all over the object", self._feel_part())

    async def _feel_part(self) -> None:
        if self.wrapped is None:
            raise InputError("the object is not wrapped yet")
        mesh, skin = self.document.part.mesh, self.document.feel.skin
        page, self.part_lines = await self.slow(measuring.feel_object, self.wrapped.file, mesh, skin)
        self._show_part(page)

    def _show_part(self, page: str) -> None:
        self._pages += 1
        # A number, so that a page of the same name is loaded again.
        self.part_page = f"/app/page/{Path(page).name}?{self._pages}"

    def _looked_at(self) -> str:
        if self.document.run is None or self.sides is None:
            raise InputError("no run with a result is looked at")
        return self.document.run

    def change_part(self, **fields: Any) -> None:
        """Change fields of the object."""
        self.change(replace(self.document, part=replace(self.document.part, **fields)))

    async def paint(self, mask: bytes) -> None:
        """Take a painted mask as the region where the feel changes."""
        await self._step("paint", "keeping the mask", self._paint(mask))

    async def _paint(self, mask: bytes) -> None:
        name = hashlib.sha256(mask).hexdigest()[:12]
        file = PICTURES_FOLDER / f"mask-{name}.png"
        painted = await self.live(measuring.save_mask, mask, str(file))
        self.change_feel(region=str(file) if painted else None)

    def planned(self) -> list[list[str]]:
        """The commands that a run would take, without `retouch`."""
        picture = self.document.picture
        if picture is None:
            return []
        folder = next_run(picture.file)
        heights = f"{folder}.png"
        return [picture.command(heights), self.document.feel.command(heights, str(folder))]

    def _chosen(self) -> Picture:
        if self.document.picture is None:
            raise InputError("no picture is chosen yet")
        return self.document.picture

    async def _heights_of_run(self, picture: Picture, folder: Path) -> str:
        RUNS_FOLDER.mkdir(exist_ok=True)
        heights = f"{folder}.png"
        await self.live(measuring.save, picture, heights)
        return heights

    def advance(self) -> None:
        """Start the next run of the queue if none is under way."""
        try:
            started = self.queue.advance()
        except OSError as error:
            self.faults["run"] = str(error)
            started = True
        if started:
            self._keep()
            self.tell()

    def doing(self) -> str:
        """What is being computed, and how far it is; empty if nothing is."""
        subject = next((one for one in ORDER if one in self.under_way), None)
        if subject is None:
            return next(iter(self.under_way.values()), "")
        told = {"reach": self.idle.told, "numbers": ""}.get(subject, self.slow.told)
        return f"{self.under_way[subject]}: {told}" if told else self.under_way[subject]

    def fault(self) -> str:
        """What is wrong beside the subjects of the stages."""
        return next((self.faults[one] for one in ("kept", "best", "paint") if one in self.faults), "")

    def look(self) -> None:
        """Look at the runs, start the next one, and tell the windows if there is news."""
        self.advance()
        now = [
            (job.folder, job.state, job.log.stat().st_mtime_ns if job.log.exists() else 0)
            for job in self.queue.jobs
        ]
        seen = (now, self.doing())
        if seen != self._seen:
            self._seen = seen
            self._follow_run()
            self.want_sides()
            self.tell()

    def _follow_run(self) -> None:
        """Show the best so far of the run under way, if its checkpoint is new."""
        job = next(iter(self.queue.under_way()), None)
        checkpoint = None if job is None else job.folder / RUN_CHECKPOINT
        if job is None or checkpoint is None or not checkpoint.is_file() or "best" in self.under_way:
            return
        stamp = (str(job.folder), checkpoint.stat().st_mtime_ns)
        if stamp != self._best_of:
            self._best_of = stamp
            self.in_background(self._guarded("best", self._best_so_far(job)))

    async def _best_so_far(self, job: Job) -> None:
        found = await self.live(measuring.best_so_far, str(job.folder), str(job.heights))
        self.run_original, self.best = found
        self.tell()

    # What is kept.

    def _keep(self) -> None:
        waiting = [job for job in self.queue.jobs if job.state is not State.DONE]
        content = {
            "document": asdict(self.document),
            "queue": [{"folder": str(job.folder), "feel": asdict(job.feel)} for job in waiting],
        }
        try:
            write_atomically(KEPT, json.dumps(content, indent=1).encode())
            self.faults.pop("kept", None)
        except OSError as error:
            self.faults["kept"] = f"what is chosen cannot be kept: {error.strerror}: {KEPT}"

    def restore(self) -> None:
        """Take up the document and the queue of the last start, as far as the file holds them."""
        if not KEPT.is_file():
            return
        try:
            content = json.loads(read_limited(KEPT, LARGEST_KEPT))
            self.document = TypeAdapter(Document).validate_python(content["document"])
            for entry in content["queue"]:
                self.queue.jobs.append(_job(entry))
        except (InputError, ValidationError, ValueError, TypeError, LookupError, RecursionError) as error:
            _log.warning("%s: not read, the app begins anew: %s", KEPT, type(error).__name__)
            self.document, self.queue = Document(), Queue()

    def close(self) -> None:
        """End the workers."""
        for worker in (self.live, self.slow, self.idle):
            worker.close()


def _job(entry: Any) -> Job:
    """A run of the kept queue. Raises ValueError or a LookupError."""
    folder, feel = Path(entry["folder"]), TypeAdapter(Feel).validate_python(entry["feel"])
    if folder.parent != RUNS_FOLDER or UNUSUAL.search(folder.name) or folder.name.startswith("."):
        raise ValueError(f"{folder}: not a run of the app")
    return Job(folder, feel)
