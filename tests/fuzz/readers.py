"""Readers of every kind of input, as the fuzzing calls them: what they return must be finite and in range."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.limits import DEEPEST_RELIEF_MM, LARGEST_SIDE, SMALLEST_SIDE
from tests.fuzz.bases import CACHE, DATA, NETS, RESULTS, SIDE, STUDY, WEIGHTS
from tests.fuzz.meshes import read_part

Reader = Callable[[Path, Sequence[Any]], None]
"""A function that reads the files of a folder, with the arguments of the case.

Raises:
    InputError: The files are refused.
    AssertionError: The files are read, and what came of them is not finite or out of range.
"""


def read_height_map(folder: Path, arguments: Sequence[Any]) -> None:
    from relief.heightmap import holds_mm, load_field, load_height_map

    name, size_mm, relief_mm, height_scale = arguments
    path = folder / name
    holds_mm(path)
    read = load_height_map(path, size_mm=size_mm, relief_mm=relief_mm, height_scale=height_scale)
    rows, cols = read.heights.shape
    assert SMALLEST_SIDE <= min(rows, cols) <= max(rows, cols) <= LARGEST_SIDE, f"{rows} x {cols} samples"
    assert np.isfinite(read.heights).all(), "heights are not finite"
    assert 0.0 <= read.heights.min() <= read.heights.max() <= DEEPEST_RELIEF_MM, "heights are out of range"
    assert read.size_mm is None or 0.1 <= read.size_mm <= 1000.0, f"size {read.size_mm}"
    assert load_field(path).shape == (rows, cols)


def read_run_file(folder: Path, arguments: Sequence[Any]) -> None:
    from optimize.settings.run_file import dump_resolved, load_run

    name, *overrides = arguments
    run = load_run(folder / name, overrides)
    again = folder / "again.toml"
    again.write_text(dump_resolved(run), encoding="utf-8")
    assert load_run(again) == run, "the settings that are written out are not those that were read"
    again.unlink()
    _all_finite(run.model_dump(mode="json"))


def read_scene(folder: Path, arguments: Sequence[Any]) -> None:
    from visual.models import obstacles
    from visual.needs import needs_of
    from visual.scene_file.check import check_scene
    from visual.scene_file.describe import describe
    from visual.scene_file.plate_fitting import scene_relief

    path = folder / arguments[0]
    description = describe(check_scene(path))
    needs = needs_of(description)
    for camera in description.cameras:
        assert np.isfinite(camera.to_world).all() and math.isfinite(camera.weight), "a camera is not finite"
        assert camera.rows > 0 and camera.cols > 0 and camera.samples > 0, "a camera has no pixels"
    for light in description.lights:
        assert np.isfinite(light.to_world).all(), "a light is not finite"
        _all_finite([list(light.strength or ()), list(light.direction or ()), light.scale])
    _all_finite(list(needs.weights))
    heights = scene_relief(path).heights
    for model in ("exact", "fast"):
        obstacles(model, description, needs, heights.shape)


def read_checkpoint(folder: Path, arguments: Sequence[Any]) -> None:
    from optimize.descent.driver import check_memory
    from optimize.descent.methods import METHODS
    from optimize.run_directory import results
    from optimize.run_directory.checkpoint import check_key, load_checkpoint
    from optimize.run_directory.history import History
    from optimize.settings.run_file import load_run

    run_dir = folder / arguments[0]
    settings = load_run(run_dir / results.SETTINGS)
    checkpoint = load_checkpoint(run_dir)
    check_key(run_dir / results.SETTINGS, settings, checkpoint.key)
    current, state = checkpoint.current, checkpoint.state
    schema = METHODS[settings.descent.method].load().checkpoint_schema(current.heights, current.memory)
    check_memory(current.memory, schema)
    history = History(
        run_dir, state.surrogate_targets, len(state.iterations), current.step, checkpoint.history
    )
    for record in history.trace():
        assert math.isfinite(record.relative_error), "a step is not finite"
    for iterate in (current, checkpoint.best):
        assert iterate.finite(), "an iterate is not finite"
        assert 0.0 <= iterate.heights.min() <= iterate.heights.max() <= DEEPEST_RELIEF_MM


def read_training(folder: Path, arguments: Sequence[Any]) -> None:
    import torch

    from surrogate.nets.training_checkpoint import load_training

    training = load_training(folder / NETS, _training_key(folder))
    for part in (training.weights, training.best, training.first, training.second):
        for name, tensor in part.items():
            assert bool(torch.isfinite(tensor).all()), f"{name} is not finite"
    assert all(bool((tensor >= 0).all()) for tensor in training.second.values()), (
        "a second moment is negative"
    )
    assert [epoch.number for epoch in training.epochs] == list(range(1, len(training.epochs) + 1))
    _all_finite([epoch.seconds for epoch in training.epochs])


def _training_key(folder: Path) -> Any:
    import hashlib

    from retouch.laboratory.training.train import BLOCK
    from surrogate.nets.training import TrainingSettings
    from surrogate.nets.training_checkpoint import TrainingKey
    from surrogate.nets.unet import NetShape
    from tactile.net import CHANNELS

    digest = hashlib.sha256((folder / DATA / "dataset.json").read_bytes()).hexdigest()
    return TrainingKey("touch", NetShape(CHANNELS, 1, (4, 4), BLOCK), TrainingSettings(epochs=2), digest)


def read_data_set(folder: Path, arguments: Sequence[Any]) -> None:
    from surrogate.data.field_set import first_of, open_fieldset
    from surrogate.data.shard import layout

    data = open_fieldset(folder / DATA)
    for shard in data.shards:
        for name, (shape, kind) in layout(data.request, len(shard.rows)).items():
            values = shard.read(name)
            assert values.shape == shape and values.dtype == kind, f"{name}: {values.dtype} {values.shape}"
            assert np.isfinite(values).all(), f"{name} is not finite"
        heights, shares = shard.read("heights"), shard.read("contact_fraction")
        assert 0.0 <= heights.min() <= heights.max() <= DEEPEST_RELIEF_MM, "heights are out of range"
        assert 0.0 <= shares.min() <= shares.max() <= 1.0, "a share is out of range"
    for split in ("train", "validation", "test"):
        assert np.isfinite(first_of(data, "heights", split, 4)).all()


def read_cache(folder: Path, arguments: Sequence[Any]) -> None:
    """Read the cached operator of `tests.fuzz.bases`; the file may hold anything, and nothing is refused."""
    from visual.backend.llvm import _remembered

    _remembered(folder / CACHE / "llvm.json")
    before = os.environ["RETOUCH_CACHE"]
    os.environ["RETOUCH_CACHE"] = str(folder / CACHE)
    try:
        found = _fields()
    finally:
        os.environ["RETOUCH_CACHE"] = before
    for name, (values, true) in {key: (found[key], _true_fields()[key]) for key in found}.items():
        assert values.shape == true.shape and np.isfinite(values).all(), f"{name} is not finite"
        # A file that another program has sealed has numbers of its own.
        if not arguments[0]:
            assert np.array_equal(values, true), f"{name} is not what was built"


def _fields() -> dict[str, Any]:
    import torch

    import tactile.layer.elastic_layer as layer
    from tactile.skin import Skin

    layer._operator.cache_clear()
    operator = layer.elastic_layer_operator(Skin(), SIDE, 10.0, coarse=2)
    layer._operator.cache_clear()
    pressure = torch.as_tensor(np.random.default_rng(0).random((SIDE, SIDE)))
    return {
        "displacement": operator.displacement(pressure).numpy(),
        "strain": operator.strain(pressure).numpy(),
    }


@cache
def _true_fields() -> Mapping[str, Any]:
    return _fields()


def _all_finite(value: Any) -> None:
    """Assert that every number in nested lists and mappings is finite."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for inner in value:
            _all_finite(inner)
    elif isinstance(value, float):
        assert math.isfinite(value), "a number is not finite"


def check_results(folder: Path, printed: str) -> None:
    """Assert that what a command wrote and printed is finite and in range."""
    from relief.heightmap import load_height_map

    if printed.startswith("["):
        _all_finite(json.loads(printed))
    for path in folder.rglob("*"):
        assert not path.name.endswith(".partial"), f"{path.name} is left"
        if path.name == "result.json":
            _all_finite(json.loads(path.read_text(encoding="utf-8")))
        elif path.name == "heights.exr":
            load_height_map(path)
        elif path.suffix == ".exr" and path.parent.name in ("out", "renders"):
            import OpenEXR

            with OpenEXR.File(str(path), separate_channels=True) as file:
                for channel in file.parts[0].channels.values():
                    assert np.isfinite(channel.pixels).all(), f"{path.name} is not finite"


def read_picture(folder: Path, arguments: Sequence[Any]) -> None:
    from relief.preparing.picture_preparation import prepare

    name, asked = arguments
    prepared = prepare(folder / name, **asked)
    heights = prepared.heights
    assert heights.shape[0] == heights.shape[1] >= SMALLEST_SIDE, f"{heights.shape} samples"
    assert np.isfinite(heights).all() and 0.0 <= heights.min() <= heights.max() <= DEEPEST_RELIEF_MM
    _all_finite(dict(prepared.numbers))


def read_result(folder: Path, arguments: Sequence[Any]) -> None:
    from optimize.run_directory.finished_run import finished
    from retouch.commands.summary import summary

    result = finished(folder / RESULTS)
    if result is not None:
        _all_finite(result.as_json())
        with contextlib.suppress(LookupError, TypeError, ValueError, AttributeError):
            # As the command, which then goes on with the run.
            list(summary(result, folder / RESULTS))


def read_weights(folder: Path, arguments: Sequence[Any]) -> None:
    from dataclasses import asdict

    import torch

    from surrogate.nets.weights import load_net

    net, card = load_net("touch", folder / WEIGHTS)
    assert all(bool(torch.isfinite(values).all()) for values in net.state_dict().values())
    _all_finite(asdict(card))


def read_study(folder: Path, arguments: Sequence[Any]) -> None:
    from retouch.laboratory.studies import engine
    from retouch.laboratory.studies.document import (
        document,
        document_bytes,
        flat_rows,
        read_document,
        spreadsheet,
    )
    from retouch.laboratory.studies.page import page
    from retouch.laboratory.studies.rows import expand
    from retouch.laboratory.studies.study_file import load_study

    out, again = folder / STUDY, folder / "again.json"
    study = load_study(folder / arguments[0])
    for quick in (False, True):
        expanded = expand(study, quick)
        assert not any("\n" in fault for fault in expanded.faults), "a fault has several lines"
        given = read_document(out / engine.DOCUMENT).records
        content = document(study, expanded, engine.known(expanded, out, study.measures, given), quick)
        again.write_bytes(document_bytes(content))
        assert read_document(again) == content, "the document that is written is not the one that is read"
        again.unlink()
        _all_finite(flat_rows(content))
        spreadsheet(content)
        page(content, out)
    page(read_document(out / engine.DOCUMENT), out)


READERS: Mapping[str, Reader] = {
    "weights": read_weights,
    "height maps": read_height_map,
    "pictures": read_picture,
    "meshes": read_part,
    "results": read_result,
    "studies": read_study,
    "run files": read_run_file,
    "scenes": read_scene,
    "checkpoints": read_checkpoint,
    "trainings": read_training,
    "data sets": read_data_set,
    "caches": read_cache,
}
