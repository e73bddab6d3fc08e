"""Running: the run that is to come, the one that is under way, and the queue."""

from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError
from relief.ground.formats import RUN_CHECKPOINT
from relief.relief import Relief
from retouch.app.computing import pictures, results, touch
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import UndoHistory
from retouch.app.state.latest import Latest
from retouch.app.state.runs import Queue, QueuedRun, State
from retouch.app.values.document import AppDocument, PictureChoice
from retouch.app.values.findings import Lines
from retouch.app.values.folders import RUNS_FOLDER, next_run


class Running:
    """The runs of the app. Errors are kept in `activity.faults`.

    Attributes:
        queue: the runs.
        forecast: what the next one would take.
        best: original and best relief so far of the run under way.
    """

    def __init__(self, history: UndoHistory, activity: Activity, live: Worker, slow: Worker) -> None:
        self.queue = Queue()
        self.forecast: Lines = ()
        self._history, self._activity, self._live, self._slow = history, activity, live, slow
        self.best: Latest[tuple[Path, int], tuple[Relief, Relief]] = Latest(
            activity, "best", lambda key: live(results.best_so_far, str(key[0]))
        )
        history.follow(self._changed)

    def _changed(self, before: AppDocument, after: AppDocument) -> None:
        if before.run != after.run:
            self.best.want(None)
        if (before.picture, before.feel) != (after.picture, after.feel):
            # A forecast of another run would be taken for that of this one.
            self.forecast = ()

    def commands(self) -> list[list[str]]:
        """The commands that the next run would take, without `retouch`."""
        picture = self._history.document.picture
        if picture is None:
            return []
        folder = self._next_run(picture)
        heights = f"{folder}.png"
        return [picture.command(heights), self._history.document.feel.command(heights, str(folder))]

    def estimate(self) -> Coroutine[Any, Any, None]:
        """Ask what the next run would take; the answer is `forecast`."""
        self.forecast = ()
        return self._activity.step("run", "checking the run", self._estimate())

    async def _estimate(self) -> None:
        picture, folder = self._chosen(), self._next_run(self._chosen())
        feel = self._history.document.feel
        heights = await self._heights_of(picture, folder)
        try:
            forecast = await self._slow(touch.forecast, heights, feel, str(folder))
        finally:
            Path(heights).unlink(missing_ok=True)
        if self._history.document.feel == feel and self._history.document.picture == picture:
            self.forecast = forecast

    def start(self) -> Coroutine[Any, Any, None]:
        """Write the height map and put a run into the queue."""
        return self._activity.step("run", "writing the height map", self._start())

    async def _start(self) -> None:
        picture, folder = self._chosen(), self._next_run(self._chosen())
        feel = self._history.document.feel
        await self._heights_of(picture, folder)
        self.forecast = ()
        self.queue.jobs.append(QueuedRun(folder, feel))
        # Keeps the queue, before the command begins: an app that is killed then finds the run.
        self._history.look_at(str(folder))
        self.queue.advance()

    def _next_run(self, picture: PictureChoice) -> Path:
        """A folder for the next run, which no run of the list or on the page has, even if it was deleted."""
        known = {str(job.folder) for job in self.queue.jobs} | {self._history.document.run}
        return next_run(picture.file, known)

    def _chosen(self) -> PictureChoice:
        picture = self._history.document.picture
        if picture is None:
            raise InputError("no picture is chosen yet")
        return picture

    async def _heights_of(self, picture: PictureChoice, folder: Path) -> str:
        RUNS_FOLDER.mkdir(exist_ok=True)
        heights = f"{folder}.png"
        await self._live(pictures.save, picture, heights)
        return heights

    def shown(self) -> QueuedRun | None:
        """The run that is shown as under way: the one that runs, or else the last one looked at."""
        busy = next((job for job in self.queue.jobs if job.state.busy), None)
        run = self._history.document.run
        return busy or next((job for job in self.queue.jobs if str(job.folder) == run), None)

    def go_on(self, job: QueuedRun) -> None:
        """Go on with a run that was stopped."""
        try:
            if self.queue.under_way():
                raise InputError("another run is under way; stop it first, or wait for it")
            job.begin()
        except (InputError, OSError) as error:
            self._activity.faults["run"] = str(error)
        self._activity.notify()

    def stop(self) -> None:
        """Ask the run that is shown to stop, as Ctrl-C does."""
        job = self.shown()
        if job is not None:
            job.stop()
            self._activity.notify()

    def advance(self) -> bool:
        """Start the next run of the queue if none is under way; returns whether one was started."""
        try:
            return self.queue.advance()
        except (OSError, ValueError) as error:
            # Of a command that cannot be started; the others of the queue can.
            self._activity.faults["run"] = str(error)
            return True

    def news(self) -> list[tuple[Path, State, int]]:
        """Where the runs of the queue stand, and when their commands last said something, ns."""
        return [
            (job.folder, job.state, job.log.stat().st_mtime_ns if job.log.exists() else 0)
            for job in self.queue.jobs
        ]

    def follow(self) -> None:
        """Show the best so far of the run under way, if its checkpoint is new."""
        job = next(iter(self.queue.under_way()), None)
        if job is None:
            return
        checkpoint = job.folder / RUN_CHECKPOINT
        key = (job.folder, checkpoint.stat().st_mtime_ns) if checkpoint.is_file() else None
        self.best.want(key, topic=job.folder)
