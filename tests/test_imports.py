"""Packages import only in the directions of the design, and Mitsuba only when something renders."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

FORBIDDEN = {
    "relief": {"tactile", "visual", "surrogate", "optimize", "mitsuba", "drjit"},
    "tactile": {"visual", "optimize", "mitsuba", "drjit"},
    "visual": {"tactile", "optimize"},
    "surrogate": {"tactile", "visual", "optimize", "mitsuba", "drjit"},
}

SOURCES = [path for package in FORBIDDEN for path in sorted((ROOT / package).rglob("*.py"))]


def imported_packages(tree: ast.AST) -> Iterator[str]:
    """Top-level names that the import statements of a module name, those inside functions included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_follow_the_design(path: Path) -> None:
    package = path.relative_to(ROOT).parts[0]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not FORBIDDEN[package] & set(imported_packages(tree))


def test_every_package_is_looked_at() -> None:
    assert {path.relative_to(ROOT).parts[0] for path in SOURCES} == set(FORBIDDEN)


@pytest.mark.parametrize("package", ["tactile", "visual", "surrogate", "optimize"])
def test_a_package_imports_without_mitsuba(package: str) -> None:
    script = f"import {package}, sys; print(*({{'mitsuba', 'drjit'}} & sys.modules.keys()))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""
