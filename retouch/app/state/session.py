"""Session: the document that is being made, and everything that is known of it.

There is one session for one start of the app. Every window shows this session: what is changed in one is seen
in all, and a window that is closed or loaded again loses nothing. The document and the queue are kept in a
file as well, so that the next start goes on with them.
"""

import asyncio
import hashlib
import itertools
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from relief.ground.files import only_writer
from retouch.app.computing import pictures
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.drafts import Drafts
from retouch.app.state.history import UndoHistory
from retouch.app.state.kept import KEPT, read_kept, write_kept
from retouch.app.state.latest import Latest
from retouch.app.state.numbers import Numbers
from retouch.app.state.outcomes import Outcomes
from retouch.app.state.running import Running
from retouch.app.state.runs import QueuedRun, State
from retouch.app.values.document import AppDocument
from retouch.app.values.folders import PICTURES_FOLDER, RUNS_FOLDER, with_plain_name

OPEN = "the app is open in this folder already; go on in its page, or close it first"
FIRST_TEXTURE = "gravel"
"""Bundled texture that is shown where no picture was chosen yet."""
ORDER = ("object", "print", "run", "sides", "picture", "paint", "draft", "numbers", "reach")
"""Subjects of what is under way, those first that a person waits for."""


class Session:
    """The state of the app.

    Attributes:
        activity: what is under way, and what has gone wrong.
        history: the document, and its earlier states.
        numbers: heights and feel of the picture.
        drafts: what the feel that is chosen would make of it.
        running: the runs.
        outcomes: what the run that is looked at has made.

    Errors are kept in `activity.faults`.
    """

    def __init__(self) -> None:
        # What follows the hand, what a person waits for, and what nobody waits for.
        self._live, self._slow, self._idle = Worker(), Worker(), Worker()
        self.activity, self.history = Activity(), UndoHistory()
        self.numbers = Numbers(self.history, self.activity, self._live, self._idle)
        self.drafts = Drafts(self.history, self.activity, self.numbers, self._slow)
        self.running = Running(self.history, self.activity, self._live, self._slow)
        self.outcomes = Outcomes(self.history, self.activity, self._live, self._slow)
        self._choosing = Latest(self.activity, "picture", self._choose)
        self._choices = itertools.count()
        self._painting = asyncio.Lock()
        self._seen: tuple[list[Any], str] = ([], "")
        self.history.follow(self._changed)

    @property
    def document(self) -> AppDocument:
        """What is chosen."""
        return self.history.document

    def _changed(self, before: AppDocument, after: AppDocument) -> None:
        self._keep()
        if before.run != after.run:
            self.outcomes.want_sides()
        self.activity.notify()

    @contextmanager
    def opened(self, picture: Path | None) -> Iterator[str | None]:
        """Keep the folder to this session until the block ends: two would overwrite what each other keeps.

        What was chosen last is taken up, and the worker begins with the picture that is to be shown.

        Args:
            picture: that is chosen now; None: the last one.

        Yields:
            The picture that is chosen now, under a name that the page can show.

        Raises:
            InputError: another app is open in the folder, or as of `with_plain_name`.
            OSError: as of `with_plain_name` and `restore`.
        """
        with only_writer(RUNS_FOLDER, OPEN), closing(self):
            chosen = None if picture is None else str(with_plain_name(picture))
            self.restore()
            last = self.document.picture if chosen is None else None
            self._live.begin(pictures.warm, chosen or FIRST_TEXTURE, last)
            yield chosen

    async def choose(self, file: str) -> None:
        """Begin with a picture, or a bundled texture by its name; of several, with the last one."""
        self._choosing.want((file, next(self._choices)), f"reading {Path(file).name}")
        await self._choosing.finished()

    async def _choose(self, key: tuple[str, int]) -> None:
        source = await self._live(pictures.source, key[0])
        self._choosing.check()
        self.numbers.opened = source
        feel = replace(self.document.feel, region=None)
        first = self.document.picture is None
        self.history.change(replace(self.document, picture=source.picture, feel=feel), undoable=not first)
        if self.numbers.relief is None:
            # The picture of the last start, chosen again.
            self.numbers.follow(anew=True)

    async def paint(self, mask: bytes) -> None:
        """Take a painted mask as the region where the feel changes; masks are taken in their order."""
        async with self._painting:
            await self.activity.step("paint", "keeping the mask", self._paint(mask))

    async def _paint(self, mask: bytes) -> None:
        name = hashlib.sha256(mask).hexdigest()[:12]
        file = PICTURES_FOLDER / f"mask-{name}.png"
        painted = await self._live(pictures.save_mask, mask, str(file))
        self.history.change_feel(region=str(file) if painted else None)

    async def start_run(self) -> None:
        """Start a run with this document, after those that wait."""
        self.numbers.forget_reach()
        await self.running.start()

    def go_on(self, job: QueuedRun) -> None:
        """Go on with a run that was stopped."""
        self.numbers.forget_reach()
        self.running.go_on(job)

    def drop(self, job: QueuedRun) -> None:
        """Take a run from the list; its files stay."""
        self.running.queue.remove(job)
        self._keep()
        self.activity.notify()

    def want_reach(self) -> None:
        """Estimate in the background how far the feel can change, unless others have the cores or begin."""
        busy = self.drafts.busy or self.running.queue.under_way() or "run" in self.activity.under_way
        if not busy:
            self.numbers.want_reach()

    def look(self) -> None:
        """Look at the runs, start the next one, and notify the windows of news."""
        if self.running.advance():
            self.numbers.forget_reach()
            self._keep()
            self.activity.notify()
        seen = (self.running.news(), self.doing())
        if seen != self._seen:
            self._seen = seen
            self.running.follow()
            self.outcomes.want_sides()
            self.activity.notify()

    def doing(self) -> str:
        """What is being computed, and how far it is; empty if nothing is."""
        under_way = self.activity.under_way
        subject = next((one for one in ORDER if one in under_way), None)
        if subject is None:
            return next(iter(under_way.values()), "")
        live = {"reach": self._idle.progress, "numbers": "", "draft": ""}
        progress = live.get(subject, self._slow.progress)
        return f"{under_way[subject]}: {progress}" if progress else under_way[subject]

    def fault(self) -> str:
        """What is wrong beside the subjects of the stages."""
        faults = self.activity.faults
        return next((faults[one] for one in ("kept", "best", "paint", "unread") if one in faults), "")

    def _keep(self) -> None:
        jobs = [job for job in self.running.queue.jobs if job.state is not State.DONE]
        try:
            write_kept(self.document, jobs)
            self.activity.faults.pop("kept", None)
        except OSError as error:
            self.activity.faults["kept"] = f"what is chosen cannot be kept: {error.strerror}: {KEPT}"

    def restore(self) -> None:
        """Take up document and queue of the last start, as far as they can be read. Raises OSError."""
        self.history.document, self.running.queue.jobs, unread = read_kept()
        if unread:
            self.activity.faults["unread"] = unread
            self._keep()

    def close(self) -> None:
        """End the workers."""
        for worker in (self._live, self._slow, self._idle):
            worker.close()
