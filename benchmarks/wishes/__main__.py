"""Files and hunks that a newcomer's change takes: each patch is applied to the last commit and tested there.

python -m benchmarks.wishes                # every patch
python -m benchmarks.wishes option term    # these alone

`wishes.toml` describes the patches of this folder. Each is applied to a clone, where its tests are run.
Results go to results/wishes.json; the exit status is 1 if a patch does not apply or a test fails.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from benchmarks.shared.common import ROOT, load, parser_of, save, table

FOLDER = Path(__file__).parent
HEAD = ("wish", "before", "new files", "files changed", "hunks in them", "lines added", "tests")


def wishes() -> dict[str, dict[str, Any]]:
    """The wishes of `wishes.toml` by name."""
    found = tomllib.loads((FOLDER / "wishes.toml").read_text(encoding="utf-8"))["wish"]
    return {wish["name"]: wish for wish in found}


def counted(patch: str) -> dict[str, int]:
    """New files, files that are changed, hunks in these and added lines of a patch, tests and docs apart."""
    parts = [part for part in re.split(r"^diff --git ", patch, flags=re.M)[1:] if not is_apart(part)]
    changed = [part for part in parts if "\nnew file mode" not in part]
    return {
        "new_files": len(parts) - len(changed),
        "files": len(changed),
        "hunks": sum(len(re.findall(r"^@@ ", part, re.M)) for part in changed),
        "lines": sum(len(re.findall(r"^\+(?!\+\+)", part, re.M)) for part in parts),
    }


def is_apart(part: str) -> bool:
    """Whether a part of a patch is about a test or a page."""
    return part.startswith(("a/tests/", "a/docs/"))


def passes(name: str, tests: list[str]) -> bool:
    """Whether a patch applies to a clone of the last commit and its tests pass there."""
    with tempfile.TemporaryDirectory(prefix="retouch-wish-") as folder:
        clone = ["git", "clone", "-q", "--shared", str(ROOT), folder]
        subprocess.run(clone, check=True)
        patch = FOLDER / f"{name}.patch"
        if subprocess.run(["git", "-C", folder, "apply", str(patch)], check=False).returncode:
            return False
        # The packages of the clone, and not those of the checkout that is installed.
        environment = os.environ | {"PYTHONPATH": folder}
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests]
        return subprocess.run(command, cwd=folder, env=environment, check=False).returncode == 0


def main() -> int:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    names = parser.parse_args().names or list(wishes())
    rows = load("wishes").get("wishes", {})
    for name in names:
        wish = wishes()[name]
        patch = (FOLDER / f"{name}.patch").read_text(encoding="utf-8")
        rows[name] = {"before": wish["before"], **counted(patch), "passed": passes(name, wish["tests"])}
        save("wishes", {"wishes": rows})
    lines = [(name, *row.values()) for name, row in rows.items()]
    print(table(HEAD, lines))
    return int(not all(rows[name]["passed"] for name in names))


if __name__ == "__main__":
    sys.exit(main())
