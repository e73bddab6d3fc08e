"""Warnings of the models, for the page: what the command would print."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from retouch.app.values.findings import Lines

OWN_PACKAGES = ("relief", "tactile", "visual", "optimize", "retouch", "mitsuba_scenes")
"""Packages whose warnings are for the person."""


class KeptWarnings(logging.Handler):
    """Keeps the warnings of the packages."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record."""
        if record.name.partition(".")[0] in OWN_PACKAGES:
            self._texts.append(record.getMessage())

    @property
    def lines(self) -> Lines:
        """Each warning once, under the word "warning"."""
        return tuple(("warning", text) for text in dict.fromkeys(self._texts))


@contextmanager
def kept_warnings() -> Iterator[KeptWarnings]:
    """Keeps the warnings of a block."""
    handler = KeptWarnings()
    logging.getLogger().addHandler(handler)
    try:
        yield handler
    finally:
        logging.getLogger().removeHandler(handler)
