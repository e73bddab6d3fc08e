"""The files of a study: document, spreadsheet and page."""

from pathlib import Path

from relief.ground.files import write_atomically
from retouch.laboratory.studies.document import StudyDocument, document, document_bytes, spreadsheet
from retouch.laboratory.studies.engine import DOCUMENT, PAGE, SPREADSHEET, Rows
from retouch.laboratory.studies.page import page
from retouch.laboratory.studies.rows import Expanded
from retouch.laboratory.studies.study_file import Study


def write_study(out: Path, study: Study, expanded: Expanded, rows: Rows, quick: bool) -> StudyDocument:
    """Write document, spreadsheet and page of a study; each file appears whole.

    Args:
        out: folder of the study.
        study, expanded, rows: the study, its rows, and what is known of them.
        quick: whether it is the quick form of the study.

    Returns:
        The document.
    """
    content = document(study, expanded, rows, quick)
    write_files(out, content, page(content, out))
    return content


def write_files(out: Path, content: StudyDocument, shown: bytes, name: str = PAGE) -> None:
    """Write a document, its spreadsheet, and the page that shows it by name; each file appears whole."""
    write_atomically(out / DOCUMENT, document_bytes(content))
    write_atomically(out / SPREADSHEET, spreadsheet(content))
    write_atomically(out / name, shown)
