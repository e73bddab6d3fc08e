"""Rough time of a study, for a list of studies."""

from dataclasses import dataclass

from optimize.estimates.forecast import rough_seconds
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import Study
from retouch.laboratory.workers.choice import cores


@dataclass(frozen=True)
class RoughTime:
    """Number of different rows of a study, and about how many minutes they take here."""

    rows: int
    minutes: float


def about(study: Study, quick: bool) -> RoughTime:
    """Number of different rows of a study, and about how many minutes they take here.

    Textures count as 128 x 128 samples, and scenes as the studio.
    """
    rows = expand(study, quick).rows
    measures = sum(MEASURES[name].seconds for name in study.measures)
    seconds = sum(rough_seconds(row.settings) + measures for row in rows.values())
    return RoughTime(len(rows), seconds / 60.0 / cores())
