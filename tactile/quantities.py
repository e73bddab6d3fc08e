"""Quantities that a finger gets from a relief, and the table of those that a run can ask for.

A new quantity is one row of `QUANTITIES`. The keys of `[touch]` in a run file, the options of the command,
the constraints of a descent, the numbers in result.json and the rows of the report follow from that table,
read when they are asked for.
Nothing here loads torch, numpy or the models of touch, so that help is shown at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import tactile

if TYPE_CHECKING:
    from torch import Tensor

    from relief.ground.arrays import Array
    from tactile.touch import Touch

Values = Mapping[str, "Array"]
"""Values of quantities by their names, each (k,) over the touches."""
LARGEST_JND = 10.0
"""Largest roughness change, JND: a factor of 1.19 ** 10 = 5.7, more than any relief up to 3 mm gives."""
PLACE_JND = 0.25
"""Largest distance of a contact location from its goal that counts as met, just-noticeable differences."""
FLAT_SHARE = 0.02
"""Share of the mean goal below which a contact location counts as flat. Distances from the goal are measured
as if value and goal were at least this share, because ratios to a value near zero mean nothing."""
LIMIT_PERCENT = 2.0
"""Change of the pictures up to which a look counts as kept, mean in % of white: the paper's."""
STEERING_GAP_WEIGHT_PER_MM = 20.0
"""Gap weight of the contact area whose gradient gives a step its direction, 1/mm. At the paper's 80 a slope
holds over 0.01 mm; the softer area has a slope over longer steps, whose length is found by pressing."""
CONTACT_ENERGY_UNIT_MM2 = 1000.0
"""Contact areas (mm²) are about this times roughnesses; other weights grow with it (paper section 4.1)."""


@dataclass(frozen=True)
class GoalKey:
    """A key of `[touch]` that states a goal for a quantity; its option has dashes.

    Attributes:
        key: such as `jnd`.
        metavar, help: of the option.
        bounds: of the number, as keywords of pydantic's `Field`; by default above 0.
        goal: from the number and the original's own value to the goal, in the quantity's unit; by default
            the number itself.
        relative: whether `goal` depends on the original's own value.
    """

    key: str
    metavar: str
    help: str
    bounds: Mapping[str, Any] = field(default_factory=lambda: {"gt": 0})
    goal: Callable[[float, float], float] = lambda number, original: number
    relative: bool = False

    def goals(self, number: float, original: Array) -> Array:
        """(k,) goals of the touches, by the original's own values (k,).

        A number that states the quantity itself is the mean of the goals, which keep the proportions of the
        original's values.
        """
        import numpy as np  # Here, because the help of the commands needs the table alone.

        if self.relative:
            return np.array([self.goal(number, float(value)) for value in original])
        mean = original.mean()
        return number * (original / mean if mean > 0.0 else np.ones_like(original))


class MapKeys(NamedTuple):
    """Keys of `[touch]` that state a goal which varies over the surface.

    Attributes:
        file: map of the goal over the whole surface: a picture, or an array (NPY, EXR, TIFF) that holds it.
        ends: goals at black and at white of a map that is a picture.
        first: goal at the first contact location along the axis; in between the goal is linear.
        last: goal at the last contact location along the axis.
    """

    file: str
    ends: str
    first: str
    last: str


@dataclass(frozen=True)
class Quantity:
    """A number that a finger gets from a relief, and that a descent can steer.

    Attributes:
        name: key in result.json, history and checkpoint.
        label: for tables and sentences.
        meaning: a sentence or two for a person who has not read the paper.
        symbol, unit: for the screen; the unit may be empty.
        decimals: digits behind the point on the screen.
        value: from a touch (..., n, n) to the numbers (...), differentiable.
        step_value: the same but for its last digits, and cheaper, for the steps of a descent; None: `value`.
        fast_value: a cheaper estimate for descents by a fast model of touch; None: `step_value`.
        steering_value: a smoother stand-in whose gradient gives a step its direction; None: `value`.
        slope_holds: whether the gradient predicts the quantity well over a whole step. Else every step is
            corrected by pressing until it arrives, not only the last one.
        energy_unit: by which Adam divides the distance to the goal.
        largest: the largest goal on a plate of a given side (mm).
        goals: keys that state a goal, the first of them the quantity itself; at most one may be given.
        mapped: whether a goal may also be a map, or vary along an axis.
        feel_of: value of `touch.feel_of_quantity` for which the goal is another relief's; None: for no one.
        in_jnd: whether changes count in just-noticeable differences, of which a run takes `LARGEST_JND`.
    """

    name: str
    label: str
    symbol: str
    unit: str
    decimals: int
    value: Callable[[Touch], Tensor]
    step_value: Callable[[Touch], Tensor] | None = None
    fast_value: Callable[[Touch], Tensor] | None = None
    steering_value: Callable[[Touch], Tensor] | None = None
    slope_holds: bool = True
    energy_unit: float = 1.0
    largest: Callable[[float], float] = lambda size_mm: math.inf
    goals: tuple[GoalKey, ...] = ()
    meaning: str = ""
    mapped: bool = False
    feel_of: str | None = None
    in_jnd: bool = False

    @property
    def map_keys(self) -> MapKeys:
        """The keys for goals that vary, of a quantity that is mapped."""
        return MapKeys(*(f"{self.name}_{part}" for part in ("map", "range", "from", "to")))

    def text(self, number: float) -> str:
        """A value with its unit, as in `34.0 mm²`."""
        return f"{number:.{self.decimals}f} {self.unit}".rstrip()


ROUGHNESS = Quantity(
    name="roughness",
    label="roughness",
    symbol="V",
    unit="",
    decimals=4,
    value=lambda touch: tactile.roughness(touch),
    step_value=lambda touch: tactile.roughness(touch, quadrature="thinned"),
    fast_value=lambda touch: tactile.roughness(touch, quadrature="polar"),
    goals=(
        GoalKey("roughness", "V", "roughness, as retouch evaluate reports it"),
        GoalKey(
            "jnd",
            "N",
            "just-noticeable differences rougher than the original; negative for smoother",
            {"ge": -LARGEST_JND, "le": LARGEST_JND},
            lambda number, original: tactile.jnd_scaled(original, number),
            relative=True,
        ),
    ),
    meaning="The mean difference of the skin's strain between points 1.4 to 3 mm apart, at the depth of "
    "the receptors. Roughness has no unit; a larger number feels rougher.",
    mapped=True,
    feel_of="roughness",
    in_jnd=True,
)
"""V (paper equation 2)."""

GAPS_COUNT = "the contact area also counts skin close by, at a gap of 0.0125 mm by half"
"""Why the contact area is larger than the share under pressure, for the screen."""
CONTACT_AREA = Quantity(
    name="contact_area_mm2",
    label="contact area",
    symbol="A",
    unit="mm²",
    decimals=1,
    value=lambda touch: tactile.contact_area(touch),
    steering_value=lambda touch: tactile.contact_area(touch, gap_weight=STEERING_GAP_WEIGHT_PER_MM),
    slope_holds=False,
    energy_unit=CONTACT_ENERGY_UNIT_MM2,
    largest=lambda size_mm: size_mm**2,
    goals=(
        GoalKey("contact_area_mm2", "MM2", "contact area in mm²; more feels colder"),
        GoalKey(
            "contact_area_scale",
            "X",
            "contact area as a factor on the original's",
            goal=lambda number, original: original * number,
            relative=True,
        ),
    ),
    meaning="The area in which the skin touches the plate; a gap of 0.0125 mm counts half, so that the "
    "area is larger than what bears pressure. More contact carries more heat away, and feels colder.",
    feel_of="contact-area",
)
"""A (paper equation 3), which the finger reads as temperature."""

QUANTITIES = {quantity.name: quantity for quantity in (ROUGHNESS, CONTACT_AREA)}
"""Quantities by name, which every run measures and a run file can ask for."""


def goal_keys() -> dict[str, tuple[Quantity, GoalKey]]:
    """Keys of `[touch]` that state a goal, each with its quantity."""
    return {key.key: (quantity, key) for quantity in QUANTITIES.values() for key in quantity.goals}


def mapped_quantities() -> tuple[Quantity, ...]:
    """The quantities whose goals may vary over the surface."""
    return tuple(quantity for quantity in QUANTITIES.values() if quantity.mapped)


def feel_of_quantities() -> dict[str, tuple[Quantity, ...]]:
    """Quantities that make up another relief's feel, by the values of `touch.feel_of_quantity`."""
    alone = {each.feel_of: (each,) for each in QUANTITIES.values() if each.feel_of is not None}
    return {**alone, "both": (ROUGHNESS, CONTACT_AREA)}


def means(values: Values) -> dict[str, float]:
    """Means of values over the touches, by the names of the quantities."""
    return {name: float(each.mean()) for name, each in values.items()}
