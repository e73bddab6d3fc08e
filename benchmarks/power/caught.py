"""Which tests catch faults that were mended before: each is brought back, and tests of its code are run.

python -m benchmarks.power.caught                    # all that were not run on this commit
python -m benchmarks.power.caught 03-thinned-combs   # these alone, anew

A fault is a patch of `mendings/` that `mendings.toml` describes. It is applied to a clone of the last commit,
where the quick tier runs first, then the slow tests. The same tests must pass in a clone without a patch. The
results of each fault are written to `results/power.json` as soon as they are known.
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

from benchmarks.shared.common import ROOT, load, machine, parser_of, save, table

FOLDER = Path(__file__).parent
TIERS = {"quick": "not slow or sentinel", "slow": "slow and not sentinel"}
"""Which tests `make test` runs, and which `make test-slow`."""
NO_TESTS = 5
"""Exit status of pytest where it finds no test."""


def mendings() -> dict[str, dict[str, Any]]:
    """The faults of `mendings.toml` by name."""
    found = tomllib.loads((FOLDER / "mendings.toml").read_text(encoding="utf-8"))["mending"]
    return {mending["name"]: mending for mending in found}


def commit() -> str:
    """The last commit of the checkout."""
    return _output(["git", "rev-parse", "--short", "HEAD"], ROOT).strip()


def first_red(checkout: Path, tests: list[str], tier: str) -> str | None:
    """The first test of a tier that fails; None if all pass."""
    options = ("-x", "-q", "-p", "no:cacheprovider", "-m", TIERS[tier])
    # The packages of the clone, and not those of the checkout that is installed.
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    command = [sys.executable, "-m", "pytest", *options, *tests]
    ran = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True, check=False)
    if ran.returncode in (0, NO_TESTS):
        return None
    red = re.search(r"^(?:FAILED|ERROR) (\S+(?:\[.*?\])?)", ran.stdout, re.M) or re.search(
        r"^_+ (?:ERROR at setup of )?(\S.*?) _+$", ran.stdout, re.M
    )
    return red[1] if red else ran.stdout[-200:]


def run(mending: dict[str, Any]) -> dict[str, Any]:
    """The row of a fault: the test that is red in the quick tier and, if none is, in the slow one."""
    row = {key: mending[key] for key in ("commit", "area", "fault")}
    with tempfile.TemporaryDirectory(prefix="retouch-power-") as folder:
        for checkout, patched in ((Path(folder) / "whole", False), (Path(folder) / "patched", True)):
            _output(["git", "clone", "-q", "--shared", str(ROOT), str(checkout)], ROOT)
            if patched:
                patch = FOLDER / "mendings" / f"{mending['name']}.patch"
                _output(["git", "apply", str(patch)], checkout)
        row["quick"] = first_red(Path(folder) / "patched", mending["tests"], "quick")
        row["slow"] = None if row["quick"] else first_red(Path(folder) / "patched", mending["tests"], "slow")
        tier = "quick" if row["quick"] else "slow"
        row["without"] = first_red(Path(folder) / "whole", mending["tests"], tier)
    return row


def _output(command: list[str], folder: Path) -> str:
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", choices=[*mendings(), []], metavar="NAME")
    names = parser.parse_args().names
    known = load("power")
    rows = known.get("mendings", {}) if known.get("commit") == commit() or names else {}
    for name, mending in mendings().items():
        if name in names or (not names and name not in rows):
            rows[name] = run(mending)
            save("power", {"machine": machine(), "commit": commit(), "mendings": rows})
            print(name, rows[name]["quick"] or rows[name]["slow"] or "not caught", flush=True)
    cells = [[name, row["area"], row["quick"] or "", row["slow"] or ""] for name, row in rows.items()]
    print(table(("fault", "area", "caught by the quick tier", "by the slow tests"), cells))
    quick = sum(row["quick"] is not None for row in rows.values())
    slow = sum(row["slow"] is not None for row in rows.values())
    wrong = [name for name, row in rows.items() if row["without"]]
    print(f"{quick + slow} of {len(rows)} caught, {quick} by the quick tier")
    print("red without a fault:", ", ".join(wrong) or "none")


if __name__ == "__main__":
    main()
