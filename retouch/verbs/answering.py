"""Answers: what people answered about a set of stimuli, beside what was predicted."""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError
from relief.ground.files import permitted, write_atomically
from relief.ground.progress import Progress
from retouch.laboratory.people.analysis import AnswersResults, analysed
from retouch.laboratory.people.lines import lines_of
from retouch.laboratory.people.page import DOCUMENT, PAGE, page
from retouch.laboratory.people.serving.server import serve as serve
from retouch.laboratory.people.tables import ColumnMap
from retouch.pages.sentences import TextTable
from retouch.verbs.progress_display import followed


@dataclass(frozen=True)
class PeoplesAnswers:
    """What people's answers say.

    Attributes:
        results: of the answers; without answers, what the plan can say.
        page: the page; None without answers.
    """

    results: AnswersResults
    page: Path | None

    @property
    def content(self) -> dict[str, Any]:
        """The content of `answers.json`; without answers, the prediction of the plan under `power`."""
        return self.results.as_json()

    def as_json(self) -> dict[str, Any]:
        """What `retouch answers --json` prints."""
        return self.content | {"written": [str(self.page)] if self.page else []}

    def lines(self) -> Iterator[str | TextTable]:
        """Lines and tables for a person."""
        yield from lines_of(self.results)
        if self.page is not None:
            yield f"written: {self.page}"


def answers(
    folder: str | os.PathLike[str],
    files: Sequence[str | os.PathLike[str]] = (),
    out: str | os.PathLike[str] | None = None,
    *,
    partial: bool = False,
    without: Sequence[str] = (),
    columns: Mapping[str, str] | None = None,
    values: Mapping[str, Mapping[str, str]] | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> PeoplesAnswers:
    """Analyse people's answers to a set of stimuli, and write a page of the results.

    Args:
        folder: of a finished set (`stimuli`).
        files: CSV tables of answers: pairs, sorts, magnitudes. Without any, the plan alone is analysed.
        out: folder of `answers.html` and `answers.json`; None: that of the set.
        partial: whether people may have left trials of the plan out.
        without: names of people to leave out.
        columns: what another program calls the columns, as in {"rougher": "key_resp.keys"}; `#` stands for
            the number of a trial.
        values: what the cells of a column mean, as in {"rougher": {"left": "first", "right": "second"}}.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: the folder is no finished set, or the answers are not to it.
    """
    folder = Path(folder)
    if not files and (partial or without or columns or values):
        raise InputError(
            "files: answers are missing", f"answers {folder}: name a file of answers, as in answers.csv"
        )
    with followed(progress, quiet):
        results = analysed(
            folder, [Path(file) for file in files], partial, without, ColumnMap(columns or {}, values or {})
        )
        if not files:
            return PeoplesAnswers(results, None)
        to = folder if out is None else Path(out)
        with permitted(to):
            text = json.dumps(results.as_json(), indent=1, allow_nan=False) + "\n"
            shown = page(results)
            write_atomically(to / DOCUMENT, text.encode())
            write_atomically(to / PAGE, shown)
    return PeoplesAnswers(results, to / PAGE)
