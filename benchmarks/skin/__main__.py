"""The measured finger: posterior by mechanical measurements, the fingers named after it, a picture.

python -m benchmarks.skin            # what is not in the results yet; results/finger.json, picture, table
python -m benchmarks.skin --again    # all of it anew: 16 CPU minutes
"""

from __future__ import annotations

from typing import Any

from benchmarks.shared.common import again_given, load, machine, publish, save, table
from benchmarks.skin.calibration import calibration, solved_fingers
from benchmarks.skin.finger_chart import draw
from benchmarks.skin.sources import MECHANICAL

NAME = "finger"
QUANTITIES = {
    "layer_mm": "layer, mm",
    "layer_mpa": "layer, MPa",
    "base_mpa": "tissue below, MPa",
    "radius_mm": "radius, mm",
    "thickness_mm": "thickness, mm",
}


def main() -> None:
    results: dict[str, Any] = {} if again_given(__doc__) else load(NAME)

    def keep() -> None:
        save(NAME, results | {"machine": machine()})

    depths = results.setdefault("solved", {})
    if "calibration" not in results:
        results["calibration"] = calibration(solved_fingers(depths, keep))
    keep()
    draw(results["calibration"])
    publish("touch", "posterior", posterior(results["calibration"]))
    publish("touch", "fit", fit(results["calibration"]))


def posterior(done: dict[str, Any]) -> str:
    """Median and 95 % interval of each quantity, by the sources that fit."""
    found = done["posterior"]
    rows = [
        [title, *("{2:.2g} ({0:.2g} to {4:.2g})".format(*one["quantiles"][name]) for one in found.values())]
        for name, title in QUANTITIES.items()
    ]
    return table(("median (95 %)", "both sources", "grooves alone", "sphere alone"), rows)


def fit(done: dict[str, Any]) -> str:
    """Logarithms of what fingers give over what was measured, by source."""
    rows = [
        [f"`{name}`", *(_errors(one["residual"][source.name]) for source in MECHANICAL)]
        for name, one in done["fingers"].items()
    ]
    other = {"grooves": "sphere", "sphere": "grooves"}
    left_out = [
        _errors(done["posterior"][other[source.name]]["mean residual"][source.name]) for source in MECHANICAL
    ]
    rows.append(["posterior by the other source alone", *left_out])
    return table(("log of model over measured", "grooves, narrow to wide", "sphere, shallow to deep"), rows)


def _errors(values: Any) -> str:
    return ", ".join(f"{value:+.2f}" for value in values)


if __name__ == "__main__":
    main()
