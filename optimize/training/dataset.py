"""Data sets to train nets on: a corpus of textures and what touch and sight make of each, shard by shard.

A shard is a pure function of its task (`optimize.training.shard_jobs`), is written whole or not at all, and
is not
made again where it is there: whatever ends a run, the next goes on where it was, and the files are the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import tactile
from optimize.training.fields import STUDIO, STUDIO_AZIMUTHS
from optimize.training.shard_jobs import ShardJob, versions
from optimize.training.workers import Runner
from relief.errors import InputError
from relief.files import write_atomically
from relief.limits import PATCH_SIDE_MM
from surrogate.corpus import manifest
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import Entry
from surrogate.corpus.optimised import Optimised
from surrogate.corpus.photographs import Photograph, by_name
from surrogate.corpus.recipes import PROCEDURAL_SHARE, SAMPLES, Recipe
from surrogate.data.field_set import FAILURES, open_fieldset, shard_path, text_of_failures
from surrogate.data.request import DATASET_FILE, SHARD_SIZE, DatasetRequest, read_request, text_of_request
from surrogate.data.shard import Failure, Shard, open_shard

DIRECTIONS = 8
"""Random lights of each texture, unless told otherwise."""


@dataclass(frozen=True)
class Plan:
    """What is to be made, and what it is made from.

    Attributes:
        sources: pictures that textures are cut from, by name.
        optimised: further textures, and the folder that their files lie in.
    """

    request: DatasetRequest
    sources: Mapping[str, Photograph]
    optimised: tuple[Entry, ...] = ()
    folder: Path = Path()

    def textures(self, shard: int) -> Iterator[Recipe | Optimised]:
        """The textures of a shard, in order."""
        request, sources = self.request, tuple(self.sources.values())
        for place in request.places(shard):
            if place < request.count:
                yield corpus.recipe(request.seed, place, sources, request.procedural_share)
            else:
                yield self.optimised[place - request.count].texture

    def job(self, shard: int) -> ShardJob:
        """The task of a shard; heights that only this machine has come with it."""
        textures = tuple(self.textures(shard))
        given: dict[int, NDArray[np.float32] | str] = {}
        for place, texture in zip(self.request.places(shard), textures, strict=True):
            try:
                if isinstance(texture, Optimised):
                    line = self.optimised[place - self.request.count]
                    given[place] = manifest.read(line, self.folder)
                elif texture.source.startswith("file/"):
                    given[place] = corpus.heights(texture, self.sources, samples=self.request.samples)
            except InputError as error:
                given[place] = str(error)
        return ShardJob(self.request, shard, textures, given)


@dataclass(frozen=True)
class ShardResult:
    """A shard that is there now, or the textures of one that is given up.

    Attributes:
        shard: None if it was given up.
        lost: its textures, then.
    """

    shard: Shard | None
    lost: tuple[Failure, ...] = ()

    @property
    def textures(self) -> int:
        """How many it tells of, with fields or without."""
        return len(self.lost) if self.shard is None else len(self.shard.rows) + len(self.shard.failures)


def plan(
    seed: int,
    count: int,
    sources: Sequence[Photograph],
    *,
    procedural_share: float = PROCEDURAL_SHARE,
    optimised: Path | None = None,
    touch: Literal["fem", "layer", "none"] = "fem",
    skin: tactile.Skin | None = None,
    lights: Literal["studio", "random", "none"] = "random",
    directions: int = DIRECTIONS,
    strata: int = 12,
    samples: int = SAMPLES,
    shard_size: int = SHARD_SIZE,
) -> Plan:
    """Plan a data set; every picture and every optimised texture is read, and so known to be good.

    Args:
        seed, count, sources, procedural_share: of the corpus; see `surrogate.corpus.recipes.recipe`.
        optimised: a folder with a manifest of optimised textures, which come after the corpus.
        touch: model of touch.
        lights: "studio", three lights; "random", `directions` of them.
        strata: shadow rays along a pixel's side where light and shadow meet.
        samples: a side of heights, fields and pictures.

    Raises:
        InputError: a picture or a texture cannot be read.
    """
    for source in sources:
        source.read()
    more = [] if optimised is None else manifest.optimised(optimised)
    for line in more:
        assert optimised is not None
        manifest.read(line, optimised)
        if line.samples != samples:
            raise InputError(f"{optimised}: {line.texture}: {line.samples} samples a side, not {samples}")
    request = DatasetRequest(
        seed=seed,
        count=count,
        procedural_share=procedural_share,
        sources=_digest(sorted(source.name for source in sources)),
        optimised=_digest(line.sha256 for line in more),
        total=count + len(more),
        samples=samples,
        size_mm=PATCH_SIDE_MM,
        touch=touch,
        skin=asdict(skin or tactile.Skin()),
        lights=lights,
        directions={"studio": len(STUDIO_AZIMUTHS), "random": directions, "none": 0}[lights],
        scene=hashlib.sha256(STUDIO.read_bytes()).hexdigest(),
        strata=strata,
        versions=versions(),
        shard_size=shard_size,
    )
    return Plan(request, by_name(sources), tuple(more), optimised or Path())


def make(wanted: Plan, folder: Path, runner: Runner, told: Callable[[ShardResult], None]) -> list[Failure]:
    """Make what is missing of a data set.

    Args:
        folder: made if need be; one that holds the same data set, finished or not, is gone on with.
        runner: `optimize.training.workers.run_here` or `run_on_dask` with their arguments.
        told: of each shard, those first that are there already.

    Returns:
        The textures without fields, as they are listed in failures.jsonl.

    Raises:
        InputError: the folder holds another data set or other files.
    """
    request = wanted.request
    _claim(folder, request)
    missing, lost = [], list[Failure]()
    for number in range(request.shards):
        shard = _there(folder, request, number)
        if shard is None:
            missing.append(number)
        else:
            told(ShardResult(shard))
    # Closed at once on the way out: workers end before this does.
    with closing(runner(wanted.job(number) for number in missing)) as results:
        for done in results:
            number = done.job.number
            if isinstance(done.content, bytes):
                path = shard_path(folder, number)
                write_atomically(path, done.content)
                told(ShardResult(open_shard(path, request, number)))
            else:
                textures = zip(request.places(number), done.job.textures, strict=True)
                gone = tuple(Failure(place, texture.source, str(done.content)) for place, texture in textures)
                lost += gone
                told(ShardResult(None, gone))
    failures = sorted([*open_fieldset(folder).failures(), *lost], key=lambda failure: failure.index)
    write_atomically(folder / FAILURES, text_of_failures(failures).encode())
    return failures


def _claim(folder: Path, request: DatasetRequest) -> None:
    """Make a folder that of this data set, or see that it is."""
    if not (folder / DATASET_FILE).is_file():
        if folder.is_dir() and any(folder.iterdir()):
            raise InputError(f"{folder}: holds files that are not a data set's; choose another folder")
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file; a data set is a folder")
        write_atomically(folder / DATASET_FILE, text_of_request(request).encode())
        return
    there, here = asdict(read_request(folder)), asdict(request)
    for name, value in here.items():
        if there[name] != value:
            different = _difference(there[name], value)
            raise InputError(
                f"{folder / DATASET_FILE}: {name}: {different}: another data set; choose another folder"
            )


def _difference(there: Any, here: Any) -> str:
    if isinstance(there, Mapping):
        parts = [key for key in sorted({*there, *here}) if there.get(key) != here.get(key)]
        return ", ".join(f"{key} {there.get(key)}, not {here.get(key)}" for key in parts)
    return f"{there}, not {here}"


def _there(folder: Path, request: DatasetRequest, number: int) -> Shard | None:
    """A shard that was made before; None if there is none, or none that holds what it should."""
    path = shard_path(folder, number)
    if not path.is_file():
        return None
    try:
        return open_shard(path, request, number)
    except InputError:
        return None


def _digest(names: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(names).encode()).hexdigest()
