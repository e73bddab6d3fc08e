"""Section `[touch]` of a run file: the feel to reach, the model of touch that steers, and the skin."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, create_model, model_validator

from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.skins import SKIN_KEYS, SkinKeys
from optimize.settings.toml_files import Positive, Section
from relief.common.limits import LARGEST_PLATE_MM, LARGEST_RELIEF_MM, SMALLEST_RELIEF_MM
from relief.places import SPACING_MM
from relief.surface import Repeats
from tactile.quantities import CONTACT_AREA, GOAL_KEYS, ROUGHNESS, GoalKey, Quantity

MOST_REGIONS = 256
"""Most regions of a surface."""
MAP_KEYS = (("roughness_map", "roughness_range"), ("roughness_from", "roughness_to", "axis"))
"""Keys of `[touch]` that together state a roughness that varies: by a map, and along an axis."""
FEEL_OF_KEYS = ("feel_of", "feel_of_relief_mm", "feel_of_repeats", "feel_of_quantity")
"""Keys of `[touch]` that together state the feel of another relief; the last belongs to no one relief."""
FEEL_OF_QUANTITIES: Mapping[str, tuple[Quantity, ...]] = {
    "roughness": (ROUGHNESS,),
    "contact-area": (CONTACT_AREA,),
    "both": (ROUGHNESS, CONTACT_AREA),
}
"""Quantities that make up the other's feel, by the values of `touch.feel_of_quantity`."""
_ROUGHNESS_KEYS = (*((key.key,) for key in ROUGHNESS.goals), *MAP_KEYS)
RIVALS = {
    **{
        f"touch.{one}": [other.key for other in quantity.goals if other is not key]
        for one, (quantity, key) in GOAL_KEYS.items()
    },
    **{
        f"touch.{one}": [
            key for other in (*_ROUGHNESS_KEYS, FEEL_OF_KEYS) if other is not keys for key in other
        ]
        for keys in _ROUGHNESS_KEYS
        for one in keys
    },
    "touch.feel_of": [*GOAL_KEYS, *(key for keys in MAP_KEYS for key in keys), *FEEL_OF_KEYS[1:3]],
    "touch.skin": list(SKIN_KEYS),
}
"""For each goal key of `[touch]`, the other keys for the same quantity, and for the skin those that describe
it; the overriding key replaces them. Another's feel replaces every number. Regions stay, because they may
state several quantities."""
_GOAL_FIELDS: dict[str, Any] = {
    name: (Annotated[float, Field(allow_inf_nan=False, **key.bounds)] | None, None)
    for name, (_, key) in GOAL_KEYS.items()
}

Goals = list[tuple[Quantity, GoalKey, float]]


def _given(section: Section) -> Goals:
    """The goals that a section gives, each with its quantity and its key. Raises ValueError."""
    each = [(quantity, key, getattr(section, name)) for name, (quantity, key) in GOAL_KEYS.items()]
    goals = [(quantity, key, number) for quantity, key, number in each if number is not None]
    names: dict[str, str] = {}
    for quantity, key, _ in goals:
        if quantity.name in names:
            raise ValueError(f"{names[quantity.name]} and {key.key} exclude each other")
        names[quantity.name] = key.key
    return goals


class _RegionModel(Section):
    """`[[touch.region]]`: a part of the surface with a feel of its own; the goals are added below.

    Attributes:
        mask: picture or array over the whole surface, white or above 0.5 in the region; absolute once loaded.
    """

    mask: Annotated[Path, Field(strict=False)]

    def goals(self) -> Goals:
        """The goals that are given, each with its quantity and its key."""
        return _given(self)

    @model_validator(mode="after")
    def _a_goal_a_quantity(self) -> Self:
        if not self.goals():
            raise ValueError(f"a target is missing: {_ALL_KEYS}")
        return self


*_others, _last = GOAL_KEYS
_ALL_KEYS = f"{', '.join(_others)}, {_last} or feel_of"
if TYPE_CHECKING:
    Region = _RegionModel
else:
    Region = create_model("Region", __base__=_RegionModel, **_GOAL_FIELDS)
    """`[[touch.region]]` with a field for each goal key of the table."""


LARGEST_FINGERS_WEIGHT = 1000.0
"""Largest weight of other fingers, ten times the one from which they hardly come closer."""
SMALLEST_SPACING_MM = 0.5
"""Least distance between places of the finger, mm, a fifth of the usual one: half the distance makes four
times as many places, and the equations of their forces sixteen times as many."""


class _TouchModel(SkinKeys):
    """`[touch]`: the feel to reach, the model of touch that steers, and the skin.

    The goals that are numbers are added below, from the table in `tactile.quantities`. At least one
    goal is needed: a number, or one that varies over the surface (`optimize.runs.goal_maps`).

    Attributes:
        model: of touch, for the descent.
        spacing_mm: greatest distance between neighbouring places of the finger, mm.
        fingers: "range" draws other fingers (`tactile.fingers`) to the same change as well.
        fingers_weight: picture change, rms in % of the mean, that counts as much as one just-noticeable
            difference of the other fingers from that change.
        skin: name or file whose values the keys of `SkinKeys` have that are not given; "own" where one of
            those that are given differs.
        roughness_map: picture or array over the whole surface, of the roughness to be felt; absolute once
            loaded.
        roughness_range: roughness of black and of white, if the map is a picture.
        roughness_from, roughness_to: felt by the first and the last finger along the axis.
        axis: "x", from left to right, unless it is "y", from top to bottom.
        region: parts of the surface with a feel of their own; the rest keeps the original's.
        feel_of: height map whose feel is the goal; absolute once loaded, and a file where it named a run.
        feel_of_relief_mm: mm of white above black, if that is a picture; by default that of its header.
        feel_of_repeats: whether that is a tile; None: as this texture.
        feel_of_quantity: which of its quantities of touch are goals, a key of `FEEL_OF_QUANTITIES`.
    """

    model: Literal["layer", "quick", "net"] = "layer"
    spacing_mm: Annotated[float, Field(ge=SMALLEST_SPACING_MM, le=LARGEST_PLATE_MM)] = SPACING_MM
    fingers: Literal["one", "range"] = "one"
    fingers_weight: Annotated[float, Field(gt=0, le=LARGEST_FINGERS_WEIGHT)] = 20.0
    skin: Annotated[str, Field(min_length=1)] = DEFAULT_SKIN
    roughness_map: Annotated[Path, Field(strict=False)] | None = None
    roughness_range: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None
    roughness_from: Positive | None = None
    roughness_to: Positive | None = None
    axis: Literal["x", "y"] | None = None
    region: Annotated[tuple[Region, ...], Field(strict=False, max_length=MOST_REGIONS)] = ()
    feel_of: Annotated[Path, Field(strict=False)] | None = None
    feel_of_relief_mm: Annotated[float, Field(ge=SMALLEST_RELIEF_MM, le=LARGEST_RELIEF_MM)] | None = None
    feel_of_repeats: Repeats | None = None
    feel_of_quantity: Literal["roughness", "contact-area", "both"] | None = None

    def goals(self) -> Goals:
        """The goals that are numbers, each with its quantity and its key."""
        return _given(self)

    def numbers(self) -> dict[str, float]:
        """The goals that are numbers, by their keys."""
        return {key.key: number for _, key, number in self.goals()}

    @property
    def feel_of_quantities(self) -> tuple[Quantity, ...]:
        """The quantities whose goals are those of another relief."""
        return () if self.feel_of is None else FEEL_OF_QUANTITIES[self.feel_of_quantity or "roughness"]

    def stated(self) -> dict[str, str]:
        """The key that states a goal of each quantity, by the quantity's name. Raises ValueError."""
        keys = [(quantity.name, key.key) for quantity, key, _ in self.goals()]
        keys += [(ROUGHNESS.name, first) for first, *_ in MAP_KEYS if getattr(self, first) is not None]
        keys += [(quantity.name, "feel_of") for quantity in self.feel_of_quantities]
        regional = {quantity.name: "region" for region in self.region for quantity, _, _ in region.goals()}
        stated: dict[str, str] = {}
        for name, key in (*keys, *regional.items()):
            if name in stated:
                raise ValueError(f"{stated[name]} and {key} exclude each other")
            stated[name] = key
        return stated

    def maps(self) -> dict[str, Path]:
        """Maps, masks and the other relief by their keys, as in `touch.region.0.mask`."""
        masks = {f"touch.region.{number}.mask": region.mask for number, region in enumerate(self.region)}
        others = {"touch.roughness_map": self.roughness_map, "touch.feel_of": self.feel_of}
        return {key: file for key, file in others.items() if file is not None} | masks

    @model_validator(mode="after")
    def _one_goal_a_quantity(self) -> Self:
        if not self.stated() and self.roughness_to is None:
            raise ValueError(f"a target is missing: {_ALL_KEYS}")
        return self

    @model_validator(mode="after")
    def _whole_maps(self) -> Self:
        if self.roughness_range is not None and self.roughness_map is None:
            raise ValueError("roughness_range: is for a roughness_map, which is missing")
        if (self.roughness_from is None) != (self.roughness_to is None):
            missing = "roughness_from" if self.roughness_from is None else "roughness_to"
            raise ValueError(f"{missing}: missing; a roughness along an axis has two ends")
        if self.axis is not None and self.roughness_from is None:
            raise ValueError("axis: is for roughness_from and roughness_to, which are missing")
        return self

    @model_validator(mode="after")
    def _whose_feel(self) -> Self:
        for key in FEEL_OF_KEYS[1:]:
            if self.feel_of is None and getattr(self, key) is not None:
                raise ValueError(f"{key}: is for feel_of, which is missing")
        return self

    @model_validator(mode="after")
    def _fingers_by_roughness(self) -> Self:
        if self.fingers == "range" and not (ROUGHNESS.name in self.stated() or self.roughness_to is not None):
            raise ValueError("fingers: a range of fingers needs a goal of roughness, such as jnd")
        return self


if TYPE_CHECKING:
    Touch = _TouchModel
else:
    Touch = create_model("Touch", __base__=_TouchModel, **_GOAL_FIELDS)
    """`[touch]` with a field for each goal key of the table."""


def too_large(quantity: Quantity, goal: float, size_mm: float) -> str:
    """Why a goal cannot be met on a plate of this side."""
    largest = quantity.text(quantity.largest(size_mm))
    return f"{quantity.text(goal)} is larger than the {largest} of the plate"
