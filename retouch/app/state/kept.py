"""Kept: the file that keeps the document and the queue for the next start.

What cannot be read of it, because it was cut off or a later version wrote it, is left out. The file then
stays beside the next one, under another name.
"""

import itertools
import json
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from relief.ground.errors import InputError
from relief.ground.files import read_limited, write_atomically
from relief.ground.formatting import plain
from relief.ground.lengths import shown
from retouch.app.state.runs import QueuedRun
from retouch.app.values.document import AppDocument, KeptFeel
from retouch.app.values.folders import RUNS_FOLDER, is_run

KEPT = RUNS_FOLDER / "app.json"
"""The file."""
LARGEST_KEPT = 1 << 20
"""Most bytes of the file; a thousand times the usual."""

_DOCUMENT, _FEEL = TypeAdapter(AppDocument), TypeAdapter[Any](KeptFeel)


def write_kept(document: AppDocument, jobs: Iterable[QueuedRun]) -> None:
    """Write the file. Raises OSError."""
    content = {"document": document.as_json(), "queue": [_entry(job) for job in jobs]}
    write_atomically(KEPT, json.dumps(content, indent=1).encode())


def read_kept() -> tuple[AppDocument, list[QueuedRun], str]:
    """Read what an earlier start has kept.

    Returns:
        The document, the runs, and a line about what could not be read, which is empty if all was. The line
        states the new name of the file.

    Raises:
        OSError: not all could be read, and the file cannot be renamed.
    """
    if not KEPT.is_file():
        return AppDocument(), [], ""
    content, document, jobs = None, AppDocument(), []
    try:
        text = read_limited(KEPT, LARGEST_KEPT)
        content = json.loads(text, object_pairs_hook=_without_halves)
        document = _document(json.loads(text, object_pairs_hook=_without_halves).get("document", {}))
        jobs = [_job(entry) for entry in content.get("queue", [])]
    except (InputError, ValueError, RecursionError, AttributeError, TypeError):
        # No JSON, or other values than the two in it; what could be read is taken.
        pass
    read = {"document": document.as_json(), "queue": [job and _entry(job) for job in jobs]}
    unread = _unread(content, json.loads(json.dumps(read)))
    runs = [job for job in jobs if job is not None]
    if not unread:
        return document, runs, ""
    names = (KEPT.with_name(f"{KEPT.name}.unread-{number}") for number in itertools.count(1))
    beside = next(name for name in names if not os.path.lexists(name))
    KEPT.rename(beside)
    what = shown(", ".join(unread)) or "all of it"
    return document, runs, f"{KEPT}: not read: {what}; the file is kept as {beside}"


def _entry(job: QueuedRun) -> dict[str, Any]:
    return {"folder": str(job.folder), "feel": job.feel.as_json()}


def _without_halves(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON with `{}`, which no field can be, for texts that cannot be shown: halves of pairs."""
    content: dict[str, Any] = {}
    for name, value in pairs:
        content[plain(name)] = value
        try:
            # What an object holds has been looked at before.
            isinstance(value, dict) or json.dumps(value, ensure_ascii=False).encode()
        except UnicodeEncodeError:
            content[plain(name)] = {}
    return content


def _document(content: Any) -> AppDocument:
    """The document of a file, without the parts that cannot be read; the content is changed."""
    while isinstance(content, dict):
        try:
            document = _DOCUMENT.validate_python(content)
            own_run = document.run is None or is_run(document.run)
            return document if own_run else replace(document, run=None)
        except ValidationError as error:
            # The innermost part that has a name.
            holder, (name, *inner) = content, error.errors()[0]["loc"]
            while inner and isinstance(holder[name], dict) and inner[0] in holder[name]:
                holder, (name, *inner) = holder[name], inner
            del holder[name]
    return AppDocument()


def _job(entry: Any) -> QueuedRun | None:
    """A run of a file; None if it cannot be read whole: it would be another run."""
    try:
        job = QueuedRun(Path(entry["folder"]), _FEEL.validate_python(entry["feel"]))
    except (ValueError, TypeError, LookupError):
        return None
    return None if _unread(entry, json.loads(json.dumps(_entry(job)))) or not is_run(job.folder) else job


def _unread(content: Any, read: Any, name: str = "") -> list[str]:
    """Names of what a file holds and what was read of it does not."""
    parts: Iterable[tuple[Any, Any, Any]]
    if isinstance(content, dict) and isinstance(read, dict):
        parts = ((key, value, read.get(key)) for key, value in content.items())
    elif isinstance(content, list) and isinstance(read, list) and len(content) == len(read):
        parts = zip(itertools.count(1), content, read)
    else:
        return [] if content == read else [name]
    return [one for key, value, kept in parts for one in _unread(value, kept, f"{name}.{key}".strip("."))]
