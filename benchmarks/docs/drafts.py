"""Drafts of the app beside the runs that follow them, on the twelve bundled textures, rougher and smoother.

python -m benchmarks.docs.drafts            # what is missing: 24 runs of half a minute, and their drafts
python -m benchmarks.docs.drafts --again    # the drafts anew, which take a minute; the runs stay

A run is what the app starts: the commands at the foot of its page, by its usual settings. Each row is kept as
soon as it is there, so that an interrupted command goes on.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.shared.common import ROOT, again_given, kept
from retouch.app.computing import pictures
from retouch.app.values.document import JND, FeelChoice
from retouch.app.values.folders import textures

NAME = "app_drafts"
JNDS = (2.0, -2.0)


def main() -> None:
    again_given(__doc__)
    for name in textures():
        for jnd in JNDS:
            kept(NAME, "runs", f"{name} {jnd:+g}", lambda name=name, jnd=jnd: run(name, jnd))


def run(name: str, jnd: float) -> dict[str, Any]:
    """What the run of a texture reaches."""
    feel = FeelChoice(numbers={JND: jnd})
    with tempfile.TemporaryDirectory() as folder:
        heights, out = "heights.png", "run"
        for words in (pictures.source(name).picture.command(heights), feel.command(heights, out)):
            command = [sys.executable, "-m", "retouch", *words]
            path = os.environ | {"PYTHONPATH": str(ROOT)}
            subprocess.run(command, cwd=folder, env=path, check=True, capture_output=True)
        result = json.loads((Path(folder) / out / "result.json").read_text())
    return {
        "jnd": result["touch"]["jnd_from_original"],
        "change_percent_of_white": result["look"]["change_percent_of_white"],
        "seconds": result["time_s"]["total"],
    }


if __name__ == "__main__":
    main()
