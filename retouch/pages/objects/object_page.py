"""Pages about one object that the mouse turns: what `retouch wrap` will make, and how a print file feels."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from relief.ground.files import write_atomically
from retouch.pages.rendering import render_page


class Card(NamedTuple):
    """A key figure: its name, the number with its unit, and a sentence about it."""

    name: str
    number: str
    unit: str
    text: str


def write_object_page(
    path: Path,
    kind: str,
    title: str,
    deck: str,
    viewer: Markup,
    cards: Sequence[Card],
    notes: Sequence[str],
) -> Path:
    """Write a page, atomically; it fetches nothing from a network.

    Args:
        path: of the page.
        kind: of page, in a word.
        title: heading; text of any kind, as all that follows.
        deck: the sentence below the heading.
        viewer: a figure of `retouch.pages.viewer`.
        cards: key figures.
        notes: sentences about what is shown.

    Returns:
        The path of the page.
    """
    page = render_page(
        "object.html.j2",
        scripts=(),
        viewer=True,
        kind=kind,
        pair={"title": title},
        deck=deck,
        figure=viewer,
        cards=cards,
        notes=notes,
    )
    write_atomically(path, page)
    return path
