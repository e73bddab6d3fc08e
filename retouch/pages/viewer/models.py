"""What the viewer shows: bodies with layers of colour."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from markupsafe import Markup

from relief.ground.arrays import Array
from relief.solids.body import Body


@dataclass(frozen=True, eq=False)
class ColourLayer:
    """A colouring of a model.

    Attributes:
        name: on its switch, in a word or two.
        colours: (vertices, 3) in sRGB, from 0 to 1.
        legend: what the colours mean, in HTML.
    """

    name: str
    colours: Array
    legend: Markup = field(default_factory=Markup)


@dataclass(frozen=True, eq=False)
class ViewerModel:
    """A body to be shown.

    Attributes:
        name: in a word or two, such as "before".
        body: in mm, z up. Two models of one array of faces share these in the page.
        layers: colourings; without one, and by choice, a model has the colour of clay.

    Raises:
        ValueError: a layer has not a colour for each vertex.
    """

    name: str
    body: Body
    layers: Sequence[ColourLayer] = ()

    def __post_init__(self) -> None:
        for layer in self.layers:
            if layer.colours.shape != self.body.vertices.shape:
                shapes = f"{layer.colours.shape} for vertices of {self.body.vertices.shape}"
                raise ValueError(f"layer {layer.name!r}: colours of shape {shapes}")
