"""Display of progress: a moving line on a terminal, lines in a file or pipe, a bar in a notebook.

A stage is shown when it has lasted two seconds. A thread looks at the clock, because a stage that is one
long call says nothing by itself.
"""

import html
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from relief.ground import progress as stages
from relief.ground.formatting import duration, plain
from relief.ground.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console
    from rich.segment import Segment

PATIENCE_S = 2.0
"""Seconds that a stage may last without being shown: so long a person waits without wondering."""
PERIOD_S = 10.0
"""Seconds between two lines about one stage in a file or pipe."""
LEAST_S = 1.0
"""Seconds that a stage must have lasted before its pace says anything about the rest."""
TICK_S = 0.2
"""Seconds between two looks at the clock."""


class Display(Protocol):
    """Where progress is shown."""

    def show(self, now: "Shown | None") -> None:
        """Called every `TICK_S` seconds with what is under way; None if nothing has lasted long."""

    def line(self, detail: str) -> None:
        """Called with a line about a step that is done."""

    def say(self, line: str) -> None:
        """Called with a line that stays."""


class Shown(NamedTuple):
    """What is to be seen of the stages under way: a sentence, the outermost stage's number, a fraction."""

    text: str
    stage: int
    fraction: float | None


@contextmanager
def shown(quiet: bool = False) -> Iterator[None]:
    """Show the stages of the block on stderr, unless it is to be quiet or somebody listens already."""
    if quiet or stages.has_listener():
        yield
        return
    with _watched(_Terminal() if sys.stderr.isatty() else _Pipe()):
        yield


def followed(callback: Callable[[Progress], None] | None, quiet: bool | None) -> Any:
    """A context whose stages are reported to a callback, or shown: with `quiet` None in notebooks only."""
    if callback is not None:
        return stages.progress(callback)
    if quiet is not None or stages.has_listener():
        return shown(quiet is not False)
    return _watched(_Notebook()) if _in_notebook() else nullcontext()


@contextmanager
def _watched(display: Display) -> Iterator[None]:
    watch = _Watch(display)
    thread = threading.Thread(target=watch.run, name="progress", daemon=True)
    thread.start()
    try:
        with stages.listening(watch):
            yield
    finally:
        watch.over.set()
        thread.join()
        display.show(None)


class _Watch:
    """Listener that knows the stages under way, and shows those that last."""

    def __init__(self, display: Display) -> None:
        self.over = threading.Event()
        self._display = display
        # Reentrant: an interrupt may say its line while a stage reports.
        self._lock = threading.RLock()
        self._under_way: list[tuple[Progress, float, int]] = []
        self._count = 0
        self._said: set[str] = set()

    def report(self, progress: Progress) -> None:
        with self._lock:
            earlier = self._under_way[progress.level :]
            del self._under_way[progress.level :]
            if progress.detail and (not earlier or progress.detail != earlier[0][0].detail):
                self._display.line(progress.detail + _rest(progress))
            if not progress.ended:
                self._count += not earlier
                number = earlier[0][2] if earlier else self._count
                self._under_way.append((progress, time.monotonic() - progress.seconds, number))
            elif not self._under_way:
                # At once, because results may be printed next.
                self._display.show(None)

    def say(self, line: str) -> None:
        # Once, as a verb may read a file several times.
        with self._lock:
            if line not in self._said:
                self._said.add(line)
                self._display.say(line)

    def run(self) -> None:
        """Show what is under way until `over` is set."""
        while not self.over.wait(TICK_S):
            # A closed stderr must not end what is being shown.
            with self._lock, suppress(OSError):
                self._display.show(self._shown(time.monotonic()))

    def _shown(self, now: float) -> Shown | None:
        lasting = [one for one in self._under_way if now - one[1] >= PATIENCE_S]
        if not lasting:
            return None
        phrases, estimated = [], False
        for progress, began, _ in lasting:
            # The rest of the outermost stage that knows it, beside its name: the rest of no other stage.
            rest = "" if estimated else _rest(progress, now - began - progress.seconds)
            estimated = estimated or bool(rest)
            phrases.append(f"{progress.detail or progress.stage}{done_of(progress)}{rest}")
        text = ": ".join(phrases)
        if not estimated:
            text += f", {_time(now - lasting[0][1])} so far"
        fractions = [progress.fraction for progress, *_ in lasting if progress.fraction is not None]
        return Shown(text, lasting[0][2], fractions[0] if fractions else None)


def done_of(progress: Progress) -> str:
    """How much of a stage is done; of one that may end early, how many steps; empty if that is not known."""
    if progress.at_most and progress.total is not None and progress.done:
        return f", {progress.done:g} of at most {progress.total:g}"
    return f", {100.0 * progress.fraction:.0f} %" if progress.fraction else ""


def _rest(progress: Progress, since: float = 0.0) -> str:
    """How long the rest of a stage takes, `since` seconds after the report; empty if that is not known.

    The pace so far is no bound of the rest, and of a stage that may end early not even an estimate.
    """
    remaining = None if progress.at_most else progress.remaining
    if remaining is None or progress.seconds < LEAST_S or remaining - since < 1.0:
        return ""
    return f", about {_time(remaining - since)} more"


def _time(seconds: float) -> str:
    """Whole seconds, or minutes and seconds, or hours and minutes."""
    return f"{seconds:.0f} s" if seconds < 99.5 else duration(seconds)


class _Terminal:
    """A line that moves."""

    def __init__(self) -> None:
        self._live: Any = None
        self._spinner: Any = None

    def show(self, now: Shown | None) -> None:
        if now is None:
            if self._live is not None:
                self._live.stop()
                self._live = None
            return
        # Imported here: most commands end before anything is shown.
        from rich.live import Live
        from rich.spinner import Spinner
        from rich.text import Text

        text = Text(now.text, no_wrap=True, overflow="ellipsis")
        if self._live is None:
            # Not "dots", rich's own choice, whose characters an ASCII terminal does not have. Results on
            # stdout are left alone: it may lead elsewhere.
            self._spinner = Spinner("line", text)
            self._live = Live(
                self._spinner, console=console_on(sys.stderr), transient=True, redirect_stdout=False
            )
            self._live.start()
        self._spinner.update(text=text)

    def line(self, detail: str) -> None:
        """The moving line shows the detail."""

    def say(self, line: str) -> None:
        (console_on(sys.stderr) if self._live is None else self._live.console).print(line, markup=False)


def console_on(stream: Any, **settings: Any) -> "Console":
    """A console of rich on a standard stream, which shows every text plainly, as of file names."""
    from rich.console import Console

    class PlainConsole(Console):
        def render(self, *arguments: Any, **options: Any) -> "Iterator[Segment]":
            for segment in super().render(*arguments, **options):
                yield segment if segment.control else segment._replace(text=plain(segment.text))

    return PlainConsole(file=getattr(stream, "as_is", stream), highlight=False, **settings)


class _Pipe:
    """A line for each outermost stage that lasts, and every ten seconds; a line for each detail."""

    def __init__(self) -> None:
        self._stage, self._printed = 0, -PERIOD_S

    def show(self, now: Shown | None) -> None:
        since = time.monotonic() - self._printed
        if now is not None and (since >= PERIOD_S or (now.stage != self._stage and since >= PATIENCE_S)):
            self._stage = now.stage
            self.say(now.text)

    def line(self, detail: str) -> None:
        self.say(detail)

    def say(self, line: str) -> None:
        self._printed = time.monotonic()
        print(line, file=sys.stderr, flush=True)


class _Notebook:
    """A bar below the cell, by IPython's own display."""

    def __init__(self) -> None:
        self._handle: Any = sys.modules["IPython"].display.display(_page(None), raw=True, display_id=True)

    def show(self, now: Shown | None) -> None:
        self._handle.update(_page(now), raw=True)

    def line(self, detail: str) -> None:
        """The bar shows the detail."""

    def say(self, line: str) -> None:
        print(line)


def _page(now: Shown | None) -> dict[str, str]:
    if now is None:
        return {"text/plain": "", "text/html": ""}
    value = "" if now.fraction is None else f' value="{now.fraction:.3f}"'
    return {"text/plain": now.text, "text/html": f"<progress{value}></progress> {html.escape(now.text)}"}


def _in_notebook() -> bool:
    """Whether this runs in a Jupyter kernel; IPython is there then, and is not imported elsewhere."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")
