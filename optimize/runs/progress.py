"""Progress of a run, as a person sees it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.report.formatting import number


class Progress(Protocol):
    """What follows a run to show it."""

    def descent(self, targets: Targets, steps: int) -> None:
        """Called before a descent, with the targets of its model of touch and its largest step number."""

    def step(self, iterate: Iterate, seconds: float) -> None:
        """Called after every step, with the seconds that it took."""

    def note(self, stage: str) -> None:
        """Called when a stage begins, with its name."""

    def say(self, line: str) -> None:
        """Called with a line that stays on the screen."""


@contextmanager
def silent() -> Iterator[Progress]:
    """Shows nothing."""
    yield _Lines(lambda line: None, lambda line: None)


@contextmanager
def terminal() -> Iterator[Progress]:
    """A line a step where output goes to a file or pipe, a moving line on a terminal."""
    from rich.console import Console

    console = Console(highlight=False, stderr=True)
    if not console.is_terminal:
        yield _Lines(console.print, console.print)
        return
    # Not "dots", the default, whose characters an ASCII terminal does not have.
    with console.status("starting", spinner="line") as status:
        yield _Lines(status.update, console.print)


class _Lines:
    """A line for each step and stage."""

    def __init__(self, show: Callable[[str], None], say: Callable[[str], None]) -> None:
        self.note, self.say = show, say
        self._targets = Targets()

    def descent(self, targets: Targets, steps: int) -> None:
        self._targets = targets
        self.note(f"descending to {targets.sentence}, at most to step {steps}")

    def step(self, iterate: Iterate, seconds: float) -> None:
        felt = "  ".join(
            f"{quantity.symbol} {quantity.text(iterate.values[quantity.name])}"
            for quantity in self._targets.quantities
        )
        error = 100.0 * self._targets.relative_error(iterate.values)
        self.note(
            f"step {iterate.step:3d}  {felt}  off target {error:5.2f} %  "
            f"pictures about {number(iterate.picture_mean, 2)} %  {seconds:.1f} s"
        )
