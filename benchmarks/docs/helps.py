"""Options of every verb in two versions of the code: flags, values, choices, defaults and explanations.

python -m benchmarks.docs.helps --before 27bd9ddc

Numbers and the sentences that differ go to results/helps.json; the exit status is 1 if an option, a value or
a choice differs.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.shared.checkouts import NOW, checkouts
from benchmarks.shared.common import parser_of, save, table

SCRIPT = r"""
import argparse, json, re
from retouch.commands.main import VERBS

def options(verb):
    parser = argparse.ArgumentParser(prog="retouch")
    verb.add_arguments(parser)
    for action in parser._actions[1:]:
        text = (action.help or "").replace("%%", "%")
        default = re.findall(r"\(default: (.*)\)", text)
        yield " ".join(action.option_strings) or action.dest, {
            "value": action.metavar or (action.dest.upper() if action.nargs != 0 else None),
            "choices": list(action.choices or ()),
            "several": type(action).__name__ == "_AppendAction",
            "default": default[-1] if default else None,
            "help": re.sub(r" \(default: .*\)", "", text),
        }

print(json.dumps({name: dict(options(verb)) for name, verb in VERBS.items()}))
"""
"""Prints the options of each verb; runs in the folder of a version."""
EXACT = ("value", "choices", "several")
"""What of an option must not change."""
WORDS = ("default", "help")
"""What may be said in better words."""


def main() -> int:
    parser = parser_of(__doc__)
    parser.add_argument("--before", metavar="COMMIT", required=True)
    before = parser.parse_args().before
    with checkouts(before) as trees:
        first, now = options_of(trees[before]), options_of(trees[NOW])
    rows = {verb: compared(first.get(verb, {}), now.get(verb, {})) for verb in {**first, **now}}
    save("helps", {"before": before, "verbs": rows})
    lines = [
        (
            verb,
            row["options"],
            ", ".join(row["gone"]),
            ", ".join(row["new"]),
            ", ".join(row["changed"]),
            len(row["other_words"]),
        )
        for verb, row in rows.items()
    ]
    print(table(("verb", "options", "gone", "new", "changed", "in other words"), lines))
    return int(any(row["gone"] or row["new"] or row["changed"] for row in rows.values()))


def options_of(tree: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """Options by verb and flag, of the code in a folder."""
    command = [sys.executable, "-c", SCRIPT]
    ran = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=True)
    content: dict[str, dict[str, dict[str, Any]]] = json.loads(ran.stdout)
    return content


def compared(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """What differs between the options of a verb in two versions."""
    both = before.keys() & now.keys()
    return {
        "options": len(now),
        "gone": sorted(before.keys() - now.keys()),
        "new": sorted(now.keys() - before.keys()),
        "changed": {
            flag: [{key: one[flag][key] for key in EXACT} for one in (before, now)]
            for flag in sorted(both)
            if any(before[flag][key] != now[flag][key] for key in EXACT)
        },
        "other_words": {
            flag: [{key: one[flag][key] for key in WORDS} for one in (before, now)]
            for flag in sorted(both)
            if any(before[flag][key] != now[flag][key] for key in WORDS)
        },
    }


if __name__ == "__main__":
    sys.exit(main())
