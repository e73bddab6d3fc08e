"""Error messages of Mitsuba and of file formats, as one line for a person."""

import re

LONGEST = 300
"""Most characters of a message; Mitsuba repeats bad values however long they are."""


def last_line(error: Exception) -> str:
    """The last line of an error, which is its cause, without Mitsuba's note on its own source."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    line = re.sub(r"\[\w+\.cpp:\d+\] ", "", lines[-1]) if lines else type(error).__name__
    return line if len(line) <= LONGEST else f"{line[:LONGEST]}..."
