"""The files of a study: document, spreadsheet and page."""

from pathlib import Path

from optimize.studies.document import Document, document, document_bytes, spreadsheet
from optimize.studies.engine import DOCUMENT, PAGE, SPREADSHEET, Rows
from optimize.studies.page import page
from optimize.studies.rows import Expanded
from optimize.studies.study_file import Study
from relief.files import write_atomically


def write_study(out: Path, study: Study, expanded: Expanded, rows: Rows, quick: bool) -> Document:
    """Write document, spreadsheet and page of a study; each file appears whole.

    Args:
        out: folder of the study.
        study, expanded, rows: the study, its rows, and what is known of them.
        quick: whether it is the quick form of the study.

    Returns:
        The document.
    """
    content = document(study, expanded, rows, quick)
    write_atomically(out / DOCUMENT, document_bytes(content))
    write_atomically(out / SPREADSHEET, spreadsheet(content))
    write_atomically(out / PAGE, page(content, out))
    return content
