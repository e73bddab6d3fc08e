"""Window: what one window of the app looks at, and how."""

from collections.abc import Callable

from nicegui import events

from retouch.app.state.session import Session
from retouch.app.state.shapes import Shapes


class Window:
    """One window.

    Attributes:
        session: that all windows show.
        shapes: addresses of heights.
        show: turns to a stage by its name.
        lamp, tilt: of all views of this window.
    """

    def __init__(self, session: Session, shapes: Shapes, show: Callable[[str], None]) -> None:
        self.session, self.shapes, self.show = session, shapes, show
        self.lamp = {"azimuth": 135.0, "elevation": 35.0}
        self.tilt = {"right": 0.0, "down": 0.0}

    def lamp_moved(self, event: events.GenericEventArguments) -> None:
        """Keep where the lamp stands, for the other views of this window."""
        self.lamp = {name: float(event.args[name]) for name in ("azimuth", "elevation")}

    def tilted(self, event: events.GenericEventArguments) -> None:
        """Keep how the plate is tilted, for the other views of this window."""
        self.tilt = {name: float(event.args[name]) for name in ("right", "down")}
