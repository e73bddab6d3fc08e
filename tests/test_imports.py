"""Rooms import what they build on, without circles, and Mitsuba only when something renders."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("retouch", "optimize", "visual", "tactile", "surrogate", "relief", "mitsuba_scenes")

RELIEF = {"relief", "mitsuba_scenes"}
ALLOWED = {
    "relief": set(),
    "relief.preparing": {"relief"},
    "relief.export": {"relief"},
    "relief.objects": {"relief", "relief.export"},
    "relief.wrapping": {"relief", "relief.meshes"},
    "relief.meshes": {"relief"},
    "mitsuba_scenes": {"relief"},
    "surrogate": {"relief"},
    "surrogate.families": RELIEF,
    "surrogate.corpus": {*RELIEF, "relief.preparing", "surrogate", "surrogate.families"},
    "surrogate.data": {*RELIEF, "surrogate", "surrogate.corpus"},
    "surrogate.nets": {*RELIEF, "surrogate"},
    "tactile": {*RELIEF, "surrogate.nets"},
    "tactile.unstructured": {*RELIEF, "tactile"},
    "visual.backend": RELIEF,
    "visual.geometry": {*RELIEF, "visual.backend"},
    "visual.lights": {*RELIEF, "visual.backend"},
    "visual.scene_file": {*RELIEF, "relief.export", "visual.backend", "visual.lights"},
    "visual.exact": {*RELIEF, "visual.backend", "visual.lights", "visual.geometry"},
    "visual.fast": {
        *RELIEF,
        *("visual.backend", "visual.lights", "visual.geometry", "visual.exact", "surrogate.nets"),
    },
    "visual": {
        *RELIEF,
        "relief.export",
        *(f"visual.{room}" for room in ("backend", "geometry", "lights", "scene_file", "exact", "fast")),
    },
    "visual.reference": {
        *RELIEF,
        *(f"visual.{room}" for room in ("backend", "geometry", "lights", "exact")),
        "visual",
    },
    "optimize.descent": {*RELIEF, "relief.export", "tactile", "visual", "visual.exact", "visual.fast"},
    "optimize.report": {*RELIEF, "tactile", "visual", "optimize.descent"},
    "optimize.descent.gauss_newton": {
        *RELIEF,
        *("relief.export", "tactile", "visual", "visual.exact", "visual.fast", "optimize.descent"),
    },
    "optimize.settings": {*RELIEF, "relief.export", "tactile", "optimize.descent"},
    "optimize.run_directory": {
        *RELIEF,
        *("relief.export", "tactile", "visual", "optimize.descent", "optimize.report", "optimize.settings"),
    },
    "optimize.runs": {
        *RELIEF,
        *("relief.export", "tactile", "visual", "optimize.descent", "optimize.descent.gauss_newton"),
        *("optimize.report", "optimize.settings", "optimize.run_directory"),
    },
    "optimize.workers": RELIEF,
    "optimize.studies": {
        *RELIEF,
        *("tactile", "visual", "visual.backend", "visual.lights"),
        *("optimize.descent", "optimize.report", "optimize.runs", "optimize.workers"),
        *("relief.export", "optimize.settings", "optimize.run_directory"),
    },
    "optimize.stimuli": {
        *RELIEF,
        *("relief.preparing", "relief.export", "tactile", "visual.lights"),
        *("optimize.report", "optimize.settings", "optimize.run_directory", "optimize.runs"),
        *("optimize.studies", "optimize.workers"),
    },
    "optimize.training": {
        *RELIEF,
        *(
            "optimize.workers",
            "tactile",
            "optimize.report",
            "surrogate.corpus",
            "surrogate.data",
            "surrogate.nets",
        ),
        *("visual", "visual.backend", "visual.scene_file", "visual.exact", "visual.fast", "visual.reference"),
    },
    "optimize.meshes": {
        *RELIEF,
        *("relief.meshes", "relief.export", "tactile", "visual.backend"),
        *("optimize.descent", "optimize.report"),
    },
    "optimize.commands": {
        *RELIEF,
        *("relief.meshes", "relief.objects", "relief.wrapping", "relief.export", "optimize.meshes"),
        *("optimize.settings", "optimize.run_directory"),
        *("optimize.descent", "optimize.report", "optimize.runs", "optimize.training"),
        *("optimize.studies", "optimize.stimuli", "optimize.workers"),
        *("relief.preparing", "tactile", "visual", "visual.backend", "surrogate.corpus", "surrogate.nets"),
    },
    "optimize": {*RELIEF, "optimize.commands", "optimize.runs"},
    "retouch": {
        *RELIEF,
        *("relief.preparing", "relief.export", "tactile", "visual", "surrogate.data"),
        *("optimize.settings", "optimize.runs"),
    },
}
"""Rooms that each room may import: what it builds on, and never what builds on it."""

PART_OF = {"tactile.structured": "tactile"}
"""Folders that belong to another room: builders of its operators, loaded only where nothing is cached."""

WITHOUT_MITSUBA = ("relief", "surrogate", "tactile")
"""Packages that never import a renderer, not even inside a function."""


def module_name(path: Path) -> str:
    """Dotted name of the module in a file of the checkout."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def room_of(module: str) -> str:
    """The room that a module lies in: its folder, dotted."""
    folder = ".".join(MODULES[module].relative_to(ROOT).parts[:-1])
    return PART_OF.get(folder, folder)


@cache
def imported(module: str) -> frozenset[str]:
    """Names in the import statements of a module, those in functions and for type checkers included."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0 and node.module, f"{module}: imports relative to itself"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                names.add(full if full in MODULES else node.module)
    return frozenset(names)


@pytest.mark.parametrize("module", MODULES)
def test_a_room_imports_what_it_builds_on(module: str) -> None:
    room = room_of(module)
    rooms = {room_of(name) for name in imported(module) if name in MODULES} - {room}
    assert rooms <= ALLOWED[room]


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith(WITHOUT_MITSUBA)])
def test_touch_learning_and_relief_know_no_renderer(module: str) -> None:
    assert not {name.partition(".")[0] for name in imported(module)} & {"mitsuba", "drjit"}


def circle(graph: dict[str, set[str]]) -> list[str]:
    """A circle of the graph; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_module_imports_itself_through_others() -> None:
    assert circle({name: {other for other in imported(name) if other in MODULES} for name in MODULES}) == []


def test_the_rooms_lie_in_one_order() -> None:
    assert circle(ALLOWED) == []
    assert {room_of(module) for module in MODULES} == set(ALLOWED)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_without_mitsuba(package: str) -> None:
    script = f"import {package}, sys; print(*({{'mitsuba', 'drjit'}} & sys.modules.keys()))"
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == ""
