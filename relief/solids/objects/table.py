"""The objects that come with Retouch, by their names."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from relief.ground.arrays import Array, Flags
from relief.solids.body import Body
from relief.solids.objects import smooth, swept

Region = Callable[[Array], Flags]
"""Whether points (n, 3) in mm belong to a region of an object."""


@dataclass(frozen=True)
class BundledObject:
    """An object made by code.

    Attributes:
        make: Builds the body, mm.
        regions: Parts of the surface that may be named in a mask.
    """

    make: Callable[[], Body]
    regions: Mapping[str, Region] = field(default_factory=dict)


def _every_second_link(first: int) -> Region:
    return lambda points: swept.link_of(points) % 2 == first


OBJECTS = {
    "starfish": BundledObject(smooth.starfish),
    "bracelet": BundledObject(swept.bracelet, {"even": _every_second_link(0), "odd": _every_second_link(1)}),
    "slider": BundledObject(smooth.slider),
    "frog": BundledObject(smooth.frog),
    "curved": BundledObject(swept.curved),
    "ball": BundledObject(smooth.ball),
    "cylinder": BundledObject(swept.cylinder),
}
"""Objects by name, in the order of `relief.solids.names.OBJECTS`."""
