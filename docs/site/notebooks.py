"""Notebooks: as Markdown for the site, and executed with their outputs written back.

python -m docs.site.notebooks        # execute all of docs/tutorials/notebooks, and keep what they show
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "tutorials" / "notebooks"
SIZE = "SAMPLES = 128"
"""Line of each notebook that says how finely its reliefs are sampled; tests take fewer."""


def as_markdown(text: str, name: str) -> str:
    """The pages of a notebook with code and outputs, and a link to the notebook itself."""
    parts = []
    for cell in json.loads(text)["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
        else:
            parts += [f"```python\n{source}\n```", *map(_shown, cell["outputs"])]
    parts.insert(1, f"{{download}}`This page as a notebook <{name}.ipynb>`")
    return "\n\n".join(parts)


def _shown(output: dict[str, Any]) -> str:
    """An output as Markdown: what a browser shows best."""
    content = output.get("data", {"text/plain": output.get("text", "")})
    text = {kind: "".join(lines) for kind, lines in content.items()}
    if "text/html" in text:
        return f'``````{{raw}} html\n<div class="output">{text["text/html"]}</div>\n``````'
    if "image/png" in text:
        picture = f'<img alt="" src="data:image/png;base64,{text["image/png"].strip()}">'
        return f"``````{{raw}} html\n{picture}\n``````"
    return f"``````text\n{text['text/plain'].rstrip()}\n``````"


def execute(file: Path, samples: int = 128) -> tuple[dict[str, Any], dict[str, Any]]:
    """Execute the cells of a notebook in an empty folder, as Jupyter would.

    Args:
        file: the notebook.
        samples: a side of its reliefs, in place of those of `SIZE`.

    Returns:
        The notebook with what its cells print and show, and the values of its variables.
    """
    notebook = json.loads(file.read_text(encoding="utf-8"))
    names: dict[str, Any] = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder, _inside(folder):
        for at, cell in enumerate(code_of(notebook), 1):
            source = "".join(cell["source"]).replace(SIZE, f"SAMPLES = {samples}")
            cell |= {"execution_count": at, "outputs": _run(source, f"{file.name}, cell {at}", names, at)}
    return notebook, names


def code_of(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    """Cells of code."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


@contextlib.contextmanager
def _inside(folder: str) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _run(source: str, name: str, names: dict[str, Any], at: int) -> list[dict[str, Any]]:
    """Outputs of a cell: what it prints, and the value of its last expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, name, "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), name, "eval"), names)
    outputs: list[dict[str, Any]] = []
    if text := printed.getvalue():
        outputs.append({"name": "stdout", "output_type": "stream", "text": text.splitlines(keepends=True)})
    if value is not None:
        shown = {"data": _data(value), "execution_count": at, "metadata": {}, "output_type": "execute_result"}
        outputs.append(shown)
    return outputs


def _data(value: Any) -> dict[str, Any]:
    """A value as Jupyter shows it: as HTML, a picture or text."""
    if html := getattr(value, "_repr_html_", None):
        return {"text/html": html().splitlines(keepends=True)}
    if png := getattr(value, "_repr_png_", None):
        return {"image/png": base64.b64encode(png()).decode("ascii")}
    return {"text/plain": repr(value).splitlines(keepends=True)}


def main() -> None:
    for file in sorted(FOLDER.glob("*.ipynb")):
        notebook, _ = execute(file)
        file.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(file.name)


if __name__ == "__main__":
    main()
