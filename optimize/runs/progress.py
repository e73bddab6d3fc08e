"""What a person sees while a run goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from optimize.descent.driver import Iterate
from optimize.descent.problem import Targets


class Progress(Protocol):
    """Told of what a round goes for and in how many steps at most, of steps and of stages."""

    def aim(self, aim: Targets, steps: int) -> None: ...

    def step(self, iterate: Iterate, seconds: float) -> None: ...

    def note(self, stage: str) -> None: ...


class _Silent:
    def aim(self, aim: Targets, steps: int) -> None:
        pass

    def step(self, iterate: Iterate, seconds: float) -> None:
        pass

    def note(self, stage: str) -> None:
        pass


@contextmanager
def silent() -> Iterator[Progress]:
    """Shows nothing."""
    yield _Silent()


@contextmanager
def terminal() -> Iterator[Progress]:
    """A line a step where output goes to a file or pipe, a moving line on a terminal."""
    from rich.console import Console

    console = Console(highlight=False, stderr=True)
    if not console.is_terminal:
        yield _Lines(console.print)
        return
    with console.status("starting") as status:
        yield _Lines(status.update)


class _Lines:
    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self._aim: Targets | None = None
        self._steps = 0

    def aim(self, aim: Targets, steps: int) -> None:
        self._aim, self._steps = aim, steps

    def step(self, iterate: Iterate, seconds: float) -> None:
        assert self._aim is not None
        miss = self._aim.miss(iterate.roughness, iterate.contact_area_mm2)
        self._show(
            f"step {iterate.step:3d}  V {iterate.roughness:.4f}  A {iterate.contact_area_mm2:5.1f} mm²  "
            f"off target {100.0 * miss:5.2f} %  pictures {iterate.picture_mean:.2f} %  {seconds:.1f} s"
        )

    def note(self, stage: str) -> None:
        self._show(stage)
