"""Error messages of Mitsuba and of file formats, as one line for a person."""

import re


def last_line(error: Exception) -> str:
    """The last line of an error, which is its cause, without Mitsuba's note on its own source."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return re.sub(r"\[\w+\.cpp:\d+\] ", "", lines[-1]) if lines else type(error).__name__
