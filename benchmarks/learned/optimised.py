"""Textures as the optimiser leaves them, for data sets: what fast models are shown in use.

    python -m benchmarks.learned.optimised FOLDER [SEED]

Runs on textures of a corpus in the paper's studio, steered by the quick touch and the fast look, the models
that such a descent would exploit; each to a target of 1 to 3 just-noticeable differences, rougher or
smoother, without verification. `COUNTS` of each split. FOLDER gets their files and a manifest, for
`retouch dataset --optimised FOLDER`; begun again, the command goes on where it was.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

import tactile
from optimize.run_directory.finished_run import read_result
from optimize.settings.run_file import run_from_scene
from retouch.laboratory.studies.engine import compute, row_folder
from retouch.laboratory.studies.row_key import row_key
from retouch.laboratory.studies.rows import Expanded, StudyRow, Table
from retouch.laboratory.training.fields import STUDIO
from retouch.laboratory.workers.choice import runner
from retouch.verbs.progress_display import shown
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import MANIFEST_FILE, entry, write_manifest
from surrogate.corpus.optimised import checksum, load, store
from surrogate.corpus.photographs import bundled, by_name
from surrogate.corpus.splits import Split

COUNTS: dict[Split, int] = {"train": 200, "validation": 25, "test": 150}
SEED = 5
SIZE_MM = 10.0
LEAST_JND, MOST_JND = 1.0, 3.0
LEAST_ROUGHNESS = 0.01
"""Smoother textures are left out: a finger does not feel them, even 19 % rougher."""
RUNS, ORIGINALS = "runs", "originals"
"""Folders of run directories, and of the textures before."""
SETTINGS = (
    *('touch.model="quick"', 'look.model="fast"', "descent.tolerance=0.01", "descent.steps=30"),
    *('verify.model="none"', "verify.samples=4", "verify.baseline=false"),
)


def main() -> None:
    folder, seed = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    textures = {f"{texture.split}-{texture.index:05d}": texture for texture in chosen(seed)}
    rows = {name: row(folder / ORIGINALS / f"{name}.npy", texture) for name, texture in textures.items()}
    expanded = Expanded((Table("descents", {"texture": tuple(rows)}, tuple(rows.values())),), ())
    with shown():
        done = compute(expanded, folder / RUNS, lambda work, observer: runner(work, observer=observer))
    found = []
    for name, one in rows.items():
        if one.key in done.records:
            heights = read_result(row_folder(folder / RUNS, one)).heights
            kept = store(folder, name, heights, textures[name].source)
            found.append(entry(kept, load(folder, kept)))
    write_manifest(folder / MANIFEST_FILE, found)
    print(f"{folder}: {len(found)} textures; {len(done.failures)} failed")


def row(path: Path, texture: corpus.Recipe) -> StudyRow:
    """The run of a texture, whose heights are written, to a target that their checksum draws."""
    heights = corpus.heights(texture, by_name(bundled()))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, heights)
    draw = np.random.default_rng(int(checksum(heights)[:16], 16))
    jnd = float(draw.uniform(LEAST_JND, MOST_JND) * draw.choice((-1.0, 1.0)))
    settings = run_from_scene(STUDIO, path, [*SETTINGS, f"touch.jnd={jnd}"])
    return StudyRow({"texture": path.stem}, settings, row_key(settings))


def chosen(seed: int) -> Iterator[corpus.Recipe]:
    """Textures of the corpus until each split has its share; too smooth ones are passed by."""
    sources, left = bundled(), dict(COUNTS)
    for index in itertools.count():
        if not any(left.values()):
            return
        texture = corpus.recipe(seed, index, sources)
        if left[texture.split] and _roughness(corpus.heights(texture, by_name(sources))) >= LEAST_ROUGHNESS:
            left[texture.split] -= 1
            yield texture


def _roughness(heights: np.ndarray) -> float:
    strain = tactile.press(torch.as_tensor(heights), SIZE_MM, model="quick").strain
    return float(tactile.roughness(strain, SIZE_MM, "polar"))


if __name__ == "__main__":
    main()
