"""Options of a run: the feel to reach, the plate, the finger and details, with the keys that they set.

Ranges are checked by the run file's sections, which the keys belong to. The module loads nothing heavy, so
that help is shown at once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, make_dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

from mitsuba_scenes import DEFAULT_SCENE
from mitsuba_scenes.fingers import DEFAULT_SKIN, bundled_skins
from optimize.settings.fast_models import FAST_MODELS
from relief import plate_options
from relief.ground.limits import EYE_DISTANCE_CM, FARTHEST_EYE_CM, NEAREST_EYE_CM
from relief.ground.options import Option, literal, overrides
from tactile.quantities import QUANTITIES, GoalKey, feel_of_quantities, goal_keys, mapped_quantities

TARGET = "the feel to reach"
"""Heading of the goals."""
_MAPS = [quantity.map_keys for quantity in mapped_quantities()]
OTHER_GOALS = (*(key for keys in _MAPS for key in (keys.file, keys.first, keys.last)), "region", "feel_of")
"""Keys of `[touch]` that state a target other than a number."""


def skin_option(default: str = DEFAULT_SKIN) -> Option:
    """The option of the skin, which is `default` where none is given."""
    text = "skin of the finger: a file (.toml), or one that comes with Retouch: "
    return Option(
        f"{text}{', '.join(bundled_skins())}",
        "SKIN",
        default=default,
        key="touch.skin",
    )


def curved_options(default: str) -> dict[str, Option]:
    """The options of the curvature of the object, by name; without them it is `default`."""
    texts = {
        "curved_x_mm": "radius of the object that carries the texture, along x, mm; minus it in a hollow",
        "curved_y_mm": "the same along y, mm",
    }
    return {name: Option(text, "MM", default=default, key=f"touch.{name}") for name, text in texts.items()}


CURVED = tuple(curved_options(""))
"""Keys of `[touch]` for the curvature of the object."""


def distance_option() -> Option:
    """The option of the distance of the eye."""
    return Option(
        "from the eye to the plate, for FLIP, which sees no detail too small for it",
        "CM",
        (NEAREST_EYE_CM, FARTHEST_EYE_CM),
        default=f"{EYE_DISTANCE_CM:g}",
        key="verify.distance_cm",
    )


def _goal(quantity: str, key: GoalKey) -> Option:
    """The option of a goal; one at most of each quantity is given."""
    bounds = {key.bounds["ge"], key.bounds["le"]} if {"ge", "le"} <= key.bounds.keys() else ()
    limits = (min(bounds), max(bounds)) if bounds else None
    return Option(key.help, key.metavar, limits, default="", exclusive=quantity, key=f"touch.{key.key}")


@dataclass(frozen=True, kw_only=True)
class FeelOfOptions:
    """A goal that is the feel of another texture."""

    GROUP: ClassVar = TARGET

    feel_of: Annotated[
        Path | None,
        Option(
            "in place of a number: the feel of another texture, or of the result of a run (its folder)",
            "OTHER",
            key="touch.feel_of",
        ),
    ] = None
    feel_of_relief_mm: Annotated[
        float | None,
        Option(
            "height of white above black, mm, if OTHER is a picture",
            "MM",
            default="its header",
            key="touch.feel_of_relief_mm",
        ),
    ] = None
    feel_of_quantity: Annotated[
        str | None,
        Option(
            "what of OTHER's feel is the goal",
            choices=tuple(feel_of_quantities()),
            default="roughness",
            key="touch.feel_of_quantity",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class RunPlateOptions:
    """The texture, the scene, and the plate that carries the texture."""

    GROUP: ClassVar = "the plate"

    texture: Annotated[
        Path | None, Option("texture instead of the run file's, or for a scene", key="texture")
    ] = None
    scene: Annotated[
        Path | None,
        Option(
            "Mitsuba scene (.xml); a bundled one goes by its name",
            default=f"the run file's, or {DEFAULT_SCENE}",
            key="scene",
        ),
    ] = None
    size_mm: Annotated[
        float | None,
        plate_options.size_option(
            "side of the plate", "the run file's, or the texture's header, or the scene's", "size_mm"
        ),
    ] = None
    relief_mm: Annotated[
        float | None, plate_options.relief_option("the run file's, or the texture's header", "relief_mm")
    ] = None
    height_scale: Annotated[
        float | None, plate_options.height_scale_option("the run file's, or 1", "height_scale")
    ] = None
    units: Annotated[float | None, plate_options.units_option("height_scale")] = None
    fill: Annotated[bool, plate_options.fill_option("fill")] = False
    level: Annotated[bool, plate_options.level_option("level")] = False
    printer: Annotated[
        str | None,
        plate_options.printer_option(
            "compare the prints of original and result, and give a relief that this printer makes",
            "the run file's, or none",
            "print.printer",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class FingerOptions:
    """The finger, and the curvature on which it feels the texture."""

    GROUP: ClassVar = "the finger"

    skin: Annotated[str | None, skin_option(f"the run file's, or {DEFAULT_SKIN}")] = None
    curved_x_mm: Annotated[float | None, curved_options("the run file's, or straight")["curved_x_mm"]] = None
    curved_y_mm: Annotated[float | None, curved_options("the run file's, or straight")["curved_y_mm"]] = None


@dataclass(frozen=True, kw_only=True)
class DetailOptions:
    """Models, report and random numbers of a run."""

    GROUP: ClassVar = "details"

    fast: Annotated[
        bool,
        Option(
            "compute each step with the fast models (touch quick; look fast, or exact light in a scene that "
            "the fast look cannot show); the verification stays exact"
        ),
    ] = False
    baseline: Annotated[
        bool,
        Option(
            "leave out the comparison with the relief scaled in height from the report",
            "--no-baseline",
            key="verify.baseline",
        ),
    ] = True
    distance_cm: Annotated[float | None, distance_option()] = None
    seed: Annotated[
        int | None,
        Option("seed of all random numbers", "N", (0, 2**31 - 1), default="the run file's, or 0", key="seed"),
    ] = None


def run_options() -> type[Any]:
    """The dataclass of what states a run beside a run file, with a field for each goal of the quantities."""
    return _with_goals(tuple(goal_keys()))


@cache
def _with_goals(_: tuple[str, ...]) -> type[Any]:
    goals = [
        (key.key, Annotated[float | None, _goal(quantity.name, key)], field(default=None))
        for quantity in QUANTITIES.values()
        for key in quantity.goals
    ]
    namespace = {"GROUP": TARGET}
    numbers = make_dataclass("GoalOptions", goals, namespace=namespace, frozen=True, kw_only=True)
    bases = (numbers, FeelOfOptions, RunPlateOptions, FingerOptions, DetailOptions)
    return make_dataclass("RunOptions", (), bases=bases, frozen=True, kw_only=True)


def run_overrides(values: Mapping[str, Any]) -> list[str]:
    """Options of a run that are given, by name, as overrides of a run file."""
    fast = FAST_MODELS if values.get("fast") else {}
    return [*overrides(run_options(), values), *(f"{key}={literal(value)}" for key, value in fast.items())]


def states_a_target(settings: list[str]) -> bool:
    """Whether one of these overrides states a target."""
    targets = {f"touch.{key}" for key in (*goal_keys(), *OTHER_GOALS)}
    return bool({setting.partition("=")[0].strip() for setting in settings} & targets)
