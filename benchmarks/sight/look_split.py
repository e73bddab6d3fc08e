"""Where the seconds of a picture loss and its gradient go, and how long its rays take alone."""

from __future__ import annotations

import cProfile
import pstats
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from benchmarks.shared.common import table
from visual.backend import rays

REPEATS = 5
GROUPS = {
    "rays (shadows, edges)": (("backend/rays.py", "blocked"), ("backend/rays.py", "first_hits")),
    "heights into the scene": (("backend/buffers.py", "set_heights"),),
    "radiance and its slopes": (("exact/shading.py", "shade"),),
    "shadow edges": (
        ("exact/shadow_edges.py", "shadow_edges"),
        ("exact/discontinuities.py", "discontinuity_entries"),
    ),
    "Mitsuba's pictures": (("exact/render.py", "_render"),),
    "Mitsuba's gradient": (("exact/render.py", "interior_gradient"),),
}
"""Functions by file and name, whose time with all that they call is that of a group; no function calls one
of another group but for rays and heights, which are taken out of those that call them."""
INNERMOST = ("rays (shadows, edges)", "heights into the scene")


def split(work: Callable[[int], object], scene: Any) -> dict[str, Any]:
    """Median seconds of `work(seed)` by group, in all, and of its rays traced once more by themselves.

    Args:
        scene: a Mitsuba scene whose plate has the heights of `work`.
    """
    work(0)
    whole = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work(1)
        whole.append(time.perf_counter() - began)
    profiled = [_profile(work) for _ in range(REPEATS)]
    # The profiler slows Python down; its shares are taken, not its seconds.
    shares = {name: statistics.median(p[name] / p["all"] for p in profiled) for name in GROUPS}
    total = statistics.median(whole)
    seconds = {name: share * total for name, share in shares.items() if share > 0.0}
    seconds["the rest (arrays, sparse matrices, torch)"] = total - sum(seconds.values())
    alone, count = _rays_alone(work, scene)
    return {"all": total, "groups": seconds, "rays alone": alone, "rays": count}


def _profile(work: Callable[[int], object]) -> dict[str, float]:
    profile = cProfile.Profile()
    profile.enable()
    work(1)
    profile.disable()
    stats: dict[Any, Any] = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    seconds = {
        name: sum(_cumulative(stats, *code) for code in functions) for name, functions in GROUPS.items()
    }
    for inner in INNERMOST:
        for name in GROUPS:
            if name not in INNERMOST:
                seconds[name] -= sum(_within(stats, code, GROUPS[inner]) for code in GROUPS[name])
    return seconds | {"all": max(entry[3] for entry in stats.values())}


def _cumulative(stats: dict[Any, Any], file: str, function: str) -> float:
    return sum(entry[3] for key, entry in stats.items() if _is(key, file, function))


def _within(stats: dict[Any, Any], outer: tuple[str, str], inner: tuple[tuple[str, str], ...]) -> float:
    """Seconds of inner functions below an outer one, through at most one function between."""
    spent = 0.0
    for key, entry in stats.items():
        if not any(_is(key, *code) for code in inner):
            continue
        for caller, called in entry[4].items():
            if _is(caller, *outer):
                spent += called[3]
                continue
            for above, through in stats[caller][4].items():
                if _is(above, *outer) and stats[caller][3] > 0.0:
                    spent += called[3] * through[3] / stats[caller][3]
    return spent


def _is(key: tuple[str, int, str], file: str, function: str) -> bool:
    return key[0].endswith(f"/visual/{file}") and key[2] == function


def _rays_alone(work: Callable[[int], object], scene: Any) -> tuple[float, int]:
    """Seconds of tracing the same rays, ready in Dr.Jit's memory, and how many there are."""
    import drjit as dr

    with _recorded() as traced:
        work(1)
    dr.eval(traced)
    dr.sync_thread()
    seconds = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        for ray in traced:
            dr.eval(scene.ray_test(ray))
        dr.sync_thread()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds), sum(dr.width(ray) for ray in traced)


@contextmanager
def _recorded() -> Iterator[list[Any]]:
    """The rays that `visual.backend.rays` makes in this block."""
    traced: list[Any] = []
    original = rays._rays

    def keep(*points: Any) -> Any:
        traced.append(original(*points))
        return traced[-1]

    with patch.object(rays, "_rays", keep):
        yield traced


def as_text(methods: dict[str, Any]) -> str:
    """A table, a column for each method."""
    names = list(dict.fromkeys(name for method in methods.values() for name in method["groups"]))
    rows: list[tuple[Any, ...]] = [
        (name, *(method["groups"].get(name) for method in methods.values())) for name in names
    ]
    rows.append(("all", *(method["all"] for method in methods.values())))
    rows.append(("its rays alone, ready in memory", *(method["rays alone"] for method in methods.values())))
    rows.append(("rays, million", *(1e-6 * method["rays"] for method in methods.values())))
    return table(("seconds", *methods), rows)
