"""Standard streams that take every text, show it plainly, and fail in a way that the command foresees."""

import codecs
import contextlib
import io
import os
import sys
import unicodedata
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO, cast

from relief.ground.formatting import plain

SPELT = {"µ": "u", "±": "+-", "–": "-", "−": "-", "×": "x"}
"""ASCII for characters that have no decomposition of their own in Unicode, as "²" has."""
HANDLER = "retouch.spelt"
"""Name of `spelt` among the error handlers of Python's codecs."""


def spelt(error: UnicodeError) -> tuple[str, int]:
    """Characters that an encoding lacks, spelt in ASCII, "?" for the rest; an error handler of codecs."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = error.object[error.start : error.end]
    plain = (unicodedata.normalize("NFKD", one).encode("ascii", "ignore").decode() for one in lacking)
    return "".join(SPELT.get(one) or text or "?" for one, text in zip(lacking, plain, strict=True)), error.end


class _Stream:
    """A stream that is led to nowhere once it has failed, so that the interpreter's last flush succeeds.

    If the stream is `needed`, each write and flush from then on raises an OSError that names the stream:
    argparse lets no error of a write through, but none of a flush is lost.

    Characters that a terminal would obey become question marks, but for those that are written `as_is`.
    """

    def __init__(self, stream: TextIO, name: str, needed: bool) -> None:
        self.stream, self._name, self._needed = stream, name, needed
        self._failure: OSError | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)

    def write(self, text: str) -> int:
        return self.as_is.write(plain(text))

    @property
    def as_is(self) -> "_AsIs":
        """The stream for a writer that shows text plainly itself, and moves the cursor."""
        return _AsIs(self)

    def flush(self) -> None:
        self.attempt(self.stream.flush)

    def attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            self._failure = OSError(error.errno, error.strerror, self._name)
            with contextlib.suppress(io.UnsupportedOperation):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self.stream.fileno())
                os.close(nowhere)
        if self._needed and self._failure is not None:
            raise self._failure


class _AsIs:
    """A stream whose text is written as it is."""

    def __init__(self, stream: _Stream) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        self._stream.attempt(lambda: self._stream.stream.write(text))
        return len(text)


@contextlib.contextmanager
def standard_streams() -> Iterator[None]:
    """Standard streams for the command.

    A closed stream leads to nowhere. Characters that an encoding lacks are spelt in ASCII. A failure of
    stdout raises an OSError that names it; one of stderr is forgotten, as a lost message must not end a run.
    """
    codecs.register_error(HANDLER, spelt)
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Else the next file to be opened would get the number, and what libraries print into it.
            os.open(os.devnull, os.O_RDWR)
    with contextlib.ExitStack() as stack:
        streams = []
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name)
            if stream is None:
                stream = stack.enter_context(Path(os.devnull).open("w", encoding="utf-8"))
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors=HANDLER)
            streams.append(cast(TextIO, _Stream(stream, name, needed=name == "stdout")))
        stack.enter_context(contextlib.redirect_stdout(streams[0]))
        stack.enter_context(contextlib.redirect_stderr(streams[1]))
        yield
