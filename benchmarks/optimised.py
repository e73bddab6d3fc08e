"""Textures as the optimiser leaves them, for data sets: what fast models are shown in use.

    python -m benchmarks.optimised FOLDER [SEED]

Descents on textures of a corpus in the paper's studio, steered by the quick touch and the fast look, which
are the models that such a descent would exploit; each to a target of 1 to 3 just-noticeable differences,
rougher or smoother, without verification. `COUNTS` of each split. FOLDER gets their files and a manifest, for
`retouch dataset --optimised FOLDER`; begun again, the command goes on where it was.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from rich.console import Console

import tactile
from optimize.descent.driver import DescentResult, descend
from optimize.descent.gauss_newton import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.training.fields import STUDIO
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import MANIFEST_FILE, Entry, entry, write_manifest
from surrogate.corpus.optimised import Optimised, checksum, load, store
from surrogate.corpus.photographs import bundled, by_name
from surrogate.corpus.splits import Split
from visual.scene import Scene, load_scene

COUNTS: dict[Split, int] = {"train": 200, "validation": 25, "test": 150}
SEED = 5
SIZE_MM = 10.0
LEAST_JND, MOST_JND = 1.0, 3.0
LEAST_ROUGHNESS = 0.01
"""Smoother textures are left out: nobody makes those rougher by 19 % and feels it."""
TOLERANCE, STEPS = 0.01, 30


def main() -> None:
    torch.set_num_threads(1)
    folder, seed = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    console, scene = Console(highlight=False), load_scene(STUDIO)
    done: list[Entry] = []
    for number, texture in enumerate(chosen(seed)):
        name = f"{texture.split}-{texture.index:05d}"
        began = time.perf_counter()
        kept = Optimised(source=texture.source, path=f"{name}.npy")
        if not (folder / kept.path).is_file():
            original = corpus.heights(texture, by_name(bundled())).astype(np.float64)
            found = optimised(scene, original)
            kept = store(folder, name, found.best.heights, texture.source)
            console.print(
                f"{number + 1} {name}: {found.reason.name}, pictures {found.best.picture_rms:.2f} %, "
                f"{found.last.step} steps, {time.perf_counter() - began:.1f} s"
            )
        done.append(entry(kept, load(folder, kept)))
        write_manifest(folder / MANIFEST_FILE, done)


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


def optimised(scene: Scene, original: np.ndarray) -> DescentResult:
    """A descent from a relief (n, n) in mm, to a target that its checksum draws."""
    draw = np.random.default_rng(int(checksum(original.astype(np.float32))[:16], 16))
    jnd = float(draw.uniform(LEAST_JND, MOST_JND) * draw.choice((-1.0, 1.0)))
    skin = tactile.Skin()
    untargeted = Problem(original, SIZE_MM, skin, Targets(), scene, touch="quick", look="fast")
    goal = tactile.jnd_scaled(untargeted.press(original, gradients=False).values["roughness"], jnd)
    targets = Targets.of(TOLERANCE, roughness=goal)
    way = GaussNewton(replace(untargeted, targets=targets))
    return descend(way, targets, way.begin(0, original, {}), STEPS)


def _roughness(heights: np.ndarray) -> float:
    strain = tactile.press(torch.as_tensor(heights), SIZE_MM, model="quick").strain
    return float(tactile.roughness(strain, SIZE_MM, "polar"))


if __name__ == "__main__":
    main()
