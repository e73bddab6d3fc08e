"""Results all over plates of 25 mm, 500 x 500 samples, from the document of their study.

python -m benchmarks.surfaces.plates textures            # the plates, from the tiles that come with Retouch
retouch study benchmarks/surfaces/plates.toml -o runs/plates/study --workers 2
cp runs/plates/study/study.json benchmarks/results/studies/plates.json
python -m benchmarks.surfaces.plates                     # prints the table
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.shared.common import parser_of, table
from benchmarks.shared.finished_studies import STUDIES, rows_of
from mitsuba_scenes import find_texture
from relief.preparing.picture_preparation import prepare
from retouch.laboratory.studies.document import read_document

DOCUMENT = STUDIES / "plates.json"
TEXTURES = Path("runs") / "plates" / "textures"
NAMES = ("gravel", "brick", "grass", "bark", "dots", "knit", "leather", "pebbles", "waves", "weave")
PLATE_MM, SAMPLES = 25.0, 500
"""Side of a plate, mm, and samples along the side."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("what", nargs="?", choices=("textures",), help="write the plates; default: the table")
    if parser.parse_args().what is None:
        print(every())
        return
    TEXTURES.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        path = TEXTURES / f"{name}.png"
        # First repeated, then made finer: a finer tile would be interpolated without its neighbours.
        prepare(find_texture(f"{name}-tile"), plate_mm=PLATE_MM).save(path)
        prepare(path, samples=SAMPLES).save(path)
        print(path)


def sections() -> tuple[str, ...]:
    """The section of docs/evidence/optimiser.md; none before the study is done."""
    if not DOCUMENT.is_file():
        return ()
    text = f"""## All over a plate

`retouch study benchmarks/surfaces/plates.toml`, after `python -m benchmarks.surfaces.plates textures`: the
same ten textures as plates of 25 mm with 500 x 500 samples, steered at 49 places by the fast look. "between":
finite elements at 36 places in the middle between the 49. "mean off", "worst off": distance of their mean and
of the worst from the target, JND. Change of the pictures in % of the mean picture.

{every()}

![Ten plates, and how far each of 85 places is from its target, smoother and rougher](../images/plates.png)

*All 85 places of the finger's middle, by finite elements (`python -m benchmarks.surfaces.plates_figure`).
Waves cannot become two JND smoother.*
"""
    return (text,)


def every() -> str:
    """A row for each plate that is done: feel between the steered places, picture change, time."""
    lines = []
    for row in rows_of(read_document(DOCUMENT)):
        least, most = row["between_least_jnd"], row["between_most_jnd"]
        lines.append(
            [
                row["texture"],
                f"{row['touch.jnd']:+d}",
                f"{row['between_mean_jnd']:+.2f} ({least:+.2f} to {most:+.2f})",
                f"{abs(row['between_off_jnd']):.3f}",
                f"{row['between_worst_jnd']:.2f}",
                f"{row['change_percent']:.1f}",
                f"{row['change_rms_percent']:.1f}",
                f"{row['steps']}",
                f"{row['cpu_s']:.0f}",
            ]
        )
    head = (
        *("plate", "JND", "JND between", "mean off", "worst off"),
        *("pictures mean, %", "rms, %", "steps", "CPU seconds"),
    )
    return table(head, lines)


if __name__ == "__main__":
    main()
