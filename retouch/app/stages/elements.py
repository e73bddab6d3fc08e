"""Elements of the page that NiceGUI has not: each a component of its own in `components`."""

from collections.abc import Callable, Sequence
from typing import Any

from nicegui import events
from nicegui.element import Element


class Given(Element):
    """An element whose properties are set by name."""

    def give(self, **properties: Any) -> None:
        """Set properties of the component; what is as it was is not sent."""
        changed = {name: value for name, value in properties.items() if self._props.get(name) != value}
        if changed:
            self._props.update(changed)
            self.update()

    def on_number(self, event: str, ends: tuple[float, float], chosen: Callable[[float], Any]) -> None:
        """Call a function with each number within bounds that an event of the component carries."""

        def check(arguments: events.GenericEventArguments) -> None:
            if ends[0] <= float(arguments.args) <= ends[1]:
                chosen(round(float(arguments.args), 3))

        self.on(event, check)


class ReliefView(Given, component="components/relief_view.js"):
    """A relief, or two with an edge between them, under a lamp that is dragged; emits `lamp` and `tilt`.

    Args:
        names: of the reliefs.
        tools: whether buttons say what dragging moves.
    """

    def __init__(self, names: Sequence[str], tools: bool = True) -> None:
        super().__init__()
        self.give(names=list(names), tools=tools)


class DropZone(Given, component="components/drop_zone.js"):
    """A button that chooses a file, and the whole page as a place to drop one; emits `kept`."""

    def __init__(self, label: str, hint: str, address: str, suffixes: Sequence[str]) -> None:
        super().__init__()
        self.give(label=label, hint=hint, address=address, accept=",".join(suffixes))


class CropBox(Given, component="components/crop_box.js"):
    """A picture with a square that says which part is taken; emits `crop`."""


class TextureScale(Given, component="components/texture_scale.js"):
    """Roughness on a scale of textures."""


class Range(Given, component="components/range.js"):
    """A slider, which calls `chosen` while it is moved."""

    def __init__(
        self, label: str, unit: str, ends: tuple[float, float], step: float, chosen: Callable[[float], Any]
    ) -> None:
        super().__init__()
        self.give(label=label, min=ends[0], max=ends[1], step=step, unit=unit)
        self.on_number("slid", ends, chosen)


class JndSlider(Given, component="components/jnd_slider.js"):
    """A change of the roughness over what it costs the look; calls `chosen`."""

    def __init__(self, most: float, chosen: Callable[[float], Any]) -> None:
        super().__init__()
        self.give(most=most)
        self.on_number("jnd", (-most, most), chosen)


class Brush(Given, component="components/brush.js"):
    """A brush over a relief; emits `painted` with the mask as a data URI."""


class StepChart(Given, component="components/step_chart.js"):
    """The way of a number over the steps of a run, and its target."""
