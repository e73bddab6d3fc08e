"""Data sets for training: a corpus of textures with fields of touch and sight, shard by shard.

A shard is a pure function of its job (`retouch.laboratory.training.shard_jobs`), is written atomically, and
is not computed again if it exists: after any interruption the next run continues, and the files are the same.
"""

import hashlib
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import tactile
from relief.ground.errors import InputError
from relief.ground.files import only_writer, partial_folders, remove_partial, write_atomically
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.progress import stage
from retouch.laboratory.training.fields import STUDIO, STUDIO_AZIMUTHS
from retouch.laboratory.training.shard_jobs import ShardJob, versions
from retouch.laboratory.workers.jobs import Runner
from surrogate.corpus import manifest
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import Entry
from surrogate.corpus.optimised import Optimised
from surrogate.corpus.photographs import Photograph, by_name
from surrogate.corpus.recipes import PROCEDURAL_SHARE, SAMPLES, Recipe
from surrogate.data.field_set import FAILURES, SHARDS, open_fieldset, shard_path, text_of_failures
from surrogate.data.request import DATASET_FILE, SHARD_SIZE, DatasetRequest, read_request, text_of_request
from surrogate.data.shard import Failure, Shard, layout, open_shard

_log = logging.getLogger(__name__)

DIRECTIONS = 8
"""Random lights of each texture, where no other number is given."""


@dataclass(frozen=True)
class DatasetPlan:
    """Plan of a data set: its request, and the textures that the request names by checksums only.

    Attributes:
        request: Request of the data set.
        photographs: Pictures that textures are cut from, by name.
        optimised: Optimised textures, which come after the corpus.
        folder: Folder of the optimised textures.
    """

    request: DatasetRequest
    photographs: Mapping[str, Photograph]
    optimised: tuple[Entry, ...] = ()
    folder: Path = Path()

    def textures(self, shard: int) -> Iterator[Recipe | Optimised]:
        """Yield the textures of a shard, in the order of their places."""
        request, photographs = self.request, tuple(self.photographs.values())
        for place in request.places(shard):
            if place < request.count:
                yield corpus.recipe(request.seed, place, photographs, request.procedural_share)
            else:
                yield self.optimised[place - request.count].texture

    def job(self, shard: int) -> ShardJob:
        """Return the job of a shard, with the heights that only this machine can make."""
        textures = tuple(self.textures(shard))
        local_heights: dict[int, NDArray[np.float32] | str] = {}
        for place, texture in zip(self.request.places(shard), textures, strict=True):
            try:
                if isinstance(texture, Optimised):
                    line = self.optimised[place - self.request.count]
                    local_heights[place] = manifest.read(line, self.folder)
                elif texture.source.startswith("file/"):
                    local_heights[place] = corpus.heights(
                        texture, self.photographs, samples=self.request.samples
                    )
            except InputError as error:
                local_heights[place] = str(error)
        return ShardJob(self.request, shard, textures, local_heights)


@dataclass(frozen=True)
class ShardResult:
    """Result of a shard: the shard, or the textures of a shard that is abandoned.

    Attributes:
        shard: The shard, None if it is abandoned.
        lost: Textures of an abandoned shard.
    """

    shard: Shard | None
    lost: tuple[Failure, ...] = ()

    @property
    def textures(self) -> int:
        """Number of textures, with fields or without."""
        return len(self.lost) if self.shard is None else len(self.shard.rows) + len(self.shard.failures)


def plan_dataset(
    seed: int,
    count: int,
    photographs: Sequence[Photograph],
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
) -> DatasetPlan:
    """Plan a data set; every photograph and every optimised texture is read, and so checked.

    Args:
        seed: Seed of the corpus.
        count: Textures of the corpus.
        photographs: Pictures to cut textures from.
        procedural_share: Share of the corpus that procedural families make.
        optimised: Folder with a manifest of optimised textures, which come after the corpus.
        touch: Model of touch.
        skin: Skin without layers, by default that of `tactile.Skin`.
        lights: "studio", three lights; "random", ``directions`` lights; "none", no pictures.
        directions: Number of random lights of each texture.
        strata: Shadow rays along a pixel's side where light and shadow meet.
        samples: Samples a side of heights, fields and pictures.
        shard_size: Textures of a shard.

    Returns:
        The plan.

    Raises:
        InputError: A photograph or an optimised texture cannot be read; the skin is layered.
    """
    skin = skin or tactile.Skin()
    if skin.layers:
        raise InputError("skin.layers: data sets are made for skin without layers")
    for photograph in photographs:
        photograph.read()
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
        sources=_checksum(sorted(photograph.name for photograph in photographs)),
        optimised=_checksum(line.sha256 for line in more),
        total=count + len(more),
        samples=samples,
        size_mm=PATCH_SIDE_MM,
        touch=touch,
        skin=skin.numbers(),
        lights=lights,
        directions={"studio": len(STUDIO_AZIMUTHS), "random": directions, "none": 0}[lights],
        scene=hashlib.sha256(STUDIO.read_bytes()).hexdigest(),
        strata=strata,
        versions=versions(),
        shard_size=shard_size,
    )
    return DatasetPlan(request, by_name(photographs), tuple(more), optimised or Path())


def make_dataset(
    plan: DatasetPlan, folder: Path, runner: Runner, observer: Callable[[ShardResult], None]
) -> list[Failure]:
    """Compute the missing shards of a data set.

    Args:
        plan: Plan of the data set.
        folder: Folder of the data set, which may be new or hold part of the same data set.
        runner: `retouch.laboratory.workers.processes.run_here` or `run_on_dask` with their arguments and the
            work `retouch.laboratory.training.shard_jobs.run_shard`.
        observer: Called for each shard, first for those that exist already.

    Returns:
        The textures without fields, as failures.jsonl lists them.

    A folder with the same data set and a smaller count is extended: its complete shards stay.

    Raises:
        InputError: The folder holds another data set or other files, or another command writes into it.
    """
    request = plan.request
    with only_writer(folder):
        _claim_folder(folder, request)
        for place in (folder, folder / SHARDS):
            remove_partial(place)
        missing, lost = [], list[Failure]()
        for number in range(request.shards):
            shard = _existing(folder, request, number)
            if shard is None:
                missing.append(number)
            else:
                _log.info("%s: is there, not computed again", shard.path)
                observer(ShardResult(shard))
        # Closing ends the workers before this function returns or raises.
        left = sum(len(request.places(number)) for number in missing)
        with (
            stage("computing fields of textures", left) as advance,
            closing(runner(plan.job(number) for number in missing)) as results,
        ):
            for result in results:
                number = result.job.number
                advance(len(request.places(number)))
                if isinstance(result.content, bytes):
                    path = shard_path(folder, number)
                    write_atomically(path, result.content)
                    observer(ShardResult(open_shard(path, request, number)))
                else:
                    textures = zip(request.places(number), result.job.textures, strict=True)
                    abandoned = tuple(
                        Failure(place, texture.source, str(result.content)) for place, texture in textures
                    )
                    lost += abandoned
                    observer(ShardResult(None, abandoned))
        failures = sorted([*open_fieldset(folder).failures(), *lost], key=lambda failure: failure.index)
        write_atomically(folder / FAILURES, text_of_failures(failures).encode())
        return failures


def _claim_folder(folder: Path, request: DatasetRequest) -> None:
    """Write the request into a new folder, or compare an existing folder's request with it, and extend it."""
    if not (folder / DATASET_FILE).is_file():
        if not set(folder.iterdir()) <= set(partial_folders(folder)):
            raise InputError(f"{folder}: holds files that are not a data set's; choose another folder")
        write_atomically(folder / DATASET_FILE, text_of_request(request).encode())
        return
    earlier = read_request(folder)
    if (
        earlier.count < request.count
        and replace(earlier, count=request.count, total=request.total) == request
    ):
        _extend(folder, earlier, request)
        return
    stored, requested = asdict(earlier), asdict(request)
    # The counts last: alone they would be no fault, unless they are smaller.
    for name, value in sorted(requested.items(), key=lambda item: item[0] in ("count", "total")):
        if stored[name] != value:
            path, difference = folder / DATASET_FILE, _difference(stored[name], value)
            raise InputError(f"{path}: {name}: {difference}: another data set; choose another folder")


def _extend(folder: Path, earlier: DatasetRequest, request: DatasetRequest) -> None:
    """Make the folder that of a larger count; only shards full of the earlier corpus are the same in both."""
    # Before the request: a kill between the two leaves the earlier data set, to be completed or extended.
    for number in range(earlier.count // earlier.shard_size, earlier.shards):
        shard_path(folder, number).unlink(missing_ok=True)
    write_atomically(folder / DATASET_FILE, text_of_request(request).encode())


def _difference(stored: Any, requested: Any) -> str:
    if isinstance(stored, Mapping):
        keys = [key for key in sorted({*stored, *requested}) if stored.get(key) != requested.get(key)]
        return ", ".join(f"{key} {stored.get(key)}, not {requested.get(key)}" for key in keys)
    return f"{stored}, not {requested}"


def _existing(folder: Path, request: DatasetRequest, number: int) -> Shard | None:
    """Return an existing shard, with every value checked; None if there is none, or if it is damaged."""
    path = shard_path(folder, number)
    with suppress(InputError):
        if path.is_file():
            shard = open_shard(path, request, number)
            for name in layout(request, 0):
                shard.read(name)
            return shard
    return None


def _checksum(names: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(names).encode()).hexdigest()
