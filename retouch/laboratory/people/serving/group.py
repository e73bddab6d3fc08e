"""Answers of a group of people, written to disk as they are given.

Each group has a folder in that of the plan, named by its begin and the digest of plan and plates: no answer
counts for other plates, and a new group changes no file of the last one. `acts.jsonl` there gets a line for
each answer and each one taken back, as the page numbers them (`experiment_answers.js`); the tables, which
`retouch answers` reads, are written whole after each of them.
"""

import json
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, Field, TypeAdapter

from relief.ground.errors import InputError
from relief.ground.files import read_limited, write_atomically
from retouch.laboratory.people.plan import ANSWERS, csv_bytes
from retouch.laboratory.people.reading import HEADINGS, MAGNITUDES, NO, SAME, SORTS, TRIAL, YES

ACTS = "acts.jsonl"
LARGEST_FILE = 1 << 28
"""Most bytes of the acts, and of the page: those of 300 people take 10 and 2 MB."""
LARGEST_MAGNITUDE = 1e100
"""Magnitudes are smaller, as on the page."""

Question = Literal["rougher", "colder", "same", "sorts", "magnitudes"]
Rows = list[list[Any]]


class Plan(BaseModel):
    """The plan as in the page: see `TrialPlan.as_json`."""

    digest: Annotated[str, Field(pattern="^[0-9a-f]{16}$")]
    labels: list[str]
    trials: dict[Question, dict[str, list[list[int]]]]


class Act(NamedTuple):
    """An answer to a trial, from 0 on; None where that answer is taken back."""

    person: str
    question: Question
    number: Annotated[int, Field(ge=0, lt=1 << 20)]
    trial: Annotated[int, Field(ge=0)]
    answer: int | float | list[int] | None


class Group:
    """Answers of a group of people, on disk.

    Args:
        folder: of the plan.
        plan: as in the page.

    Attributes:
        name: of the group; names ascend.
        acts: by person, question and number.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.plan, self._within = plan, folder
        self.acts: dict[tuple[Any, ...], Act] = {}
        begin, end = self._folder_of("*").name.split("*")
        groups = folder.glob(f"{begin}[0-9]*{end}")
        self.name = max((one.name.removeprefix(begin).removesuffix(end) for one in groups), default="")
        if not self.name:
            self.begin()
        elif (self.folder / ACTS).is_file():
            for line in read_limited(self.folder / ACTS, LARGEST_FILE).splitlines():
                # A line that a full disk cut off was never confirmed to the page, which sends the act again.
                with suppress(ValueError):
                    act = TypeAdapter(Act).validate_json(line)
                    self.acts[act[:3]] = self.checked(act)
            self._write_tables()

    @property
    def folder(self) -> Path:
        """The folder of the group."""
        return self._folder_of(self.name)

    def _folder_of(self, name: str) -> Path:
        return self._within / f"{ANSWERS}{name}-{self.plan.digest[:8]}"

    def begin(self) -> None:
        """Begin with a new group, whose name follows that of the last one even if the clock was set back."""
        name = max(time.strftime("%Y%m%dT%H%M%S"), f"{self.name}0")
        self._folder_of(name).mkdir()
        self.name, self.acts = name, {}

    def add(self, acts: list[Act]) -> bool:
        """Write checked acts to disk; False, and none is written, if one has the number of another act.

        Raises:
            OSError: the disk is full, or the folder is gone.
        """
        if any(self.acts.get(act[:3], act) != act for act in acts):
            return False
        with (self.folder / ACTS).open("ab") as journal:
            # Each line begins anew, behind whatever a full disk has left of the last one.
            journal.write("".join(f"\n{json.dumps(act)}" for act in acts).encode())
            journal.flush()
            os.fsync(journal.fileno())
        self.acts |= {act[:3]: act for act in acts}
        self._write_tables({act.question for act in acts})
        return True

    def checked(self, act: Act) -> Act:
        """The act. Raises InputError if the plan has no such trial, or the act is no answer to the trial."""
        try:
            self._rows(act)
        except (LookupError, TypeError, ValueError):
            raise InputError(f"{act.question}: this is no answer to a trial of the plan") from None
        return act

    def _rows(self, act: Act) -> Rows:
        """Rows of the table. Raises LookupError, TypeError or ValueError for what is no answer."""
        answer: Any = act.answer
        places = self.plan.trials[act.question][act.person][act.trial]
        begin, labels = [act.person, act.trial + 1], [self.plan.labels[place] for place in places]
        if answer is None:
            return []
        if act.question == SORTS:
            if sorted(answer) != sorted(places):
                raise ValueError
            name = f"{TRIAL} {act.trial + 1}"
            return [[*begin, name, k, self.plan.labels[place]] for k, place in enumerate(answer, start=1)]
        if act.question == MAGNITUDES:
            if not 0 < answer < LARGEST_MAGNITUDE:
                raise ValueError
            return [[*begin, *labels, answer]]
        return [[*begin, *labels, ((YES, NO) if act.question == SAME else labels)[(0, 1).index(answer)]]]

    def _write_tables(self, questions: set[Question] | None = None) -> None:
        """Write the tables of these questions; by default, of all that anybody has answered."""
        for question in questions or {act.question for act in self.acts.values()}:
            standing: dict[tuple[str, int], Rows] = {}
            for act in sorted(act for act in self.acts.values() if act.question == question):
                if act.answer is None:
                    standing.pop((act.person, act.trial), None)
                else:
                    standing.setdefault((act.person, act.trial), self._rows(act))
            person, *others = HEADINGS[question]
            rows = [[person, TRIAL, *others], *(row for _, each in sorted(standing.items()) for row in each)]
            write_atomically(self.folder / f"{ANSWERS}{question}.csv", csv_bytes(rows))
