"""Rooms import what they build on, without circles, and Mitsuba only when something renders."""

import ast
import importlib.util
import subprocess
import sys
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import retouch

ROOT = Path(__file__).parents[1]
WITH_NICEGUI = pytest.mark.skipif(importlib.util.find_spec("nicegui") is None, reason="without the extra app")
PACKAGES = ("retouch", "optimize", "visual", "tactile", "surrogate", "relief", "mitsuba_scenes")

_ALLOWED = {
    "mitsuba_scenes": "relief.ground",
    "relief": "relief.ground relief.reading",
    "relief.ground": "",
    "relief.reading": "relief.ground",
    "relief.preparing": "relief relief.ground relief.reading",
    "relief.scans": (
        "relief relief.ground relief.reading relief.solids relief.solids.export relief.solids.files "
        "relief.solids.meshes"
    ),
    "relief.solids": "relief.ground",
    "relief.solids.files": "relief.ground relief.solids relief.solids.meshes",
    "relief.solids.export": "relief relief.ground relief.solids relief.solids.files relief.solids.meshes",
    "relief.solids.filament": "relief relief.ground relief.solids relief.solids.meshes",
    "relief.solids.mending": "relief.ground relief.solids relief.solids.meshes",
    "relief.solids.meshes": "relief relief.ground relief.solids",
    "relief.solids.objects": "relief.ground relief.solids relief.solids.export",
    "relief.solids.remeshing": "relief.ground relief.solids relief.solids.meshes",
    "relief.solids.wrapping": (
        "relief relief.ground relief.solids relief.solids.mending relief.solids.meshes "
        "relief.solids.remeshing"
    ),
    "surrogate": "relief.ground",
    "surrogate.corpus": "relief.ground relief.preparing surrogate surrogate.families",
    "surrogate.data": "relief.ground surrogate surrogate.corpus",
    "surrogate.families": "relief.ground",
    "surrogate.nets": "relief.ground surrogate",
    "tactile": "relief relief.ground surrogate.nets",
    "tactile.unstructured": "relief.ground tactile",
    "visual": (
        "relief relief.ground visual.backend visual.exact visual.fast visual.geometry visual.lights "
        "visual.scene_file"
    ),
    "visual.backend": "relief relief.ground",
    "visual.exact": "relief.ground visual.backend visual.geometry visual.lights",
    "visual.fast": "relief relief.ground surrogate.nets visual.exact visual.geometry visual.lights",
    "visual.geometry": "relief relief.ground visual.backend",
    "visual.lights": "relief.ground visual.backend",
    "visual.reference": "relief.ground visual visual.backend visual.exact visual.geometry visual.lights",
    "visual.scene_file": "mitsuba_scenes relief relief.ground visual.backend visual.lights",
    "optimize": "optimize.runs relief.ground",
    "optimize.__main__": "",
    "optimize.descent": "relief relief.ground tactile visual visual.exact",
    "optimize.descent.gauss_newton": "optimize.descent relief relief.ground tactile visual visual.exact",
    "optimize.estimates": (
        "optimize.descent optimize.descent.gauss_newton optimize.runs optimize.settings "
        "optimize.verification relief relief.ground tactile visual"
    ),
    "optimize.run_directory": (
        "optimize.descent optimize.settings optimize.verification relief relief.ground relief.reading "
        "relief.solids.export tactile visual.lights"
    ),
    "optimize.runs": (
        "optimize.descent optimize.descent.gauss_newton optimize.run_directory optimize.settings "
        "optimize.verification relief relief.ground tactile visual visual.backend"
    ),
    "optimize.settings": "mitsuba_scenes optimize.descent relief relief.ground tactile visual",
    "optimize.verification": (
        "optimize.descent optimize.settings relief relief.ground tactile visual visual.exact"
    ),
    "optimize.verification.solids": (
        "optimize.verification relief relief.ground relief.solids relief.solids.filament relief.solids.files "
        "relief.solids.meshes relief.solids.objects relief.solids.remeshing tactile"
    ),
    "retouch": (
        "optimize.estimates optimize.runs optimize.settings relief relief.ground relief.preparing "
        "relief.solids.export retouch.laboratory.stimulus_sets retouch.verbs retouch.verbs.filament "
        "retouch.verbs.fuzzy retouch.verbs.objects retouch.verbs.palettes retouch.verbs.scans "
        "surrogate.data tactile visual visual.backend visual.scene_file"
    ),
    "retouch.__main__": "optimize.runs retouch.commands",
    "retouch.app": (
        "mitsuba_scenes optimize.run_directory relief.ground retouch.app.stages retouch.app.state "
        "retouch.app.values retouch.pages.plate_viewer"
    ),
    "retouch.app.computing": (
        "mitsuba_scenes optimize.estimates optimize.run_directory optimize.settings optimize.verification "
        "relief relief.ground relief.preparing relief.reading relief.solids.wrapping retouch "
        "retouch.app.values retouch.pages retouch.verbs tactile"
    ),
    "retouch.app.stages": (
        "mitsuba_scenes optimize.run_directory optimize.verification relief relief.ground relief.solids "
        "retouch.app.state retouch.app.values retouch.pages tactile"
    ),
    "retouch.app.state": (
        "optimize.descent optimize.estimates optimize.run_directory relief relief.ground "
        "retouch.app.computing retouch.app.values tactile"
    ),
    "retouch.app.values": (
        "mitsuba_scenes optimize.settings relief relief.ground relief.preparing retouch.verbs.objects tactile"
    ),
    "retouch.commands": (
        "mitsuba_scenes optimize.descent optimize.run_directory optimize.runs optimize.settings "
        "optimize.verification relief relief.ground relief.preparing relief.solids retouch retouch.app "
        "retouch.app.state retouch.pages retouch.verbs retouch.verbs.fuzzy retouch.verbs.objects "
        "surrogate.nets tactile"
    ),
    "retouch.laboratory": "",
    "retouch.laboratory.palettes": (
        "optimize.estimates optimize.run_directory optimize.verification relief relief.ground "
        "retouch.laboratory.stimulus_sets retouch.laboratory.studies retouch.pages "
        "retouch.pages.plate_viewer tactile"
    ),
    "retouch.laboratory.people": (
        "optimize.run_directory relief.ground retouch.laboratory.stimulus_sets retouch.pages tactile"
    ),
    "retouch.laboratory.people.serving": "relief.ground retouch.laboratory.people retouch.pages",
    "retouch.laboratory.published": (
        "mitsuba_scenes optimize.settings relief relief.ground retouch.laboratory.studies retouch.pages "
        "tactile"
    ),
    "retouch.laboratory.stimulus_sets": (
        "optimize.run_directory optimize.settings optimize.verification relief relief.ground "
        "relief.preparing relief.reading relief.solids relief.solids.export retouch.laboratory.studies "
        "retouch.laboratory.workers retouch.pages retouch.pages.plate_viewer tactile"
    ),
    "retouch.laboratory.studies": (
        "mitsuba_scenes optimize.descent optimize.estimates optimize.run_directory optimize.runs "
        "optimize.settings optimize.verification relief relief.ground retouch.laboratory.studies.measuring "
        "retouch.laboratory.workers retouch.pages retouch.pages.plate_viewer retouch.pages.templates tactile "
        "visual.backend"
    ),
    "retouch.laboratory.studies.measuring": (
        "mitsuba_scenes optimize.run_directory optimize.settings optimize.verification relief relief.ground "
        "tactile visual"
    ),
    "retouch.laboratory.training": (
        "mitsuba_scenes relief relief.ground retouch.laboratory.workers retouch.pages surrogate.corpus "
        "surrogate.data surrogate.nets tactile visual visual.backend visual.fast visual.reference "
        "visual.scene_file"
    ),
    "retouch.laboratory.workers": "relief.ground",
    "retouch.pages": (
        "optimize.run_directory optimize.runs optimize.verification relief relief.ground relief.scans "
        "retouch.pages.plate_viewer retouch.pages.templates retouch.pages.viewer tactile visual"
    ),
    "retouch.pages.objects": (
        "optimize.verification.solids relief relief.ground relief.solids relief.solids.export "
        "relief.solids.meshes relief.solids.wrapping retouch.pages retouch.pages.viewer tactile "
        "visual.backend"
    ),
    "retouch.pages.plate_viewer": (
        "relief relief.ground retouch.pages.templates retouch.pages.viewer visual visual.lights"
    ),
    "retouch.pages.templates": "relief.ground",
    "retouch.pages.viewer": "relief relief.ground relief.solids relief.solids.meshes retouch.pages.templates",
    "retouch.verbs": (
        "mitsuba_scenes optimize.estimates optimize.run_directory optimize.runs optimize.settings "
        "optimize.verification optimize.verification.solids relief relief.ground relief.preparing "
        "relief.solids.export relief.solids.filament relief.solids.files relief.solids.mending "
        "relief.solids.meshes relief.solids.objects retouch.verbs.filament retouch.verbs.fingers "
        "retouch.laboratory.people retouch.laboratory.people.serving "
        "retouch.laboratory.published retouch.laboratory.stimulus_sets retouch.laboratory.studies "
        "retouch.laboratory.training "
        "retouch.laboratory.workers retouch.pages retouch.pages.objects surrogate.corpus surrogate.data "
        "surrogate.nets tactile visual visual.backend visual.scene_file"
    ),
    "retouch.verbs.filament": (
        "optimize.run_directory optimize.verification optimize.verification.solids relief relief.ground "
        "relief.solids relief.solids.export relief.solids.filament relief.solids.files "
        "relief.solids.meshes tactile"
    ),
    "retouch.verbs.fingers": (
        "relief relief.ground relief.solids relief.solids.files relief.solids.meshes tactile "
        "tactile.unstructured"
    ),
    "retouch.verbs.fuzzy": (
        "mitsuba_scenes optimize.settings optimize.verification.solids relief relief.ground relief.solids "
        "relief.solids.export relief.solids.filament relief.solids.files relief.solids.meshes retouch.verbs "
        "retouch.verbs.filament tactile"
    ),
    "retouch.verbs.objects": (
        "mitsuba_scenes optimize.settings relief relief.ground relief.solids relief.solids.export "
        "relief.solids.files relief.solids.mending relief.solids.meshes relief.solids.objects "
        "relief.solids.remeshing relief.solids.wrapping "
        "retouch.pages retouch.pages.objects retouch.verbs"
    ),
    "retouch.verbs.palettes": (
        "relief.ground retouch.laboratory.palettes retouch.laboratory.stimulus_sets "
        "retouch.laboratory.studies retouch.laboratory.workers retouch.pages retouch.verbs"
    ),
    "retouch.verbs.scans": "relief relief.ground relief.scans retouch.pages retouch.verbs tactile",
}
ALLOWED = {room: set(names.split()) for room, names in _ALLOWED.items()}
"""Rooms that each room may import: what it builds on, and never what builds on it."""

PART_OF = {
    **dict.fromkeys(("tactile.structured", "tactile.elements", "tactile.layer"), "tactile"),
    "relief.solids.wrapping.coordinates": "relief.solids.wrapping",
}
"""Folders that belong to another room: builders of its operators, loaded only where nothing is cached, and
the coordinates in which textures are laid."""

WITHOUT_MITSUBA = ("relief", "surrogate", "tactile")
"""Packages that never import a renderer, not even inside a function."""


def module_name(path: Path) -> str:
    """Dotted name of the module in a file of the checkout."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def room_of(module: str) -> str:
    """The room that a module lies in: its folder, dotted."""
    if module.endswith(".__main__"):
        return module
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


@pytest.mark.slow
@pytest.mark.parametrize(
    "module",
    [
        "optimize.settings.run_file",
        # The server of the app: the page is up before the models, which its workers load.
        pytest.param("retouch.app.serve", marks=WITH_NICEGUI),
    ],
)
def test_run_files_and_the_app_load_no_method_and_no_renderer(module: str) -> None:
    heavy = {"mitsuba", "drjit", "torch", "optimize.descent.driver", "visual.scene"}
    script = f"import {module}, sys; print(*({heavy} & sys.modules.keys()))"
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == ""


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_without_mitsuba(package: str) -> None:
    script = f"import {package}, sys; print(*({{'mitsuba', 'drjit'}} & sys.modules.keys()))"
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == ""


SOLIDS = "manifold3d potpourri3d trimesh lxml networkx relief.solids.meshes.solid"
RENDERERS = "mitsuba drjit visual.scene optimize.descent.problem"
SOLVERS = "pypardiso skfem scipy.linalg scipy.ndimage scipy.optimize scipy.spatial scipy.stats"
PAGES = "jinja2 skimage flip_evaluator matplotlib"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "unused"),
    [
        ("main(['evaluate', 'gravel', '--json'])", f"{SOLIDS} {RENDERERS} {SOLVERS} {PAGES}"),
        (
            "main(['optimize', 'gravel', '--jnd', '2', '--fast', '--dry-run'])",
            f"{SOLIDS} skfem scipy.linalg scipy.optimize scipy.spatial scipy.stats skimage matplotlib",
        ),
    ],
)
def test_a_verb_loads_what_it_uses(script: str, unused: str) -> None:
    retouch.evaluate("gravel")  # the operator is now on disk
    script = (
        f"import sys; from retouch.commands.main import main; {script}\n"
        f"print('loaded', *sorted(set('{unused}'.split()) & sys.modules.keys()))"
    )
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.splitlines()[-1] == "loaded"


MOST_MODULES = 16
"""Most modules of a folder, so that a newcomer sees its subject at a glance."""
TABLES = ("retouch/commands",)
"""Folders with a module for each verb, of which there may be any number."""


def test_folders_have_few_modules() -> None:
    folders = Counter(path.relative_to(ROOT).parent.as_posix() for path in MODULES.values())
    assert {name for name, count in folders.items() if count > MOST_MODULES} <= set(TABLES)
