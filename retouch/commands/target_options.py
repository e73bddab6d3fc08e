"""Options of `retouch optimize` that state the feel to reach, and the keys of `[touch]` that they set."""

import argparse
import json
from pathlib import Path

from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from tactile.quantities import QUANTITIES, feel_of_quantities, goal_keys, mapped_quantities

_MAPS = [quantity.map_keys for quantity in mapped_quantities()]
OTHER_GOALS = (*(key for keys in _MAPS for key in (keys.file, keys.first, keys.last)), "region", "feel_of")
"""Keys of `[touch]` that state a target other than a number."""
_NUMBERS = (*goal_keys(), "feel_of_relief_mm")
_TEXTS = ("feel_of", "feel_of_quantity")


def add_target(parser: argparse.ArgumentParser) -> None:
    """Add the options of the target, None where not given."""
    target = parser.add_argument_group("the feel to reach")
    for quantity in QUANTITIES.values():
        one = target.add_mutually_exclusive_group()
        for key in quantity.goals:
            flag = f"--{key.key.replace('_', '-')}"
            one.add_argument(flag, type=float, metavar=key.metavar, help=key.help)
    target.add_argument(
        "--feel-of",
        type=Path,
        metavar="OTHER",
        help="in place of a number: the feel of another texture, or of the result of a run (its folder)",
    )
    target.add_argument(
        "--feel-of-relief-mm",
        type=float,
        metavar="MM",
        help="height of white above black, mm, if OTHER is a picture (default: its header)",
    )
    target.add_argument(
        "--feel-of-quantity",
        choices=tuple(feel_of_quantities()),
        help="what of OTHER's feel is the goal (default: roughness)",
    )


def target_overrides(arguments: argparse.Namespace) -> list[str]:
    """The options of the target as overrides of a run file. Raises InputError if OTHER is no file."""
    # The folder of a run is left to the run file's reader, which also asks whether its result is a tile.
    if arguments.feel_of is not None and not arguments.feel_of.is_dir():
        arguments.feel_of = find_texture(arguments.feel_of)
    given = {key: getattr(arguments, key) for key in (*_NUMBERS, *_TEXTS)}
    return [
        # A TOML string is a JSON string in which only what must be escaped is escaped.
        f"touch.{key}={json.dumps(str(value), ensure_ascii=False) if key in _TEXTS else repr(value)}"
        for key, value in given.items()
        if value is not None
    ]


def check_target(source: object, settings: list[str]) -> None:
    """Raise InputError if no override of a run without a run file states a target."""
    targets = {f"touch.{key}" for key in (*goal_keys(), *OTHER_GOALS)}
    if not {setting.partition("=")[0].strip() for setting in settings} & targets:
        raise InputError(
            f"{source}: no target: give --roughness, --jnd, --feel-of, or one for the contact area"
        )
