"""Shard jobs: everything that one shard of a data set needs, for any process on any machine."""

import hashlib
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactile
from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.ground.threads import one_torch_thread
from retouch.laboratory.training.fields import VARIANT, light_directions, picture_fields, touch_fields
from surrogate.corpus import recipes as corpus
from surrogate.corpus.manifest import entry
from surrogate.corpus.optimised import Optimised, checksum
from surrogate.corpus.recipes import Recipe
from surrogate.data.request import DatasetRequest
from surrogate.data.shard import Failure, ShardRow, layout, shard_bytes
from visual.backend import llvm
from visual.backend.mitsuba import dr
from visual.backend.variants import load_mitsuba

PACKAGES = ("retouch", "mitsuba", "drjit", "torch", "numpy", "scipy", "scikit-image", "pillow")
"""Packages that the values of fields depend on."""

_ONE_AT_A_TIME = threading.Lock()
"""Lock of a process, whose threads share scenes and random numbers; a Dask worker may have several."""


@dataclass(frozen=True)
class ShardJob:
    """Everything that decides a shard: the same job gives the same file, bit for bit.

    Attributes:
        request: Request of the data set.
        number: Number of the shard.
        textures: Textures of the shard, in the order of their places.
        local_heights: By place, the heights (samples, samples) in mm of textures that are cut from a user's
            files, which other machines need not have; or one line that says why there are none.
    """

    request: DatasetRequest
    number: int
    textures: tuple[Recipe | Optimised, ...]
    local_heights: Mapping[int, NDArray[np.float32] | str]


class _NoFieldsError(Exception):
    """A texture has no fields; the message is one line."""


def versions() -> dict[str, str]:
    """Return the versions here of the packages that the fields depend on."""
    return {name: version(name) for name in PACKAGES}


def run_shard(job: ShardJob) -> bytes:
    """Compute a shard.

    A texture that fails is computed again alone, and left out with the reason if it fails again.

    Args:
        job: The job.

    Returns:
        The content of the shard's file.

    Raises:
        InputError: The packages here have other versions than those of the data set.
    """
    request, installed = job.request, versions()
    for name, required in request.versions.items():
        if installed.get(name) != required:
            raise InputError(
                f"{name}: the data set is made by version {required}, this is {installed.get(name)}"
            )
    # One thread: sums keep their order, and processes share the cores better than threads do.
    of_drjit = _one_thread_of_drjit() if request.lights != "none" else nullcontext()
    with _ONE_AT_A_TIME, one_torch_thread(), of_drjit:
        return _run(job)


def _run(job: ShardJob) -> bytes:
    request = job.request
    places = request.places(job.number)
    heights_of: dict[int, AnyArray] = {}
    reasons: dict[int, str] = {}
    for place, texture in zip(places, job.textures, strict=True):
        try:
            heights_of[place] = _heights(job, place, texture)
        except _NoFieldsError as error:
            reasons[place] = str(error)
    fields: dict[int, dict[str, AnyArray]] = {}
    try:
        fields = dict(zip(heights_of, _fields(request, list(heights_of.values())), strict=True))
    except _NoFieldsError:
        # One texture fails the whole batch, so each is computed alone.
        for place, heights in heights_of.items():
            try:
                (fields[place],) = _fields(request, [heights])
            except _NoFieldsError as error:
                reasons[place] = str(error)
    textures = dict(zip(places, job.textures, strict=True))
    rows = tuple(ShardRow(place, entry(textures[place], heights_of[place])) for place in fields)
    failures = tuple(Failure(place, textures[place].source, reasons[place]) for place in sorted(reasons))
    tensors = {
        name: np.array([fields[place][name] for place in fields], dtype=kind).reshape(shape)
        for name, (shape, kind) in layout(request, len(rows)).items()
    }
    return shard_bytes(request, job.number, rows, failures, tensors)


def _heights(job: ShardJob, place: int, texture: Recipe | Optimised) -> AnyArray:
    heights: AnyArray | str | None = job.local_heights.get(place)
    if heights is None:
        assert isinstance(texture, Recipe)
        try:
            heights = corpus.heights(texture, samples=job.request.samples)
        except InputError as error:
            raise _NoFieldsError(str(error)) from error
    if isinstance(heights, str):
        raise _NoFieldsError(heights)
    if not np.isfinite(heights).all():
        raise _NoFieldsError("heights: not every value is finite")
    return heights


def _fields(request: DatasetRequest, heights: list[AnyArray]) -> list[dict[str, AnyArray]]:
    """Compute every tensor of the layout for some reliefs; _NoFieldsError if one of them has none."""
    each: list[dict[str, AnyArray]] = [{"heights": relief} for relief in heights]
    if request.touch != "none" and each:
        touch = _touch_fields(request, np.stack(heights))
        for number, fields in enumerate(each):
            fields |= {name: values[number] for name, values in touch.items()}
    if request.lights != "none":
        for fields in each:
            fields |= _light_fields(request, fields["heights"])
    for fields in each:
        for name, values in fields.items():
            if not np.isfinite(values).all():
                raise _NoFieldsError(f"{name}: not every value is finite")
    return each


def _touch_fields(request: DatasetRequest, heights: AnyArray) -> dict[str, AnyArray]:
    assert request.touch != "none"
    parameters: dict[str, Any] = dict(request.skin)
    try:
        return touch_fields(heights, request.size_mm, tactile.Skin(**parameters), request.touch)
    except (tactile.ContactError, tactile.InputError) as error:
        raise _NoFieldsError(f"touch: {error}") from error


def _light_fields(request: DatasetRequest, heights: AnyArray) -> dict[str, AnyArray]:
    assert request.lights != "none"
    # The seed depends on the heights alone: a texture has the same lights wherever it stands in a data set.
    seed = int(hashlib.sha256(f"lights {checksum(heights)}".encode()).hexdigest()[:15], 16)
    toward = light_directions(request.lights, request.directions, seed)
    return {"toward": toward, **picture_fields(heights, toward, request.strata, seed)}


@contextmanager
def _one_thread_of_drjit() -> Iterator[None]:
    try:
        llvm.prepare()
    except llvm.LLVMMissing as error:
        raise InputError(f"pictures: {error}") from error
    # This comes first because it sets the number of threads once in a process.
    load_mitsuba(colour=False, variant=VARIANT)
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        yield
    finally:
        # With a single thread Mitsuba would wait for ever for the next EXR file that it reads.
        dr.set_thread_count(before)
