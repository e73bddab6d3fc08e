"""Section `[touch]` of a run file: the feel to reach, the model of touch that steers, and the skin."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, create_model, model_validator

from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.skins import SKIN_KEYS, SkinKeys
from optimize.settings.toml_files import Positive, Section, one_of
from relief.ground.limits import LARGEST_PLATE_MM, LARGEST_RELIEF_MM, SMALLEST_RELIEF_MM
from relief.places import ROUND_SPACING_MM, SPACING_MM
from relief.surface import Repeats
from tactile.quantities import (
    QUANTITIES,
    ROUGHNESS,
    GoalKey,
    MapKeys,
    Quantity,
    feel_of_quantities,
    goal_keys,
    mapped_quantities,
)
from tactile.skin import Skin

MOST_REGIONS = 256
"""Most regions of a surface."""
FEEL_OF_KEYS = ("feel_of", "feel_of_relief_mm", "feel_of_repeats", "feel_of_quantity")
"""Keys of `[touch]` that together state the feel of another relief; the last belongs to no one relief."""
FEEL_OF_QUANTITIES = feel_of_quantities()
GOAL_KEYS = goal_keys()
MAPPED = mapped_quantities()
CurvedMm = Annotated[float, Field(allow_inf_nan=False)]
"""Radius of an object, mm, whose range `Skin` checks."""


def _stating(quantity: Quantity) -> list[tuple[str, ...]]:
    """Ways to state a goal of a quantity, each with the keys that state the goal together."""
    ways: list[tuple[str, ...]] = [(key.key,) for key in quantity.goals]
    if quantity.mapped:
        keys = quantity.map_keys
        ways += [(keys.file, keys.ends), (keys.first, keys.last, "axis")]
    return ways


def _rivals() -> dict[str, list[str]]:
    rivals: dict[str, list[str]] = {}
    for quantity in QUANTITIES.values():
        ways = _stating(quantity)
        others = [*ways, FEEL_OF_KEYS] if quantity is ROUGHNESS else ways
        for keys in ways:
            for one in keys:
                replaced = [key for other in others if other is not keys for key in other]
                rivals.setdefault(f"touch.{one}", replaced)
    return rivals


RIVALS = {
    **_rivals(),
    "touch.feel_of": [
        *GOAL_KEYS,
        *(key for one in MAPPED for keys in _stating(one)[len(one.goals) :] for key in keys),
        *FEEL_OF_KEYS[1:3],
    ],
    "touch.skin": list(SKIN_KEYS),
}
"""Key -> keys of a run file that an override of the key replaces: for a goal key of `[touch]` the other keys
of the quantity, for the feel of another relief every number, for the skin the keys that describe a skin.
Regions stay, because they may state several quantities."""
_GOAL_FIELDS: dict[str, Any] = {
    name: (Annotated[float, Field(allow_inf_nan=False, **key.bounds)] | None, None)
    for name, (_, key) in GOAL_KEYS.items()
}
_Ends = Annotated[tuple[Positive, Positive], Field(strict=False)]
_MAP_TYPES = (Annotated[Path, Field(strict=False)] | None, _Ends | None, Positive | None, Positive | None)
_MAP_FIELDS: dict[str, Any] = {
    key: (kind, None) for one in MAPPED for key, kind in zip(one.map_keys, _MAP_TYPES, strict=True)
}

Goals = list[tuple[Quantity, GoalKey, float]]


def _numbers(section: Section) -> Goals:
    """The goals that a section gives, each with its quantity and its key. Raises ValueError."""
    each = [(quantity, key, getattr(section, name)) for name, (quantity, key) in GOAL_KEYS.items()]
    goals = [(quantity, key, number) for quantity, key, number in each if number is not None]
    names: dict[str, str] = {}
    for quantity, key, _ in goals:
        if quantity.name in names:
            raise ValueError(f"{names[quantity.name]} and {key.key} exclude each other")
        names[quantity.name] = key.key
    return goals


class Varied(NamedTuple):
    """A goal that varies over the surface, as `[touch]` states it by `keys`; each value is None if not given.

    Attributes:
        file: of the map; absolute once loaded.
        ends: values of black and of white, if the map is a picture.
        first, last: felt by the first and the last finger along the axis.
    """

    quantity: Quantity
    keys: MapKeys
    file: Path | None
    ends: tuple[float, float] | None
    first: float | None
    last: float | None


class _RegionModel(Section):
    """`[[touch.region]]`: a part of the surface with a feel of its own; the goals are added below.

    Attributes:
        mask: picture or array over the whole surface, white or above 0.5 in the region.
        graded: whether the mask's grey, 0 to 1, is the share of the way from the original's feel to the goal.
    """

    mask: Annotated[Path, Field(strict=False)]
    graded: bool = False

    def goals(self) -> Goals:
        """The goals that are given, each with its quantity and its key."""
        return _numbers(self)

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
"""Least distance between contact locations, mm, a fifth of the usual distance: half the distance makes four
times as many locations, and sixteen times as many equations of their forces."""


class _TouchModel(SkinKeys):
    """`[touch]`: the feel to reach, the model of touch that steers, and the skin.

    The goals that are numbers, maps, or vary along the axis are added below, from the table in
    `tactile.quantities`. At least one goal is needed: a number, or one that varies over the surface
    (`optimize.runs.goal_maps`).

    Attributes:
        model: model of touch in the steps.
        spacing_mm: greatest distance between neighbouring contact locations, mm; by default 2.5, of a round
            finger 2.
        fingers: "range" optimises the other fingers of every report (softer, stiffer, shallower and deeper
            receptors) toward the same change as well.
        fingers_weight: picture change, root mean square in % of the mean, that counts as much as one JND by
            which the other fingers miss that change.
        skin: name or file of a finger, whose values the keys of a skin have that are not given; "own" where
            one that is given differs.
        curved_x_mm: radius of the object that will carry the texture, along x, mm, 3 to 10,000: positive
            where the object bulges, negative where it is hollow; by default straight.
        curved_y_mm: the same along y.
        axis: axis of `roughness_from` and `roughness_to`: "x", the default, from left to right, or "y" from
            top to bottom.
        region: parts of the surface with a feel of their own; the rest keeps the original's.
        feel_of: height map, name of a bundled one or folder of a run whose feel is the goal.
        feel_of_relief_mm: height of white above black there, mm, if it is a picture; by default that of its
            header.
        feel_of_repeats: whether it is a tile; by default as its header says, else as this texture.
        feel_of_quantity: which quantities of it are goals; by default roughness.
    """

    model: Literal["layer", "quick", "net"] = "layer"
    spacing_mm: Annotated[float, Field(ge=SMALLEST_SPACING_MM, le=LARGEST_PLATE_MM)] = Field(
        default_factory=lambda touch: ROUND_SPACING_MM if touch.get("shape") == "round" else SPACING_MM
    )
    fingers: Literal["one", "range"] = "one"
    fingers_weight: Annotated[float, Field(gt=0, le=LARGEST_FINGERS_WEIGHT)] = 20.0
    skin: Annotated[str, Field(min_length=1)] = DEFAULT_SKIN
    curved_x_mm: CurvedMm | None = None
    curved_y_mm: CurvedMm | None = None
    axis: Literal["x", "y"] | None = None
    region: Annotated[tuple[Region, ...], Field(strict=False, max_length=MOST_REGIONS)] = ()
    feel_of: Annotated[Path, Field(strict=False)] | None = None
    feel_of_relief_mm: Annotated[float, Field(ge=SMALLEST_RELIEF_MM, le=LARGEST_RELIEF_MM)] | None = None
    feel_of_repeats: Repeats | None = None
    feel_of_quantity: Annotated[str, one_of(FEEL_OF_QUANTITIES)] | None = None

    @property
    def finger(self) -> Skin:
        """The finger on the object."""
        return replace(super().finger, curved_x_mm=self.curved_x_mm, curved_y_mm=self.curved_y_mm)

    def goals(self) -> Goals:
        """The goals that are numbers, each with its quantity and its key."""
        return _numbers(self)

    def varied(self) -> list[Varied]:
        """Every quantity that may vary over the surface, with the values of its map keys."""
        keys = ((one, one.map_keys) for one in MAPPED)
        return [Varied(one, each, *(getattr(self, key) for key in each)) for one, each in keys]

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
        for quantity, names, file, _, first, _ in self.varied():
            given = ((names.file, file), (names.first, first))
            keys += [(quantity.name, key) for key, value in given if value is not None]
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
        others = {f"touch.{one.keys.file}": one.file for one in self.varied()}
        others["touch.feel_of"] = self.feel_of
        return {key: file for key, file in others.items() if file is not None} | masks

    @model_validator(mode="after")
    def _one_goal_a_quantity(self) -> Self:
        if not self.stated() and all(one.last is None for one in self.varied()):
            raise ValueError(f"a target is missing: {_ALL_KEYS}")
        return self

    @model_validator(mode="after")
    def _whole_maps(self) -> Self:
        for quantity, keys, file, ends, first, last in self.varied():
            if ends is not None and file is None:
                raise ValueError(f"{keys.ends}: is for a {keys.file}, which is missing")
            if (first is None) != (last is None):
                missing = keys.first if first is None else keys.last
                raise ValueError(f"{missing}: missing; a {quantity.label} along an axis has two ends")
        if self.axis is not None and all(one.first is None for one in self.varied()):
            both = " or ".join(f"{one.keys.first} and {one.keys.last}" for one in self.varied())
            raise ValueError(f"axis: is for {both}, which are missing")
        return self

    @model_validator(mode="after")
    def _whose_feel(self) -> Self:
        for key in FEEL_OF_KEYS[1:]:
            if self.feel_of is None and getattr(self, key) is not None:
                raise ValueError(f"{key}: is for feel_of, which is missing")
        return self

    @model_validator(mode="after")
    def _fingers_by_roughness(self) -> Self:
        if self.fingers == "range" and ROUGHNESS.name not in self.stated():
            raise ValueError("fingers: a range of fingers needs a goal of roughness, such as jnd")
        return self


if TYPE_CHECKING:
    Touch = _TouchModel
else:
    Touch = create_model("Touch", __base__=_TouchModel, **_GOAL_FIELDS, **_MAP_FIELDS)
    """`[touch]` with a field for each goal key of the table, and for each of those that vary."""


def too_large(quantity: Quantity, goal: float, size_mm: float) -> str:
    """Why a goal cannot be met on a plate of this side."""
    largest = quantity.text(quantity.largest(size_mm))
    return f"{quantity.text(goal)} is larger than the {largest} of the plate"
