"""Section `[touch]` of a run file: the feel to reach, the model of touch that steers, and the skin."""

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, create_model, model_validator

from optimize.descent.targets import GOAL_KEYS, GoalKey, Quantity
from optimize.runs.toml_files import Positive, Section
from tactile.skin import LARGEST_THICKNESS_MM, MAX_POISSON_RATIO, Skin

RIVALS = {
    f"touch.{one}": [other.key for other in quantity.goals if other is not key]
    for one, (quantity, key) in GOAL_KEYS.items()
}
"""For each goal key of `[touch]`, the other keys for the same quantity; an overriding goal replaces them."""


class _TouchModel(Section):
    """`[touch]`: the feel to reach, the model of touch that steers, and the skin.

    The goals are added below, from the table in `optimize.descent.targets`; at least one is needed.

    Attributes:
        model: of touch, for the descent.
        young_modulus_mpa, poisson_ratio, force_n, thickness_mm, depth_mm: as in `tactile.Skin`.
    """

    model: Literal["layer", "quick", "net"] = "layer"
    young_modulus_mpa: Positive = 0.5
    poisson_ratio: Annotated[float, Field(ge=0, le=MAX_POISSON_RATIO)] = 0.48
    force_n: Positive = 10.0
    thickness_mm: Annotated[float, Field(gt=0, le=LARGEST_THICKNESS_MM)] = 2.5
    depth_mm: Positive = 0.75

    @property
    def skin(self) -> Skin:
        """The finger."""
        return Skin(**{field.name: getattr(self, field.name) for field in fields(Skin)})

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

    @model_validator(mode="after")
    def _depth_within_thickness(self) -> Self:
        if self.depth_mm >= self.thickness_mm:
            raise ValueError(
                f"depth_mm: {self.depth_mm:g} is not less than thickness_mm {self.thickness_mm:g}"
            )
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
