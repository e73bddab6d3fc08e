"""Layout of the code: modules, lines, import circles, and what is spelled by hand or named twice.

python -m benchmarks.runs.layout                       # this tree
python -m benchmarks.runs.layout --before 27bd9ddc     # a commit beside it

The code is read, and not imported. Numbers go to results/layout.json.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tarfile
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

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

ENDS = (".py", ".md")
"""Suffixes of the files that are read."""

Sources = Mapping[PurePosixPath, str]
"""Python files and pages of a tree by path."""


APPLICATION = "retouch"
"""The package above the run."""
PROSE = {
    "README": ("README.md",),
    "guide": ("docs/*.md",),
    "evidence": ("docs/evidence/*.md",),
    "CHANGELOG": ("CHANGELOG.md",),
}
"""Files of words by name, as patterns."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--before", metavar="COMMIT", help="a commit beside this tree")
    before = parser.parse_args().before
    found = {before: measured(of_commit(before))} if before else {}
    found[NOW] = measured(of_tree(ROOT))
    save("layout", {"versions": found})
    for version, layout in found.items():
        print(f"\n{version}\n\n{as_text(layout)}")
    rows = [
        (name, *(layout["measures"][name] for layout in found.values())) for name in found[NOW]["measures"]
    ]
    print("\n" + table(("measure", *found), rows))


def of_tree(root: Path) -> Sources:
    """The Python files and pages of a checkout that git knows or would take."""
    listed = ["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", *(f"*{end}" for end in ENDS)]
    names = subprocess.run(listed, capture_output=True, check=True, text=True).stdout.splitlines()
    files = {PurePosixPath(name): root / name for name in names}
    return {name: path.read_text(encoding="utf-8") for name, path in files.items() if path.is_file()}


def of_commit(commit: str) -> Sources:
    """The Python files and pages of a commit."""
    archived = ["git", "-C", str(ROOT), "archive", commit]
    archive = subprocess.run(archived, capture_output=True, check=True).stdout
    sources = {}
    with tarfile.open(fileobj=io.BytesIO(archive)) as content:
        for member in content:
            file = content.extractfile(member) if member.name.endswith(ENDS) else None
            if file is not None:
                sources[PurePosixPath(member.name)] = file.read().decode()
    return sources


def measured(sources: Sources) -> dict[str, Any]:
    """Numbers of each package and of all packages, modules of each folder, and circles of the packages."""
    code = {path: text for path, text in sources.items() if path.suffix == ".py"}
    trees = {path: ast.parse(text) for path, text in code.items()}
    packages: dict[str, Counter[str]] = {}
    folders = Counter[str]()
    for path, text in code.items():
        found = packages.setdefault(path.parts[0], Counter())
        found["modules"] += 1
        found["code_lines"] += code_lines(text, trees[path])
        found["inner_imports"] += inner_imports(trees[path])
        folders[str(path.parent)] += path.name not in ("__init__.py", "__main__.py")
    inner = {path: tree for path, tree in trees.items() if path.parts[0] not in APART}
    rows = {name: {**found, **largest(folders, name)} for name, found in sorted(packages.items())}
    inside = [name for name in rows if name not in APART]
    keys = ("modules", "code_lines", "inner_imports")
    return {
        "packages": rows,
        "total": {key: sum(rows[name][key] for name in inside) for key in keys},
        "folders": dict(sorted(folders.items())),
        "circles": circles(inner),
        "measures": measures(inner, sources),
    }


def measures(trees: Mapping[PurePosixPath, ast.Module], sources: Sources) -> dict[str, int]:
    """What is spelled by hand or named twice in the packages, and words of the pages.

    Args:
        trees: of the packages.
        sources: files of the tree, pages included.
    """
    nodes = [(path, node) for path, tree in trees.items() for node in ast.walk(tree)]
    above = [tree for path, tree in trees.items() if path.parts[0] == APPLICATION]
    classes = Counter(node.name for _, node in nodes if isinstance(node, ast.ClassDef))
    files = Counter(path.name for path in trees if path.name not in ("__init__.py", "__main__.py"))
    numbers = (constants(node) for tree in trees.values() for node in tree.body)
    return {
        "dict[str, Any] above the run": sum(map(any_dicts, above)),
        "subscripts by a string above the run": sum(map(string_subscripts, above)),
        "class names used twice": sum(count > 1 for count in classes.values()),
        "file names used twice": sum(count > 1 for count in files.values()),
        '"tell", "tells", "told" in code': sum(len(TELLING.findall(sources[path])) for path in trees),
        "numeric constants of modules": sum(numbers),
    } | {
        f"words of {name}": sum(
            len(text.split())
            for path, text in sources.items()
            if any(path.parent == PurePosixPath(one).parent and path.match(one) for one in patterns)
        )
        for name, patterns in PROSE.items()
    }


TELLING = re.compile(r"\b(?:tell|tells|told)\b")
"""A symptom of private words, and no aim."""


def constants(node: ast.stmt) -> int:
    """Names in capitals that an assignment gives numbers."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return 0
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    names = [one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
    values = [one.value for one in ast.walk(node.value) if isinstance(one, ast.Constant)]
    return sum(map(str.isupper, names)) if any(type(value) in (int, float) for value in values) else 0


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
