"""Section `[touch]` of a run file: the feel to reach, the model of touch that steers, and the skin."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, create_model, model_validator

from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.descent.targets import GOAL_KEYS, GoalKey, Quantity
from optimize.runs.skins import SKIN_KEYS, SkinKeys
from relief.limits import LARGEST_PLATE_MM
from relief.places import SPACING_MM

RIVALS = {
    f"touch.{one}": [other.key for other in quantity.goals if other is not key]
    for one, (quantity, key) in GOAL_KEYS.items()
} | {"touch.skin": list(SKIN_KEYS)}
"""For each goal key of `[touch]`, the other keys for the same quantity, and for the skin those that describe
it; the overriding key replaces them."""


SMALLEST_SPACING_MM = 0.1
"""Least distance between places of the finger, mm: neighbours then feel the same within a thousandth."""


class _TouchModel(SkinKeys):
    """`[touch]`: the feel to reach, the model of touch that steers, and the skin.

    The goals are added below, from the table in `optimize.descent.quantities`; at least one is needed.

    Attributes:
        model: of touch, for the descent.
        spacing_mm: greatest distance between neighbouring places of the finger, mm.
        skin: name or file whose values the keys of `SkinKeys` have that are not given; "own" where one of
            those that are given differs.
    """

    model: Literal["layer", "quick", "net"] = "layer"
    spacing_mm: Annotated[float, Field(ge=SMALLEST_SPACING_MM, le=LARGEST_PLATE_MM)] = SPACING_MM
    skin: Annotated[str, Field(min_length=1)] = DEFAULT_SKIN

    def goals(self) -> list[tuple[Quantity, GoalKey, float]]:
        """The goals that are given, each with its quantity and its key."""
        each = [(quantity, key, getattr(self, name)) for name, (quantity, key) in GOAL_KEYS.items()]
        return [(quantity, key, number) for quantity, key, number in each if number is not None]

    def numbers(self) -> dict[str, float]:
        """The goals that are given, by their keys."""
        return {key.key: number for _, key, number in self.goals()}

    @model_validator(mode="after")
    def _one_goal_a_quantity(self) -> Self:
        given: dict[str, str] = {}
        for quantity, key, _ in self.goals():
            if quantity.name in given:
                raise ValueError(f"{given[quantity.name]} and {key.key} exclude each other")
            given[quantity.name] = key.key
        if not given:
            *others, last = GOAL_KEYS
            raise ValueError(f"a target is missing: {', '.join(others)} or {last}")
        return self


if TYPE_CHECKING:
    Touch = _TouchModel
else:
    Touch = create_model(
        "Touch",
        __base__=_TouchModel,
        **{
            name: (Annotated[float, Field(allow_inf_nan=False, **key.bounds)] | None, None)
            for name, (_, key) in GOAL_KEYS.items()
        },
    )
    """`[touch]` with a field for each goal key of the table."""


def too_large(quantity: Quantity, goal: float, size_mm: float) -> str:
    """Why a goal cannot be met on a plate of this side."""
    largest = quantity.text(quantity.largest(size_mm))
    return f"{quantity.text(goal)} is larger than the {largest} of the plate"
