"""Textures that no net has seen, and what the references make of them, kept between runs of a benchmark."""

from __future__ import annotations

import argparse
import io
import itertools
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from benchmarks.shared.common import parser_of
from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import optimised, read
from surrogate.corpus.optimised import checksum
from surrogate.corpus.photographs import bundled, by_name

Reliefs = NDArray[np.float32]

TEXTURES, SEED = 320, 8
REFERENCES = Path("runs/references")


def arguments(what: str) -> argparse.Namespace:
    """Arguments of a benchmark on unseen textures."""
    parser = parser_of(what)
    parser.add_argument("--textures", type=int, default=TEXTURES, metavar="N", help="of the corpus")
    parser.add_argument(
        "--optimised",
        type=Path,
        metavar="FOLDER",
        help="of `benchmarks.learned.optimised`: its test split, too",
    )
    parser.add_argument(
        "--references",
        type=Path,
        default=REFERENCES,
        metavar="FOLDER",
        help="where reference fields are kept",
    )
    parser.add_argument("--again", action="store_true", help="also what is in the results")
    parser.add_argument("--times", action="store_true", help="measure times only, on a quiet machine")
    return parser.parse_args()


def sets(asked: argparse.Namespace) -> dict[str, Reliefs]:
    """Heights (textures, n, n) in mm by the name of the set."""
    found = {"unseen": unseen(asked.textures)}
    if asked.optimised is not None:
        lines = [line for line in optimised(asked.optimised) if line.split == "test"]
        found["optimised"] = np.stack([read(line, asked.optimised) for line in lines])
    return found


def unseen(count: int) -> Reliefs:
    """Heights (count, n, n), mm: textures of the test split of another corpus than the nets'."""
    sources = bundled()
    drawn = (corpus.recipe(SEED, index, sources) for index in itertools.count())
    tests = itertools.islice((texture for texture in drawn if texture.split == "test"), count)
    return np.stack([corpus.heights(texture, by_name(sources)) for texture in tests])


def kept(
    folder: Path, what: str, heights: Reliefs, make: Callable[[], Mapping[str, Array]]
) -> dict[str, Array]:
    """Fields by name: made once for each relief, then read.

    Args:
        what: the reference and its settings; another text, another file.
    """
    path = folder / what / f"{checksum(heights)[:32]}.npz"
    if not path.is_file():
        content = io.BytesIO()
        fields: dict[str, Any] = dict(make())
        np.savez(content, **fields)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content.getvalue())
    with np.load(path, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def milliseconds(
    value: Callable[[Tensor], object],
    loss: Callable[[Tensor], Tensor],
    inputs: Iterable[Tensor],
    threads: int,
) -> tuple[float, float]:
    """Median time of a value, and of a loss with its gradient, over inputs of the same shape."""
    torch.set_num_threads(threads)
    forward, both = [], []
    for each in inputs:
        began = time.perf_counter()
        with torch.no_grad():
            value(each)
        forward.append(time.perf_counter() - began)
        free = each.clone().requires_grad_()
        began = time.perf_counter()
        torch.autograd.grad(loss(free), free)
        both.append(time.perf_counter() - began)
    torch.set_num_threads(1)
    return 1e3 * statistics.median(forward), 1e3 * statistics.median(both)


def spread(values: Sequence[float] | Array) -> dict[str, float]:
    """Median, mean and 95th percentile."""
    return {
        "median": float(np.median(values)),
        "mean": float(np.mean(values)),
        "95th": float(np.percentile(values, 95)),
    }
