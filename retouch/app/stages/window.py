"""Window: what one window of the app looks at, and how; and the frame that all stages share."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

from nicegui import events, ui

from relief.relief import Relief
from retouch.app.stages.elements import ReliefView
from retouch.app.state.addresses import Addresses
from retouch.app.state.session import Session


class AppWindow:
    """One window.

    Attributes:
        session: that all windows show.
        show: turns to a stage by its name.
        light: lamp and tilt of all views of this window, as properties of `ReliefView`.
    """

    def __init__(self, session: Session, addresses: Addresses, show: Callable[[str], None]) -> None:
        self.session, self.show, self._addresses = session, show, addresses
        self.light: dict[str, dict[str, float]] = {
            "lamp": {"azimuth": 135.0, "elevation": 35.0},
            "tilt": {"right": 0.0, "down": 0.0},
        }

    def view(self, *names: str, tools: bool = True, moved: Callable[[], None] = lambda: None) -> ReliefView:
        """A view of reliefs, whose lamp and tilt are kept for the other views of this window.

        Args:
            names: of the reliefs.
            tools: whether buttons say what dragging moves.
            moved: called after lamp or tilt were moved.
        """
        view = ReliefView(names, tools=tools)

        def keep(name: str, event: events.GenericEventArguments) -> None:
            self.light[name] = {part: float(event.args[part]) for part in self.light[name]}
            moved()

        for name in self.light:
            view.on(name, partial(keep, name))
        return view

    def light_up(self, view: ReliefView, *reliefs: Relief | None, **properties: Any) -> None:
        """Show one relief, or an original and a result, by the light of this window."""
        addresses = map(self._addresses.address, reliefs)
        view.give(**dict(zip(("before", "after"), addresses, strict=False)), **self.light, **properties)

    def address(self, relief: Relief | None) -> str:
        """The address of a relief's heights; empty for none."""
        return self._addresses.address(relief)


class PageStage(ABC):
    """A stage of the page: a work area, and a side with choices and numbers.

    Attributes:
        name: in the bar.
    """

    name: ClassVar[str]

    def __init__(self, window: AppWindow) -> None:
        self.window, self.session = window, window.session

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self.build_work()
            with ui.element("aside").classes("side"):
                self.build_side()

    @abstractmethod
    def build_work(self) -> None:
        """Put the elements of the work area into the present slot."""

    @abstractmethod
    def build_side(self) -> None:
        """Put choices and numbers into the present slot."""

    def commands(self) -> list[list[str]]:
        """The commands that do the same in a terminal, without `retouch`: prepare the picture, and run."""
        return self.session.running.commands()

    @abstractmethod
    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
