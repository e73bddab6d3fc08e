"""The plates of 25 mm with 500 x 500 samples of a study, from the tiles that come with Retouch.

python -m benchmarks.surfaces.plates
retouch study benchmarks/surfaces/plates.toml -o runs/plates/study --workers 2
cp runs/plates/study/study.json benchmarks/results/studies/plates.json
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.shared.common import parser_of
from mitsuba_scenes import find_texture
from relief.preparing.picture_preparation import prepare

TEXTURES = Path("runs") / "plates" / "textures"
NAMES = ("gravel", "brick", "grass", "bark", "dots", "knit", "leather", "pebbles", "waves", "weave")
PLATE_MM, SAMPLES = 25.0, 500
"""Side of a plate, mm, and samples along the side."""


def main() -> None:
    parser_of(__doc__).parse_args()
    TEXTURES.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        path = TEXTURES / f"{name}.png"
        # First repeated, then made finer: a finer tile would be interpolated without its neighbours.
        prepare(find_texture(f"{name}-tile"), plate_mm=PLATE_MM).save(path)
        prepare(path, samples=SAMPLES).save(path)
        print(path)


if __name__ == "__main__":
    main()
