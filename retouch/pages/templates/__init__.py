"""HTML of pages and of their parts, from the templates in this folder."""

import json
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from relief.ground.formatting import between, duration, number, percent, plain, plus_minus, rounded


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("retouch.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "percent": percent, "duration": duration, "rounded": rounded}
    environment.globals |= {"between": between, "plus_minus": plus_minus}
    return environment


def html(template: str, **context: Any) -> Markup:
    """A template of this folder, filled in.

    Args:
        template: name of the file.
        context: what it shows; text is escaped, and characters that a browser obeys are shown as ?.
    """
    return Markup(plain(_environment().get_template(template).render(**context)))


def as_json(data: Any) -> Markup:
    """JSON for a script element, which no text in it can end."""
    return Markup(json.dumps(data, separators=(",", ":")).replace("<", r"\u003c"))


@cache
def asset(path: str) -> Markup:
    """The text of a script or of a style sheet.

    Args:
        path: of the file in `retouch/pages`.
    """
    return Markup(files("retouch.pages").joinpath(path).read_text(encoding="utf-8"))
