"""`import retouch` offers what README and docs use, and loads nothing until a name is used."""

import ast
import gc
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

import retouch
from relief.ground import lazy
from retouch.commands.main import VERBS

ROOT = Path(__file__).parents[1]


def test_the_import_loads_nothing_heavy() -> None:
    script = (
        "import retouch, sys; dir(retouch)\n"
        "print(*sorted({'tactile', 'visual', 'optimize', 'surrogate', 'torch', 'numpy', 'scipy', 'mitsuba',"
        " 'drjit', 'pydantic', 'rich', 'trimesh', 'PIL'} & sys.modules.keys()),"
        " *sorted({name for name in sys.modules if name.startswith('relief.')}"
        " - {'relief.ground', 'relief.ground.lazy'}))"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert child.stdout.strip() == ""


@pytest.mark.parametrize("name", retouch.__all__)
def test_every_name_is_there_and_keeps_its_value(name: str) -> None:
    assert callable(getattr(retouch, name))
    assert vars(retouch)[name] is getattr(retouch, name)


@pytest.mark.slow
def test_the_version_is_that_of_the_package() -> None:
    assert retouch.__version__ == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def test_no_submodule_hides_a_public_name() -> None:
    """In a process of its own, where every submodule is imported before a name is used."""
    script = (
        "import importlib, pkgutil, types, retouch, optimize, tactile, visual\n"
        "fronts = (tactile, visual, optimize, retouch)\n"
        "for front in fronts:\n"
        "    for module in pkgutil.walk_packages(front.__path__, front.__name__ + '.'):\n"
        "        module.name.endswith('__main__') or importlib.import_module(module.name)\n"
        "print(*[n for f in fronts for n in f.__all__ if isinstance(getattr(f, n), types.ModuleType)])"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert child.stdout.strip() == ""


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb != "app"])  # which is a page for a person
def test_every_verb_of_the_command_has_a_documented_function(verb: str) -> None:
    function = getattr(retouch, verb)
    assert inspect.isfunction(function)
    assert verb in retouch.__all__ and function.__name__ == verb
    text = inspect.getdoc(function) or ""
    assert all(name in text for name in inspect.signature(function).parameters)


def test_completion_offers_the_public_names_and_no_other() -> None:
    assert dir(retouch) == sorted(retouch.__all__)
    with pytest.raises(AttributeError, match="'retouch' has no attribute 'feel'"):
        retouch.feel  # noqa: B018


def test_every_public_name_is_imported_for_type_checkers_and_no_other() -> None:
    imports = [node for node in ast.walk(ast.parse(inspect.getsource(retouch))) if isinstance(node, ast.If)]
    assert {
        alias.asname or alias.name
        for block in imports
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    } == set(retouch.__all__)


@pytest.mark.parametrize("page", ["README.md", "docs/howto/surrogates.md", "docs/howto/python.md"])
def test_the_pages_use_names_that_exist(page: str) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.M | re.S)
    used = set(re.findall(r"\bretouch\.(\w+)", "\n".join(blocks)))
    assert used
    assert used <= set(retouch.__all__)


def test_the_command_leaves_what_it_has_loaded_as_it_is() -> None:
    """The interpreter searches all objects for cycles as it ends, but for those that are frozen."""
    script = (
        "import atexit, gc, sys; from retouch.__main__ import main\n"
        "atexit.register(lambda: print(len(gc.get_objects()) < gc.get_freeze_count()))\n"
        "sys.argv = ['retouch', '--version']; main()"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert child.stdout.splitlines()[1:] == ["True"]


def test_cycles_are_not_collected_while_names_load(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lazy, "resolve_name", lambda name: (name, gc.isenabled()))
    package = ModuleType("package")
    package.__file__, package.__all__ = retouch.__file__, ["optimize"]  # type: ignore[attr-defined]
    load, *_ = lazy.lazy_names(package)
    try:
        for enabled in (False, True):
            (gc.enable if enabled else gc.disable)()
            assert load("optimize") == ("retouch.verbs.runs:optimize", False)
            assert gc.isenabled() is enabled
        assert any(one is package.optimize for one in gc.get_objects(generation=2))
    finally:
        gc.enable()
