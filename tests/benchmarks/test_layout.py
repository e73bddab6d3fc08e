"""The layout of the code, counted in small sources."""

import ast
from pathlib import PurePosixPath

import pytest

from benchmarks.runs.layout import any_dicts, as_text, code_lines, measured, of_tree, string_subscripts
from benchmarks.shared.common import ROOT

SOURCES = {
    PurePosixPath(name): text
    for name, text in {
        "room/__init__.py": '"""A room."""\n',
        "room/first.py": '"""A module.\n\nLines.\n"""\n# Why.\nfrom room import second\n\nIT = second\n',
        "room/second.py": "def late():\n    import os\n    from room.first import IT\n    print(os, IT)\n",
        "room/inner/third.py": "import room.second\n",
        "tests/test_room.py": "def test() -> None:\n    import room\n",
    }.items()
}


def test_modules_lines_and_imports_are_counted_by_package() -> None:
    found = measured(SOURCES)
    assert found["packages"]["room"] == {
        "modules": 4,
        "code_lines": 7,
        "inner_imports": 2,
        "largest_folder": "room",
        "its_modules": 2,
    }
    assert found["total"] == {"modules": 4, "code_lines": 7, "inner_imports": 2}
    assert found["folders"] == {"room": 2, "room/inner": 1, "tests": 1}


def test_circles_run_through_functions_and_leave_tests_out() -> None:
    found = measured(SOURCES)
    assert found["circles"] == [["room.first", "room.second"]]
    assert "import circles: room.first room.second" in as_text(found)


def test_strings_that_are_values_are_code() -> None:
    text = 'def one() -> str:\n    """Doc."""\n    return """a\n    b"""\n'
    assert code_lines(text, ast.parse(text)) == 3


def test_what_is_named_twice_or_spelled_by_hand_is_counted() -> None:
    text = (
        'LIMITS = (1, 2.5)\n_x = 3\nclass Part: ...\ndef f(told: dict[str, Any]): return told["a"], told[0]\n'
    )
    sources = {PurePosixPath(f"retouch/{room}/same.py"): text for room in ("one", "two")}
    pages = {PurePosixPath("README.md"): "Three words here", PurePosixPath("docs/a/b.md"): "no guide"}
    found = measured({**sources, **pages})["measures"]
    assert list(found.values()) == [2, 2, 1, 1, 6, 2, 3, 0, 0, 0]


def test_untyped_values_are_counted_but_for_documents_and_annotations() -> None:
    source = """
def read(rows: dict[str, Any]) -> "list[str]":
    return [rows["name"], rows["size"]["mm"], rows[key]]

def of(kind: Literal["touch"]) -> None: ...

class Result:
    def as_json(self) -> dict[str, Any]: ...
"""
    tree = ast.parse(source)
    assert any_dicts(tree) == 1 and string_subscripts(tree) == 3


@pytest.mark.slow
def test_no_folder_of_benchmarks_is_a_flat_list() -> None:
    own = {path: text for path, text in of_tree(ROOT).items() if path.parts[0] == "benchmarks"}
    assert max(measured(own)["folders"].values()) <= 16
