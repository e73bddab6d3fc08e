"""Run files: every key with valid and hostile values, foreign keys, overrides and edited bytes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import tomli_w
from hypothesis import strategies as st

from optimize.settings import run_file as config
from optimize.settings import touch as touch_settings
from tactile.quantities import goal_keys
from tests.fuzz.case import HOSTILE, Case, chance, edited, several_edits

SECTIONS: Mapping[str, tuple[str, ...]] = {
    "touch": (*goal_keys(), "jnd", *touch_settings.Touch.model_fields),
    "look": tuple(config.Look.model_fields),
    "descent": tuple(config.DescentSettings.model_fields),
    "verify": tuple(config.Verify.model_fields),
    "define": ("resolution", "texture", "x"),
}
TOP = ("scene", "texture", "size_mm", "relief_mm", "height_scale", "seed")
VALID: Mapping[str, tuple[Any, ...]] = {
    "jnd": (2, -1, 0.5),
    "model": ("layer", "quick", "exact", "fast", "shading", "heights", "none", "fem", "net"),
    "method": ("gauss-newton", "adam"),
    "samples": (1, 4, 16),
    "steps": (1, 2),
    "corrections": (0, 1),
    "tolerance": (0.01, 0.5),
    "weight": (1.0, 0.0),
    "shadow_edges": (True, False),
    "skin": ("paper", "exploring"),
    "force_n": (10.0, 1.0),
    "young_modulus_mpa": (0.5,),
    "poisson_ratio": (0.48, 0.3),
    "thickness_mm": (2.5,),
    "depth_mm": (0.75,),
    "learning_rate": (0.027,),
    "regularisation": (0.06,),
    "smoothing": (0.0, 100.0),
    "growth": (1.0, 30.0),
    "stop": ("schedule", "paper"),
    "resolution": (16, "16"),
    "roughness": (0.1,),
    "roughness_map": ("plate.exr",),
    "roughness_range": ([0.1, 0.2], [0.2, 0.1]),
    "roughness_from": (0.1,),
    "roughness_to": (0.2,),
    "axis": ("x", "y"),
    "region": (
        [{"mask": "plate.exr", "jnd": 1}],
        [{"mask": "plate.exr", "jnd": 1, "graded": True}],
        [{"mask": "plate.exr", "x": 1}],
        [{"mask": "plate.exr"}],
        [{"jnd": 1}],
        [{"mask": 7}],
    ),
    "scene": ("scene.xml", "studio"),
    "texture": ("plate.exr",),
    "size_mm": (10.0, 10),
    "relief_mm": (1.0,),
    "height_scale": (1.0, 0.5),
    "seed": (0, 7),
}
"""Values that a key may have, so that hostile values of other keys are reached."""

NUMBERS = (
    *(float("nan"), float("inf"), -float("inf"), 1e300, -1e300, 1e-300, -1.0, 0.0, -0.0, 0.499, 0.5, 1.0),
    *(0, 1, -1, 2**31, 2**63, 10**400, 100_000, 100_001, 65536, 65537),
)


def values(key: str) -> st.SearchStrategy[Any]:
    """Values of a key; most are valid."""
    hostile = st.sampled_from(
        (*NUMBERS, *HOSTILE, True, False, [], [1], {}, {"x": 1}, ["a", {"b": []}])
    ) | st.floats(allow_nan=True)
    valid = st.sampled_from(VALID.get(key, NUMBERS))
    return st.one_of(*(valid,) * 5, hostile)


@st.composite
def tables(draw: st.DrawFn) -> dict[str, Any]:
    """The content of a run file."""
    content: dict[str, Any] = {"scene": "scene.xml", "texture": "plate.exr", "touch": {"jnd": 2}}
    for key in draw(st.lists(st.sampled_from(TOP), max_size=2, unique=True)):
        content[key] = draw(values(key))
    for name in draw(st.lists(st.sampled_from(sorted(SECTIONS)), max_size=3, unique=True)):
        keys = tuple(key for key in SECTIONS[name] if key not in goal_keys() or chance(draw, 8))
        chosen = draw(st.lists(st.sampled_from(keys), max_size=3, unique=True))
        content.setdefault(name, {}).update({key: draw(values(key)) for key in chosen})
    if chance(draw, 10):
        content.pop(draw(st.sampled_from(sorted(content))))
    if chance(draw, 10):
        holder = draw(
            st.sampled_from([content, *(part for part in content.values() if isinstance(part, dict))])
        )
        holder[draw(st.sampled_from(("x", "é", "", "touch", "a.b")))] = draw(values("x"))
    return content


@st.composite
def overrides(draw: st.DrawFn) -> str:
    """A setting as of `--set`."""
    name = draw(st.sampled_from((*SECTIONS, *TOP)))
    key = f"{name}.{draw(st.sampled_from(SECTIONS[name]))}" if name in SECTIONS else name
    value = draw(values(key.rpartition(".")[2]))
    text = value if isinstance(value, str) else json.dumps(value, allow_nan=True).lower()
    return draw(st.sampled_from((f"{key}={text}",) * 30 + (key, f".{key}={text}", "a." * 3000 + "b=1", "=")))


SMALL = (
    *("--set", "descent.steps=1", "--set", "verify.model=none", "--set", "verify.samples=4"),
    *("--set", "define.resolution=16"),
    *("--set", "touch.poisson_ratio=0.48", "--set", "touch.thickness_mm=2.5", "--set", "touch.depth_mm=0.75"),
)
"""Settings that bound the work of a whole run, whatever the file says; the operators of another skin would be
built first, which takes ten seconds."""


@st.composite
def run_files(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A run file beside a sound scene and texture.

    Args:
        base: The scene and the texture.
        whole: Whether the run is made.
    """
    table = draw(tables())
    try:
        content = tomli_w.dumps(table).encode()
    except (TypeError, ValueError):
        content = repr(table).encode()
    content = edited(content, draw(several_edits()) if chance(draw, 2) else [])
    files = {**base, "run.toml": content}
    settings = draw(st.lists(overrides(), max_size=2)) if chance(draw, 3) else []
    if not whole:
        return Case("run files", files, ["run.toml", *settings])
    given = [f"--set={setting}" for setting in settings]
    return Case("run files", files, [], ("optimize", "run.toml", "-q", "-o", "out", *given, *SMALL))
