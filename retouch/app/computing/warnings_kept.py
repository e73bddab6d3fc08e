"""Warnings of the models, for the page: what the command would print."""

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from retouch.app.values.findings import Lines

OWN_PACKAGES = ("relief", "tactile", "visual", "optimize", "retouch", "mitsuba_scenes")
"""Packages whose warnings are for the person."""


class _Kept(logging.Handler):
    """Keeps the warnings of the packages, each once."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: dict[str, None] = {}

    def emit(self, record: logging.LogRecord) -> None:
        if record.name.partition(".")[0] in OWN_PACKAGES:
            self.texts[record.getMessage()] = None


@contextmanager
def kept_warnings() -> Iterator[Iterable[str]]:
    """The warnings of a block, each once, as they come."""
    handler = _Kept()
    logging.getLogger().addHandler(handler)
    try:
        yield handler.texts
    finally:
        logging.getLogger().removeHandler(handler)


def warning_lines(warnings: Iterable[str]) -> Lines:
    """Warnings as lines, under the word "warning"."""
    return tuple(("warning", text) for text in warnings)
