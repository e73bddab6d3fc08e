"""Layout of the code: modules, lines, imports inside functions and import circles; files to open for a wish.

python -m benchmarks.runs.layout                       # this tree
python -m benchmarks.runs.layout --before 340f9f0      # a commit beside it

The code is read, and not imported. Numbers go to results/layout.json.
"""

from __future__ import annotations

import ast
import io
import subprocess
import tarfile
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import networkx

from benchmarks.shared.checkouts import NOW
from benchmarks.shared.common import ROOT, parser_of, save, table

APART = ("tests", "benchmarks")
"""Folders of code that are no packages of the application."""
LAYOUT_TOKENS = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}
"""Tokens that make no line a line of code."""

ABOVE = "retouch"
"""Package above the run, whose values are counted that have no type of their own."""

Sources = Mapping[PurePosixPath, str]
"""Python files of a tree by path."""


class Wish(NamedTuple):
    """Files to open for a change: those that name the thing or decide over it, less tests and docs."""

    before: tuple[str, ...]
    now: tuple[str, ...]


START = "340f9f0"
"""Commit at which the files of `before` stand."""
WISHES: Mapping[str, Wish] = {
    "change how a result is verified": Wish(
        (
            "optimize/report/metrics.py",
            "optimize/report/picture_change.py",
            "optimize/report/jod.py",
            "visual/converged.py",
            "optimize/run_directory/felt_places.py",
            "optimize/meshes/feel.py",
            "optimize/run_directory/as_printed.py",
            "optimize/run_directory/results.py",
            "optimize/runs/fingers.py",
            "optimize/runs/job.py",
            "optimize/runs/preparation.py",
            "optimize/descent/touch_measures.py",
        ),
        (
            "optimize/verification/measuring.py",
            "optimize/verification/verification.py",
            "optimize/verification/picture_change.py",
            "optimize/verification/picture_metrics.py",
        ),
    ),
    "a descent method": Wish(
        (
            "optimize/descent/linear_scaling.py",
            "optimize/runs/preparation.py",
            "optimize/settings/run_file.py",
            "optimize/runs/forecast.py",
        ),
        ("optimize/descent/linear_scaling.py", "optimize/descent/methods.py"),
    ),
    "a look": Wish(
        (
            "visual/height_view.py",
            "visual/models.py",
            "visual/scene.py",
            "optimize/settings/look.py",
            "optimize/runs/preparation.py",
            "optimize/descent/step_pictures.py",
            "optimize/runs/forecast.py",
        ),
        ("visual/scene_looks.py", "visual/looks.py"),
    ),
    "a quantity that is an equal": Wish(
        (
            "tactile/area.py",
            "optimize/descent/quantities.py",
            "optimize/settings/touch.py",
            "optimize/runs/feel_of.py",
            "optimize/runs/goal_maps.py",
            "optimize/report/content.py",
            "optimize/report/meanings.py",
            "optimize/report/templates/comparison.html.j2",
            "optimize/studies/columns.py",
            "optimize/studies/row_key.py",
            "optimize/stimuli/document.py",
        ),
        ("tactile/area.py", "tactile/quantities.py"),
    ),
    "a shape of finger": Wish(
        (
            "tactile/contact.py",
            "tactile/model.py",
            "tactile/skin.py",
            "tactile/net.py",
            "tactile/truncated.py",
            "tactile/fingers.py",
            "optimize/settings/skins.py",
            "optimize/descent/problem.py",
            "optimize/descent/gauss_newton/other_fingers.py",
        ),
        ("tactile/pressing.py", "tactile/skin.py", "optimize/settings/skins.py"),
    ),
    "a command and its Python door": Wish(
        (
            "optimize/commands/export.py",
            "optimize/commands/main.py",
            "optimize/runs/comparison.py",
            "retouch/__init__.py",
        ),
        (
            "retouch/commands/export.py",
            "retouch/verbs/exporting.py",
            "retouch/commands/main.py",
            "retouch/__init__.py",
        ),
    ),
    "the picture gradient of an array": Wish(
        ("relief/heightmap.py", "visual/scene.py", "visual/exact/render.py"),
        ("visual/scene.py",),
    ),
}
"""The files of `now` are checked by tests/benchmarks/test_layout.py."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--before", metavar="COMMIT", help="a commit beside this tree")
    before = parser.parse_args().before
    found = {before: measured(of_commit(before))} if before else {}
    found[NOW] = measured(of_tree(ROOT))
    wishes = {name: wish._asdict() for name, wish in WISHES.items()}
    save("layout", {"versions": found, "wishes": wishes})
    for version, layout in found.items():
        print(f"\n{version}\n\n{as_text(layout)}")
    counts = [(name, len(wish.before), len(wish.now)) for name, wish in WISHES.items()]
    print("\n" + table(("files to open for", START, NOW), counts))
    trees = [ast.parse(text) for path, text in of_tree(ROOT).items() if path.parts[0] == ABOVE]
    typed = {"dict[str, Any]": any_dicts, "subscripts by a string": string_subscripts}
    rows = [(name, sum(map(function, trees))) for name, function in typed.items()]
    print("\n" + table((f"untyped values in {ABOVE}", "count"), rows))


def of_tree(root: Path) -> Sources:
    """The Python files of a checkout that git knows or would take."""
    listed = ["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", "*.py"]
    names = subprocess.run(listed, capture_output=True, check=True, text=True).stdout.splitlines()
    files = {PurePosixPath(name): root / name for name in names}
    return {name: path.read_text(encoding="utf-8") for name, path in files.items() if path.is_file()}


def of_commit(commit: str) -> Sources:
    """The Python files of a commit."""
    archived = ["git", "-C", str(ROOT), "archive", commit]
    archive = subprocess.run(archived, capture_output=True, check=True).stdout
    sources = {}
    with tarfile.open(fileobj=io.BytesIO(archive)) as content:
        for member in content:
            file = content.extractfile(member) if member.name.endswith(".py") else None
            if file is not None:
                sources[PurePosixPath(member.name)] = file.read().decode()
    return sources


def measured(sources: Sources) -> dict[str, Any]:
    """Numbers of each package and of all packages, modules of each folder, and circles of the packages."""
    trees = {path: ast.parse(text) for path, text in sources.items()}
    packages: dict[str, Counter[str]] = {}
    folders = Counter[str]()
    for path, text in sources.items():
        found = packages.setdefault(path.parts[0], Counter())
        found["modules"] += 1
        found["code_lines"] += code_lines(text, trees[path])
        found["inner_imports"] += inner_imports(trees[path])
        folders[str(path.parent)] += path.name not in ("__init__.py", "__main__.py")
    rows = {name: {**found, **largest(folders, name)} for name, found in sorted(packages.items())}
    inside = [name for name in rows if name not in APART]
    keys = ("modules", "code_lines", "inner_imports")
    return {
        "packages": rows,
        "total": {key: sum(rows[name][key] for name in inside) for key in keys},
        "folders": dict(sorted(folders.items())),
        "circles": circles({path: tree for path, tree in trees.items() if path.parts[0] in inside}),
    }


def largest(folders: Mapping[str, int], package: str) -> dict[str, Any]:
    """The folder of a package with the most modules, without `__init__` and `__main__`."""
    own = (folder for folder in folders if PurePosixPath(folder).parts[:1] == (package,))
    folder = max(own, key=lambda name: folders[name])
    return {"largest_folder": folder, "its_modules": folders[folder]}


def as_text(layout: Mapping[str, Any]) -> str:
    """The table of the packages, their total, and the circles."""
    head = ("package", "modules", "code lines", "imports in functions", "largest folder", "its modules")
    lines = [[name, *row.values()] for name, row in layout["packages"].items()]
    lines.append([f"all but {' and '.join(APART)}", *layout["total"].values(), None, None])
    circles_found = "\n".join(" ".join(circle) for circle in layout["circles"])
    return f"{table(head, lines)}\n\nimport circles: {circles_found or 'none'}"


def code_lines(text: str, tree: ast.AST) -> int:
    """Lines that hold code: without blank ones, comments and docstrings."""
    lines = set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in LAYOUT_TOKENS:
            lines |= set(range(token.start[0], token.end[0] + 1))
    expressions = [node for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    for node in expressions:
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def inner_imports(tree: ast.AST) -> int:
    """Import statements inside functions."""
    functions = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
    inside = (child for node in ast.walk(tree) if isinstance(node, functions) for child in ast.walk(node))
    return len({id(node) for node in inside if isinstance(node, ast.Import | ast.ImportFrom)})


def any_dicts(tree: ast.AST) -> int:
    """Mentions of `dict[str, Any]`, but for what `as_json` returns."""
    written = {
        id(node.returns)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name == "as_json"
    }
    mentioned = (node for node in ast.walk(tree) if isinstance(node, ast.Subscript))
    return sum(ast.unparse(node) == "dict[str, Any]" for node in mentioned if id(node) not in written)


def string_subscripts(tree: ast.AST) -> int:
    """Subscripts by a literal string, but for annotations."""
    annotations = {
        id(inner)
        for node in ast.walk(tree)
        for annotation in (getattr(node, "annotation", None), getattr(node, "returns", None))
        if annotation is not None
        for inner in ast.walk(annotation)
    }
    return sum(
        isinstance(node, ast.Subscript)
        and isinstance(node.slice, ast.Constant)
        and isinstance(node.slice.value, str)
        and ast.unparse(node.value) != "Literal"
        and id(node) not in annotations
        for node in ast.walk(tree)
    )


def circles(trees: Mapping[PurePosixPath, ast.Module]) -> list[list[str]]:
    """Sets of modules that import one another, in functions and for type checkers included."""
    named = {module_name(path): tree for path, tree in trees.items()}
    graph: networkx.DiGraph[str] = networkx.DiGraph()
    for name, tree in named.items():
        graph.add_edges_from((name, other) for other in imported(tree, set(named)) if other != name)
    return sorted(sorted(c) for c in networkx.strongly_connected_components(graph) if len(c) > 1)


def imported(tree: ast.AST, modules: set[str]) -> Iterator[str]:
    """Modules of a tree that a module imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module:
            full = {f"{node.module}.{alias.name}" for alias in node.names}
            yield from full & modules
            if node.module in modules and full - modules:
                yield node.module


def module_name(path: PurePosixPath) -> str:
    """Dotted name of a module by its path in the checkout."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


if __name__ == "__main__":
    main()
