"""Studies: the file that describes one, and the documents, records and results that one has written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import tomli_w
from hypothesis import strategies as st

from retouch.laboratory.studies.measuring.measures import MEASURES
from tests.fuzz.bases import STUDY
from tests.fuzz.case import HOSTILE, Case, chance, edited, several_edits
from tests.fuzz.run_files import NUMBERS, values
from tests.fuzz.tampered import json_changed

FILE = "study.toml"
DOCUMENT = f"{STUDY}/study.json"
AXES = (
    *("touch.jnd", "texture", "seed", "look.model", "descent.steps", "define.x"),
    *("touch.model", "look.weight", "size_mm", "scene", "touch.roughness", "free", "x", "a.b.c"),
)
SETTINGS = ("seed", "descent.steps", "touch.roughness", "touch.jnd", "define.x", "look.model", "a.b", "")
COLUMNS = ("change_percent", "miss_percent", "touch.jnd", "reason", "touch.model", "x", "time_s.total")


@st.composite
def axis_values(draw: st.DrawFn, axis: str) -> list[Any]:
    """Values of an axis: of a key of a run, or tables with labels."""
    if axis != "free" and not chance(draw, 8):
        return draw(st.lists(values(axis.rpartition(".")[2]), max_size=4))
    keys = st.sampled_from((*SETTINGS, "label", "label"))
    labelled = st.dictionaries(keys, st.sampled_from((1, 0.1, "a", "fast", *NUMBERS)), max_size=3)
    return draw(st.lists(labelled.map(lambda found: {"label": "one", **found}), max_size=3))


@st.composite
def settings_of_rows(draw: st.DrawFn) -> dict[str, Any]:
    """Settings by dotted key."""
    keys = draw(st.lists(st.sampled_from(SETTINGS), max_size=2, unique=True))
    return {key: draw(values(key.rpartition(".")[2])) for key in keys}


@st.composite
def study_tables(draw: st.DrawFn, sound: Mapping[str, Any]) -> dict[str, Any]:
    """The content of a study file: parts of a sound one, and others."""
    content = json.loads(json.dumps(sound))
    for table in content["tables"]:
        axes = draw(st.lists(st.sampled_from(AXES), max_size=2, unique=True))
        table["axes"] |= {axis: draw(axis_values(axis)) for axis in axes}
        table["set"] = draw(settings_of_rows())
    if chance(draw, 3):
        content["set"] = draw(settings_of_rows())
    if chance(draw, 3):
        content["measures"] = draw(st.lists(st.sampled_from((*MEASURES, "x", 1)), max_size=3))
    if chance(draw, 2):
        content["quick"] = {"set": draw(settings_of_rows()), "axes": {"touch.jnd": draw(axis_values("jnd"))}}
    for _ in range(draw(st.integers(0, 2))):
        names = st.sampled_from((*AXES, *COLUMNS))
        plot = {key: draw(names) for key in ("x", "y", "by", "over") if key in "xy" or chance(draw, 2)}
        content.setdefault("plots", []).append(plot)
    if chance(draw, 4):
        content = draw(json_changed(content))
    return content


@st.composite
def studies(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A study that is done, of which the study file or a file that the study has written was tampered with.

    Args:
        base: The study.
        whole: Whether the command draws it anew.
    """
    files = dict(base)
    what = draw(st.sampled_from((FILE,) * 6 + (DOCUMENT,) * 3 + ("study.json",) * 2 + ("result.json",)))
    if what == FILE:
        import tomllib

        table = draw(study_tables(tomllib.loads(files[FILE].decode())))
        try:
            content = tomli_w.dumps(table).encode()
        except (TypeError, ValueError, AttributeError):
            content = repr(table).encode()
        files[FILE] = edited(content, draw(several_edits()) if chance(draw, 3) else [])
    else:
        path = what if what == DOCUMENT else draw(st.sampled_from(_of_rows(files, what)))
        content = json.loads(files[path])
        for _ in range(draw(st.integers(0, 2))):
            content = draw(json_changed(content)) if isinstance(content, dict) and content else content
        files[path] = edited(json.dumps(content).encode(), draw(several_edits()) if chance(draw, 3) else [])
    name = draw(st.sampled_from((FILE,) * 9 + HOSTILE)) if chance(draw, 10) else FILE
    if not whole:
        return Case("studies", files, [name])
    options = draw(st.sampled_from(((), ("--quick",), ("--json",), ("--textures", "."))))
    given = ("--from", DOCUMENT) if what == DOCUMENT else ()
    return Case("studies", files, [], ("study", FILE, "-o", STUDY, "--redraw", *given, *options))


def _of_rows(files: Mapping[str, bytes], name: str) -> list[str]:
    """Files of this name in the folders of rows."""
    return sorted(path for path in files if path.endswith(f"/{name}") and path != DOCUMENT)
