"""Pages from templates: one file each that needs no network, its only script allowed by hash."""

import base64
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from markupsafe import Markup

from retouch.pages import meanings
from retouch.pages.plate_viewer import SCRIPTS
from retouch.pages.templates import asset, html

Context = dict[str, Any]
"""Values of a template, by the names in it."""


def render_page(
    template: str,
    scripts: Sequence[str] = (),
    images: str = "",
    viewer: bool = False,
    plates: bool = False,
    **context: Any,
) -> bytes:
    """A page in UTF-8.

    Args:
        template: name of a file in `templates`.
        scripts: names of files in `templates` that become the script of the page.
        images: sources of pictures beside those within the page, as a content security policy names them.
        viewer: whether the page has figures of `retouch.pages.viewer`, which need their script and style.
        plates: whether the page has figures of `retouch.pages.plate_viewer`.
        context: what the template shows; text is escaped, and characters that a browser obeys are shown as ?.
    """
    code, style = [asset(f"templates/{name}") for name in scripts], asset("templates/page.css")
    if viewer:
        code, style = [*code, asset("viewer/viewer.js")], style + asset("viewer/viewer.css")
    if plates:
        code += [asset(f"plate_viewer/{name}") for name in (*SCRIPTS, "plate_figures.js")]
        style += asset("plate_viewer/plate_viewer.css")
    script = Markup("\n").join(code)
    page = html(
        template,
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii"),
        images=images,
        style=style,
        meanings=meanings.MEANINGS,
        status=meanings,
        **context,
    )
    return page.encode()


def leaves(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Every leaf of nested mappings as dotted name and text; a list of numbers is one leaf."""
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for place, item in enumerate(value, start=1):
                yield from leaves(item, f"{prefix}{key}.{place}.")
        elif isinstance(value, list | tuple):
            yield f"{prefix}{key}", ", ".join(_text(item) for item in value)
        else:
            yield f"{prefix}{key}", _text(value)


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "\N{EN DASH}" if value is None else str(value)
