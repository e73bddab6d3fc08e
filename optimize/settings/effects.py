"""Effects of the keys of run files: keys set in vain, and those that the method of the run cannot serve."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from optimize.descent.methods import METHODS, methods_that_take
from visual.looks import LOOKS, LookModel

UNABLE = {
    "look.shape": "{method} keeps pictures alone; {others} keeps the relief too",
    "look.masking": "{method} has no weights by contrast; {others} has",
    "touch.fingers": "{method} steers one finger; {others} a range",
    "print.printer": "{method} makes no whole layers; {others} does",
}
"""Key -> fault of a method that does not take the key. Any other key that a method lacks has no effect."""
NEEDED: Mapping[str, tuple[str, str, Any]] = {
    "touch.fingers_weight": ("touch.fingers", "range", None),
    "verify.resolution": ("verify.model", "fem", None),
    "verify.corrections": ("verify.model", "fem", 0),
}
"""Key -> (key it depends on, value required there, idle value). With any other value there, the key has no
effect, so that the idle value, which asks for nothing, is allowed there too."""
LOOK_KEYS: Mapping[str, Callable[[LookModel], bool]] = {
    "look.samples": lambda look: look.sampled,
    "descent.shadow_edges": lambda look: look.shadows,
}
"""Key that has an effect by some looks only -> whether the key has an effect by a look."""
SCALES = frozenset({"relief_mm", "height_scale"})
"""Keys of the scale of a texture: one for pictures, one for files that hold mm."""
DECIDING = frozenset(
    {"texture", "touch.fingers", "touch.shape", "touch.skin", "look.model", "descent.method", "verify.model"}
)
"""Keys that decide which others have an effect."""

Value = Callable[[str], Any]
"""The value in a run of a dotted key."""


def unable(value: Value, defaults: Mapping[str, Any]) -> str | None:
    """The fault, in one line, of a run that asks more than its method can do; None without a fault.

    Args:
        value: of each key in the run.
        defaults: by key.
    """
    method = value("descent.method")
    for key, fault in UNABLE.items():
        if value(key) != defaults[key] and key not in METHODS[method].takes:
            return f"{key}: {fault.format(method=method, others=' or '.join(methods_that_take(key)))}"
    return None


def without_effect(value: Value, defaults: Mapping[str, Any], texture: Path) -> dict[str, str]:
    """Keys that differ from their defaults and change nothing in a run, each with the reason.

    Args:
        value: of each key in the run.
        defaults: by key.
        texture: of the run. A missing file is no fault here; reading the texture raises its error.
    """
    own = {key for key in defaults if value(key) != defaults[key]}
    method, reasons = value("descent.method"), dict[str, str]()
    for key in own.difference(METHODS[method].takes, UNABLE):
        if others := methods_that_take(key):
            reasons[key] = f"has no effect by {method}; {' or '.join(others)} takes it"
    for key, (other, needed, idle) in NEEDED.items():
        if key in own and value(key) != idle and value(other) != needed:
            reasons.setdefault(key, f'has no effect without {other} = "{needed}"')
    if "verify.resolution" in own and value("touch.shape") == "round":
        reasons.setdefault(
            "verify.resolution", "has no effect on a round finger, whose elements have one mesh"
        )
    # Which look "auto" takes depends on the scene, which is not loaded yet.
    look = LOOKS.get(value("look.model"))
    for key, applies in LOOK_KEYS.items():
        if key in own and look is not None and not applies(look):
            reasons.setdefault(key, f"has no effect by the look {value('look.model')}")
    if own & SCALES and os.path.isfile(texture):
        # Imported here: a run file is checked before anything heavy is loaded.
        from relief.heightmap import holds_mm

        key, reason = (
            ("relief_mm", "is for pictures; the texture holds mm, which height_scale scales")
            if holds_mm(texture)
            else ("height_scale", "is for files that hold mm; a picture is scaled by relief_mm")
        )
        if key in own:
            reasons[key] = reason
    return reasons
