"""Pages from templates: one file each that needs no network, its only script allowed by hash."""

import base64
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from relief.ground.formatting import between, duration, number, percent, plain, plus_minus, rounded
from retouch.pages import meanings
from retouch.pages.plate_viewer import figure as plate_viewer
from retouch.pages.viewer.figure import asset

Context = dict[str, Any]
"""Values of a template, by the names in it."""


def render_page(
    template: str,
    scripts: Sequence[str] = ("pairs.js", "profile.js"),
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
    environment = Environment(
        loader=PackageLoader("retouch.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "percent": percent, "duration": duration, "rounded": rounded}
    environment.globals |= {
        "between": between,
        "plus_minus": plus_minus,
        "meanings": meanings.MEANINGS,
        "status": meanings,
    }
    code = [environment.get_template(name).render() for name in scripts]
    style = environment.get_template("page.css").render()
    if viewer:
        code, style = [*code, asset("viewer.js")], style + asset("viewer.css")
    if plates:
        code += [plate_viewer.component(), plate_viewer.asset("plate_figures.js")]
        style += plate_viewer.asset("plate_viewer.css")
    script = "\n".join(code)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    page = environment.get_template(template).render(
        script=Markup(script),
        script_hash=digest,
        images=images,
        style=Markup(style),
        **context,
    )
    return plain(page).encode()


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
