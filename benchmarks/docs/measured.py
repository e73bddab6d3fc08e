"""Tables of docs/evidence, and the numbers of the README, from the results of the other benchmarks.

python -m benchmarks.docs.measured
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.docs import headlines
from benchmarks.runs import adam_figure, demo, descents
from benchmarks.shared.common import DOCS, ROOT, load, put, table
from benchmarks.sight import gradients, look
from benchmarks.surfaces import plates, tile_tables
from benchmarks.touch import contact

EVIDENCE = DOCS / "evidence"
README = ROOT / "README.md"
COMMAND = "benchmarks.docs.measured"


MODELS = {
    "meshes": (
        "The reference by its mesh, contact always at 128 x 128, against a node at every pixel (128), over "
        "twelve textures. Builds: in a process and a cache folder of their own."
    ),
    "finer": "The same with 128 nodes a side against 160: what the finest of these meshes still lacks.",
    "elastic_layer": "The layer model by the coarse mesh of its sides (nc), against the same reference.",
    "bare": (
        "Elements alone, contact at their own nodes, against the reference on the same grid: why the exact "
        "layer is part of the reference."
    ),
    "many": "The layer model against the reference, 208 reliefs from 0.1 to 3 mm high.",
    "tetrahedra": (
        "Quadratic tetrahedra on an unstructured mesh, contact at 40 x 40, against the reference there, on "
        "three smooth reliefs (grating, bumps, noise). Pressures are waves of the grid, as the reference's "
        "are. Seconds are beside other work."
    ),
    "fingertips": (
        "Rounded skins: gravel at 40 x 40 under blocks 5 mm thick whose lower face is a spherical cap, by "
        "tetrahedra (seconds with meshing and factors, beside other work)."
    ),
}


def main() -> None:
    headlines_of_readme = {
        "runs": tile_tables.headline(),
        "gradients": headlines.gradients_sentence(),
        "fast": headlines.fast_sentence(),
        "status": headlines.status_table(),
    }
    for name, text in headlines_of_readme.items():
        _write(README, name, text)
    for (page, name), sections in {
        ("touch", "tables"): (_models(), _touch()),
        ("appearance", "tables"): (_gradients(), _look()),
        ("optimiser", "runs"): (_runs(), _demo()),
        ("optimiser", "tiles"): (_tiles(), *plates.sections()),
    }.items():
        _write(EVIDENCE / f"{page}.md", name, "\n".join(sections))


def _write(page: Path, name: str, text: str) -> None:
    """Put a text between the markers of its name."""
    if not put(page, name, COMMAND, text):
        raise ValueError(f"{page}: has no place for {name}")
    print(page)


def _runs() -> str:
    return f"""## Whole runs

The runs of `benchmarks/runs/descents.toml`, as measured at commit 340f9f0; `python -m
benchmarks.runs.descents` prints every one. {descents.NOTES}

{_ratios(load("runs")["rows"])}

### Adam over computing time

`python -m benchmarks.runs.adam_figure` draws the curves. {adam_figure.NOTES}

{adam_figure.as_table(load("runs")["rows"])}

![Change of the pictures by Adam over CPU seconds, beside Gauss-Newton's final change](../images/adam.png)
"""


def _ratios(rows: dict[str, Any]) -> str:
    """How many times less the pictures change by Gauss-Newton than otherwise, at the film's resolution."""
    lines = []
    for case in dict.fromkeys(key.split(", ", 1)[0] for key in rows):
        ours = rows[f"{case}, gauss-newton"].get("pictures")
        line: list[Any] = [case]
        for other, kind in (
            ("linear scaling", "mean"),
            ("gauss-newton, no edges", "rms"),
            ("adam, smoothed", "rms"),
        ):
            theirs = rows.get(f"{case}, {other}", {}).get("pictures")
            for resolution in map(str, descents.RESOLUTIONS):
                key = f"{kind}_percent_of_mean"
                line.append(
                    None if not (ours and theirs) else theirs[resolution][key] / ours[resolution][key]
                )
        lines.append(line)
    head = (
        "texture and JND",
        "linear scaling, mean, 128",
        "256",
        "no edges, rms, 128",
        "256",
        "adam smoothed, rms, 128",
        "256",
    )
    return "Picture change of other methods divided by that of gauss-newton:\n\n" + table(head, lines)


def _tiles() -> str:
    return f"""## All over a tile

`retouch study tiles`: textures of 128 x 128 samples that repeat every 10 mm, as they come with Retouch, two
JND smoother and rougher. Steered at one place of the finger, as the paper does it, or at 16 places 2.5 mm
apart; light comes in from the neighbours in both. "between": finite elements at 16 places in the middle
between the 16, mean JND (least to largest). "off" is the distance from the target: of the mean, and of the
worst place. "ratio" divides the two changes of the pictures. One place reaches its target for a finger there
and 1.4 to 1.8 JND elsewhere; a ratio "at equal feel", where it is computed, divides by the change of a single
place aimed so far beyond the target that the places between feel as much as all over.

{tile_tables.every()}

{len(tile_tables.cases())} of the study's 20 cases are computed. Its descents stop within 0.5 % of the mean
roughness, which is 0.03 JND (`descent.tolerance`); the usual 1 % is 0.06 JND. Smooth waves are the exception:
they do not reach -2 JND in 100 steps, and at +2 JND their farthest place is 0.3 JND off.
"""


def _demo() -> str:
    both = {"texture": "texture", "touch.jnd": "JND"}
    return f"""## The demo runs

`retouch study demo`: every result is verified by finite elements (64 nodes a side, contact at all 128 x 128
pixels), corrected by them, and rendered by Mitsuba until the change of its pictures is known, less noise.
"off" is what the finite elements say of the target. Change of the pictures in % of the mean picture, and of
the radiance of a white plate that faces the light, as the paper's % of pixel values. CPU seconds of a
whole run with verification, final pictures and report, on one thread beside other work.

![Three textures, made two JND rougher by Retouch and by scaling their height](../images/rougher.png)

Methods: scaled in height and, where 3 mm do not suffice, sideways; Gauss-Newton whose gradients do not see
shadows move; Retouch.

{demo.of_each("methods", both | {"method": "method"})}

Roughness and contact area at once:

{demo.of_each("roughness and contact area", {"texture": "texture", "targets": "targets"})}

Adam with the paper's 100 steps, on the exact look whose shadow edges move or stand still:

{demo.of_each("Adam", both | {"shadows": "shadow edges"})}

By the models that steer, means over the six runs:

{demo.by_models()}
"""


def _gradients() -> str:
    found = load("gradients")["cases"]
    in_order = {case.key: found[case.key] for case in gradients.cases() if case.key in found}
    return f"""## Gradients of pictures

`python -m benchmarks.sight.gradients`. {gradients.NOTES}

Error of every case, in % of the gradient, with the seconds of a call:

{gradients.as_table(in_order)}
"""


def _look() -> str:
    return f"""## Pictures: seconds against error

`python -m benchmarks.sight.look`, `python -m benchmarks.sight.look_figure`.

![Seconds against error of every gradient of pictures](../images/look-models.png)

{look.as_text(load("look"))}
"""


def _models() -> str:
    results = load("contact")
    parts = [
        "## Models of touch\n\n`python -m benchmarks.touch.contact`, `python -m benchmarks.touch.pareto`.\n"
    ]
    parts.append("![Run time against error of every touch model](../images/touch-models.png)\n")
    for name, introduction in MODELS.items():
        if name in results:
            parts.append(f"{introduction}\n\n{contact.as_table(name, results[name])}\n")
    return "\n".join(parts)


def _touch() -> str:
    touch = load("touch")
    parts = [
        "## Touch\n\n`python -m benchmarks.touch.times`: 128 x 128 heights, medians.\n",
        table(("what", "threads", "float32 ms", "float64 ms"), [list(r.values()) for r in touch["times_ms"]]),
        "\nSteps of the contact solver to its default tolerance (2e-5 and 1e-9 of the mean displacement):\n",
        table(
            ("smoothness px", "relief mm", "float32", "float64", "contact fraction"),
            [list(s.values()) for s in touch["steps"]],
        ),
        "\nV by the coarse mesh of the free-sides correction, against 48 elements a side, same reliefs:\n",
        table(
            ("elements a side", "median off %", "worst off %"), [list(c.values()) for c in touch["coarse"]]
        ),
        "\n`python -m benchmarks.touch.times --sizes`: what `retouch evaluate` does, once, in CPU seconds of "
        "one thread; beside V its sum over every offset:\n",
        table(tuple(touch["sizes"][0]), [list(row.values()) for row in touch["sizes"]]),
        "",
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    main()
