"""Tables of docs/reference, from what the code declares: keys of run files and of JSON, fingers, printers.

python -m benchmarks.docs.reference

A test says whether the pages are current.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any, get_args

from benchmarks.shared.common import DOCS, load, put, table
from mitsuba_scenes.fingers import bundled_skins
from optimize.descent.methods import METHODS, methods_that_take
from optimize.settings.run_file import Run, run_keys
from optimize.settings.skins import SKIN_KEYS, load_skin
from optimize.settings.touch import FEEL_OF_KEYS, GOAL_KEYS, MAPPED
from optimize.verification.section import EachUnder, Section
from optimize.verification.verification import Verification
from relief.printers import PRINTERS, RANGES
from retouch.laboratory.published.findings import FILE
from retouch.laboratory.published.scoreboard import FINGERS
from retouch.pages.compared import Compared
from tactile.quantities import MapKeys

REFERENCE = DOCS / "reference"
Schema = Mapping[str, Any]
"""Schema of JSON."""
UNBOUNDED = 2.0**31
"""Number from which a bound is none to a reader."""
ELSEWHERE = ("look", "fingers", "measured", "surface_bands")
"""Attributes of a comparison whose keys are those of result.json."""


def main() -> None:
    for (page, name), text in tables().items():
        put(REFERENCE / f"{page}.md", name, text)


def tables() -> dict[tuple[str, str], str]:
    """Every table, by its page and its name there."""
    keys = ("key", "meaning")
    return {
        ("run-files", "keys"): table(("key", "value", "default", "method", "meaning"), list(run_rows())),
        ("json", "result"): table(keys, json_rows(Verification)),
        ("json", "compare"): table(keys, json_rows(Compared, ELSEWHERE)),
        ("formats", "fingers"): fingers_table(),
        ("formats", "printers"): printers_table(),
        ("findings", "rules"): rules_table(),
        ("findings", "each-finding"): each_finding_table(),
        ("findings", "findings"): sources_table(),
    }


def attributes(documented: Any) -> dict[str, str]:
    """What the docstrings of a class and of those that it is derived from say of each attribute."""
    found: dict[str, str] = {}
    for one in reversed(documented.__mro__):
        block = (one.__dict__.get("__doc__") or "").partition("Attributes:\n")[2].partition("\n\n")[0]
        for entry in re.split(r"\n {8}(?=\w)", f"\n{block.rstrip()}"):
            names, _, text = " ".join(entry.split()).partition(": ")
            found |= dict.fromkeys(names.split(", "), text)
    return found


def run_rows() -> Iterator[tuple[str, ...]]:
    """Key, values, default, methods that take the key, and meaning, of every key of a run file."""
    schema = Run.model_json_schema()
    for key, default in sorted(run_keys().items(), key=lambda entry: _place(entry[0])):
        section, _, name = key.rpartition(".")
        one = Run.model_fields[section].annotation if section else Run
        assert one is not None
        place = schema["$defs"][one.__name__] if section else schema
        described = "{:g} to {:g}".format(*RANGES[name]) if name in RANGES else ""
        shown = described or _values(place["properties"][name])
        takes = methods_that_take(key)
        methods = ", ".join(takes) if len(takes) < len(METHODS) else ""
        yield f"`{key}`", shown, _default(default), methods, _line((attributes(one) | _goals())[name])
        if key == "touch.region":
            region = schema["$defs"]["Region"]["properties"]
            texts = attributes(get_args(one.model_fields["region"].annotation)[0])
            for part in ("mask", "graded"):
                own = _default(region[part].get("default"))
                yield f"`{key}.{part}`", _values(region[part]), own, "", _line(texts[part])
            yield f"`{key}.GOAL`", "", "", "", f"a goal there: {', '.join(f'`{goal}`' for goal in GOAL_KEYS)}"


def _place(key: str) -> tuple[int, int]:
    """Where a key stands: keys of `[touch]` that state goals before the others, those of the finger last."""
    section, _, name = key.partition(".")
    goals = (*GOAL_KEYS, *(one for each in MAPPED for one in each.map_keys), "axis", "region", *FEEL_OF_KEYS)
    rank = 0 if name in goals else 2 if name in ("skin", *SKIN_KEYS) else 1
    return list(Run.model_fields).index(section), rank if section == "touch" else 0


def _line(text: str) -> str:
    """A meaning as a cell of a table, without the full stop of a single sentence."""
    return text if ". " in text else text.removesuffix(".")


def _goals() -> dict[str, str]:
    """Meanings of the keys that state goals."""
    found = {key: goal.help for key, (_, goal) in GOAL_KEYS.items()}
    for quantity in MAPPED:
        texts = attributes(MapKeys)
        found |= {key: texts[part] for part, key in quantity.map_keys._asdict().items()}
    return found


def _values(schema: Schema) -> str:
    """The values that a schema of JSON allows, in words."""
    if "anyOf" in schema:
        ways = [_values(each) for each in schema["anyOf"] if each.get("type") != "null"]
        return ", ".join(ways)
    if "enum" in schema:
        return ", ".join(f'`"{value}"`' for value in schema["enum"])
    kind = schema.get("type", "object")
    if kind in ("number", "integer"):
        return _range(schema) + (" (whole)" if kind == "integer" else "")
    words = {"boolean": "true, false", "array": "list", "object": "table", "string": "text"}
    return "file" if schema.get("format") == "path" else words[kind]


def _range(schema: Schema) -> str:
    """The range of a number."""
    above, least = schema.get("exclusiveMinimum"), schema.get("minimum")
    start = f"above {above:g}" if above is not None else "any" if least is None else f"{least:g}"
    if (below := schema.get("exclusiveMaximum", UNBOUNDED)) < UNBOUNDED:
        return f"{start}, below {below:g}"
    if (most := schema.get("maximum")) is not None:
        return f"{start} to {most:,g}"
    return start if least is None else f"{start} or more"


def _default(value: Any) -> str:
    """A default as TOML has it; empty if there is none."""
    if isinstance(value, str | bool):
        return f"`{json.dumps(value)}`"
    if isinstance(value, int | float):
        return f"`{value:g}`"
    return "`[]`" if isinstance(value, list | tuple) else ""


def json_rows(section: type[Section], without: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    """Key and meaning of every value of a section, and of the sections within but for those left out."""
    rows: dict[str, str] = {}
    first: dict[type[Section], str] = {}
    for key, meaning, inner in _walked(section, "", without, first):
        repeated = inner is not None and first[inner] != key
        rows[key] = f"{meaning}; keys as of `{first[inner]}`" if inner is not None and repeated else meaning
    return [(f"`{key}`", meaning) for key, meaning in rows.items()]


def _walked(
    section: type[Section], before: str, without: tuple[str, ...], first: dict[type[Section], str]
) -> Iterator[tuple[str, str, type[Section] | None]]:
    """Key, meaning and section of each value; a section within is walked where it comes first."""
    meanings = attributes(section)
    for name, field in section.model_fields.items():
        each = next((f"{one.prefix}NAME" for one in field.metadata if isinstance(one, EachUnder)), None)
        inner = next((each for each in _classes(field.annotation) if issubclass(each, Section)), None)
        several = "[]" if inner is not None and "tuple[" in str(field.annotation) else ""
        key = f"{before}{each or field.alias or name}{several}"
        inner = None if name in without else inner
        known = inner is None or inner in first
        if inner is not None:
            first.setdefault(inner, key)
        yield key, _line(meanings[name]), inner
        if inner is not None and not known:
            yield from _walked(inner, f"{key}.", without, first)


def _classes(kind: Any) -> Iterator[type]:
    """Every class within a type."""
    if isinstance(kind, type) and not get_args(kind):
        yield kind
    for each in get_args(kind):
        yield from _classes(each)


def fingers_table() -> str:
    """The bundled fingers: what the head of each file says, and its numbers."""
    rows = []
    for name, file in bundled_skins().items():
        skin = load_skin(name)
        said = " ".join(
            line.removeprefix("# ") for line in file.read_text("utf-8").splitlines() if line.startswith("#")
        )
        layers = "; ".join(f"{thick:g} mm of {modulus:g} MPa" for thick, modulus in skin.layers)
        shape = f"round, {skin.radius_mm:g} mm" if skin.radius_mm else skin.shape
        sentence = re.sub(r" ?\(docs/[^)]*\)", "", said).partition(". ")[0].rstrip(".")
        numbers = (f"{one:g}" for one in (skin.young_modulus_mpa, skin.force_n, skin.thickness_mm))
        rows.append((f"`{name}`", shape, *numbers, layers, sentence))
    return table(
        ("name", "shape", "modulus, MPa", "force, N", "skin, mm", "layers above", "what it is"), rows
    )


def printers_table() -> str:
    """The named printers."""
    rows = [
        (f"`{name}`", *(f"{getattr(one, key):g}" for key in ("pixel_um", "layer_um", "min_feature_um")))
        for name, one in PRINTERS.items()
    ]
    return table(("printer", "pixel, µm", "layer, µm", "smallest feature, µm"), rows)


def _published() -> Iterator[tuple[Mapping[str, Any], dict[str, bool | None]]]:
    """Each finding of the committed study, and whether V of each finger agrees with it."""
    board = load("published")
    verdicts: dict[str, dict[str, bool | None]] = {}
    for row in board["tables"][0]["rows"]:
        columns = board["records"].get(row["key"], {"columns": {}})["columns"]
        finding, finger = row["labels"]["finding"], row["labels"]["finger"]
        verdicts.setdefault(finding, {})[finger] = columns.get("V, right")
    for finding in board["findings"]["finding"]:
        yield finding, verdicts[finding["name"]]


def rules_table() -> str:
    """Right of new findings, by rule and finger."""
    by_rule: dict[str, list[dict[str, bool | None]]] = {}
    for finding, verdicts in _published():
        if finding["mark"] == "new":
            by_rule.setdefault(finding["rule"]["kind"], []).append(verdicts)
    rows = []
    for rule, found in sorted(by_rule.items(), key=lambda entry: -len(entry[1])):
        judged = [[one[finger] for one in found if one[finger] is not None] for finger in FINGERS]
        rows.append((rule, *(f"{sum(map(bool, one))} of {len(one)}" for one in judged)))
    return table(("rule", *(f"`{finger}`" for finger in FINGERS)), rows)


def each_finding_table() -> str:
    """Every finding, with the verdict of each finger."""
    signs = {True: "✓", False: "✗", None: "–"}
    rows = []
    for finding, verdicts in _published():
        assumed = f". *Assumed: {finding['assumed']}*" if finding["assumed"] else ""
        kind = f"{finding['mark']}, {finding['rule']['kind']}"
        agrees = "".join(signs[verdicts[finger]] for finger in FINGERS)
        rows.append((f"{finding['says']}{assumed}", finding["study"], kind, agrees))
    return table(("finding", "source", "mark, rule", "agrees"), rows)


def sources_table() -> str:
    """Sources of the findings of `retouch study published`, with how they were read."""
    studies: dict[str, list[dict[str, Any]]] = {}
    for finding in tomllib.loads(FILE.read_text("utf-8"))["finding"]:
        studies.setdefault(finding["study"], []).append(finding)
    rows = []
    for study, found in sorted(studies.items()):
        doi = next((one["doi"] for one in found if one.get("doi")), "")
        link = f"[{doi}](https://doi.org/{doi})" if doi else ""
        rows.append((study, link, len(found), ", ".join(dict.fromkeys(one["read"] for one in found))))
    return table(("source", "DOI", "findings", "read"), rows)


if __name__ == "__main__":
    main()
