"""The objects that come with Retouch, by their names."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.solids import names
from relief.solids.body import Body
from relief.solids.objects import smooth, swept

Region = Callable[[Array], NDArray[np.bool_]]
"""Whether points (n, 3) in mm belong to a region of an object."""


@dataclass(frozen=True)
class BundledObject:
    """An object made by code.

    Attributes:
        description: What the object is, in a line.
        make: Builds the body, mm.
        volume_mm3: Volume by a formula; None where there is none.
        size_mm: Sides of the bounding box along x, y and z by a formula; None where there is none.
        regions: Parts of the surface that may be named in a mask.
    """

    description: str
    make: Callable[[], Body]
    volume_mm3: float | None = None
    size_mm: tuple[float, float, float] | None = None
    regions: Mapping[str, Region] = field(default_factory=dict)


def _every_second_link(first: int) -> Region:
    return lambda points: swept.link_of(points) % 2 == first


_INSIDE_MM = 2.0 * (swept.BRACELET_MM[0] - swept.BRACELET_MM[1])
_ROWS = (
    BundledObject("starfish that lies flat, about 80 mm wide", smooth.starfish),
    BundledObject(
        f"ring of {swept.LINKS} links, {_INSIDE_MM:.0f} mm wide inside; regions odd and even",
        swept.bracelet,
        swept.bracelet_volume(),
        None,
        {"even": _every_second_link(0), "odd": _every_second_link(1)},
    ),
    BundledObject(
        "cap of a dimmer's slider, 60 x 14 x 8 mm", smooth.slider, smooth.slider_volume(), smooth.SLIDER_MM
    ),
    BundledObject("free form that stands flat, about 50 mm long", smooth.frog),
    BundledObject(
        "plate of 50 mm with a hill and a saddle, the shape of the paper's figure 23",
        swept.curved,
        swept.curved_volume(),
    ),
    BundledObject("ball of radius 15 mm", smooth.ball, 4.0 / 3.0 * np.pi * 15.0**3, (30.0, 30.0, 30.0)),
    BundledObject(
        "cylinder of radius 15 mm, 40 mm high",
        swept.cylinder,
        np.pi * 15.0**2 * 40.0,
        (30.0, 30.0, 40.0),
    ),
)
OBJECTS: dict[str, BundledObject] = dict(zip(names.OBJECTS, _ROWS, strict=True))
"""Objects by name."""
