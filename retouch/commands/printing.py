"""Results of verbs on the screen: lines and tables in turn."""

from collections.abc import Iterable

from retouch.commands.options import console, table
from retouch.pages.sentences import TextTable


def print_lines(lines: Iterable[str | TextTable]) -> None:
    """Print lines and tables in their order."""
    for line in lines:
        if isinstance(line, str):
            print(line)
        else:
            console().print(table(line.columns, line.rows, line.gap))
