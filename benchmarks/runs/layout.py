"""Layout of the code: modules in each folder, import circles, lines of code; of this tree or of a commit.

python -m benchmarks.runs.layout               # this tree
python -m benchmarks.runs.layout 3022866       # a commit, for comparison
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
import tempfile
import tokenize
from collections import Counter
from pathlib import Path

import networkx

from benchmarks.shared.common import ROOT, table

PACKAGES = ("retouch", "optimize", "visual", "tactile", "surrogate", "relief", "mitsuba_scenes")
LAYOUT_TOKENS = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}


def main() -> None:
    if len(sys.argv) == 1:
        report(ROOT)
        return
    archive = subprocess.run(["git", "archive", sys.argv[1]], capture_output=True, check=True).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(archive)) as content:
            content.extractall(folder, filter="data")
        report(Path(folder))


def report(root: Path) -> None:
    """Print the tables for a checkout."""
    files = [path for package in PACKAGES for path in sorted((root / package).rglob("*.py"))]
    modules = {module_name(path.relative_to(root)): path for path in files}
    trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in modules.items()}
    folders = Counter(
        str(path.parent.relative_to(root))
        for path in files
        if path.name not in ("__init__.py", "__main__.py")
    )
    lines = Counter[str]()
    for name, path in modules.items():
        lines[str(path.parent.relative_to(root))] += lines_of_code(path, trees[name])
    print(table(("folder", "modules", "lines"), [(f, folders[f], lines[f]) for f in sorted(lines)]))
    statements = sum(isinstance(node, ast.stmt) for tree in trees.values() for node in ast.walk(tree))
    print(f"{sum(lines.values())} lines, {statements - documented(trees)} statements, docstrings not counted")
    print("import circles:", circles(trees) or "none")


def module_name(path: Path) -> str:
    """Dotted name of a module by its path in the checkout."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def docstrings(tree: ast.AST) -> list[ast.Expr]:
    """Statements that are a string and nothing else."""
    expressions = [node for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    return [e for e in expressions if isinstance(e.value, ast.Constant) and isinstance(e.value.value, str)]


def documented(trees: dict[str, ast.Module]) -> int:
    """Number of docstrings."""
    return sum(len(docstrings(tree)) for tree in trees.values())


def lines_of_code(path: Path, tree: ast.AST) -> int:
    """Lines of a file without blanks, comments and docstrings."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type not in LAYOUT_TOKENS:
            lines |= set(range(token.start[0], token.end[0] + 1))
    for docstring in docstrings(tree):
        lines -= set(range(docstring.lineno, (docstring.end_lineno or docstring.lineno) + 1))
    return len(lines)


def circles(trees: dict[str, ast.Module]) -> list[list[str]]:
    """Sets of modules that import one another, in functions and for type checkers included."""
    graph: networkx.DiGraph[str] = networkx.DiGraph()
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                full = [f"{node.module}.{alias.name}" for alias in node.names]
                graph.add_edges_from((name, other if other in trees else node.module) for other in full)
    return [sorted(c) for c in networkx.strongly_connected_components(graph) if len(c) > 1]


if __name__ == "__main__":
    main()
