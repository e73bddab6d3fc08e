"""Sphinx reads the pages where GitHub shows them; `make docs` builds build/site."""

import re
import sys
from functools import partial
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from docs.site import api, commands, notebooks  # noqa: E402

project = "Retouch"
copyright = "the Retouch developers"
extensions = ["myst_parser"]
root_doc = "docs/index"
source_suffix = {".md": "markdown", ".ipynb": "markdown"}
# The root is read, so that links from a page to the README or to a result lead somewhere on the site too.
include_patterns = ["*.md", "docs/**.md", "docs/**.ipynb", "mitsuba_scenes/textures/README.md"]
exclude_patterns = [".*", "build", "dist", "runs", "**/node_modules", "**/__pycache__"]
default_role = "code"
myst_heading_anchors = 6
myst_enable_extensions = ["deflist", "dollarmath"]
myst_dmath_double_inline = True
suppress_warnings = ["myst.header"]  # a page of generated text has headings of its own depth
html_theme = "furo"
html_title = "Retouch"
html_static_path = ["style.css"]
html_css_files = ["style.css"]
html_extra_path = ["index.html"]
html_copy_source = False
html_theme_options = {"navigation_with_keys": False}
pygments_style, pygments_dark_style = "default", "monokai"
python_use_unqualified_type_names = True
GENERATED = {
    "commands": commands.reference,
    **{name: partial(api.reference_of, name) for name in api.PACKAGES},
}
"""What stands on the site in place of a comment `<!-- on the site: NAME -->`, which GitHub does not show."""


def read(_: object, page: str, source: list[str]) -> None:
    """The text of a page as the site has it."""
    if source[0].startswith("{"):
        source[0] = notebooks.as_markdown(source[0], Path(page).name)
    if page == root_doc:
        source[0] += (ROOT / "docs/site/navigation.txt").read_text(encoding="utf-8")
    source[0] = re.sub(r"<!-- on the site: (\w+) -->", lambda found: GENERATED[found[1]](), source[0])


def inline_mathematics(writer: Any, node: nodes.math) -> None:
    """MathML, which browsers draw without a script and without a network."""
    writer.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def block_mathematics(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="mathematics">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> None:
    app.connect("source-read", read)
    app.add_html_math_renderer("mathml", (inline_mathematics, None), (block_mathematics, None))


html_math_renderer = "mathml"
