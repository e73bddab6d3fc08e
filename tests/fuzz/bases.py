"""Bases: sound inputs of every kind, which the fuzzing tampers with. They are made by Retouch itself."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from relief.heightmap import save_heights_exr
from relief.relief import Relief

SIDE = 16
RUNS = {"gauss": "gauss-newton", "adam": "adam"}
"""Folders of runs, with their methods."""
RESULTS, DATA, NETS, WEIGHTS, CACHE, STUDY = "finished", "data", "nets", "weights", "cache", "study"
"""Folders of a finished run, a data set, a training on it, a net, cached operators and a study."""

SCENE = """<scene version="3.9.1">
    <default name="resolution" value="16"/>
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="orthographic" id="above">
        <transform name="to_world">
            <scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="multijitter"><integer name="sample_count" value="4"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$resolution"/><integer name="height" value="$resolution"/>
            <string name="pixel_format" value="luminance"/><string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <emitter type="directional" id="sun">
        <vector name="direction" x="-1" y="0.2" z="-1"/><rgb name="irradiance" value="3"/>
    </emitter>
    <emitter type="constant" id="sky"><rgb name="radiance" value="0.2"/></emitter>
    <shape type="heightfield" id="plate">
        <string name="filename" value="plate.exr"/><float name="size_mm" value="10"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
    </shape>
</scene>
"""
RUN = """scene = "../scene.xml"
texture = "../plate.exr"
touch.jnd = 1
descent = { method = "METHOD", steps = STEPS }
verify = { model = "none", samples = 4 }
"""
STUDY_FILE = """title = "T"
base = "base.toml"
measures = ["pace"]
[[tables]]
name = "feel"
axes = { "touch.jnd" = [1, -1] }
[[tables]]
name = "steps"
axes = { "descent.steps" = [1] }
[quick]
axes = { "touch.jnd" = [1] }
[[plots]]
x = "touch.jnd"
y = "change_percent"
"""
MESH = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
MESH += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def make(folder: Path, learning: bool) -> dict[str, dict[str, bytes]]:
    """Make the sound inputs in an empty folder.

    Args:
        folder: The folder, which is left with them.
        learning: Whether whole trainings follow, which take the finite elements; these are built and kept.

    Returns:
        Files by kind of input.
    """
    from PIL import Image

    from relief.heightmap import write_exr

    if learning:
        from tactile.measures import measure_touch
        from tactile.skin import Skin

        measure_touch(Relief(waves(), 10.0), Skin(), "fem")
    save_heights_exr(folder / "plate.exr", waves())
    (folder / "scene.xml").write_text(SCENE)
    run_files = _files(folder)
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(folder / "picture.png")
    write_exr(folder / "sky.exr", np.full((4, 8), 0.3))
    (folder / "mesh.ply").write_text(MESH)
    (folder / "light.spd").write_text("400 0.5\n700 0.6\n")
    scenes = _files(folder)
    runs = _runs(folder)
    return {
        "height maps": {},
        "pictures": {},
        "meshes": {},
        "results": run_files | _files(folder, RESULTS),
        "run files": run_files,
        "scenes": scenes,
        "checkpoints": run_files | runs,
        "studies": run_files | _study(folder),
        **_learning(folder),
        "weights": _net(folder),
        "caches": {"plate.exr": run_files["plate.exr"], **_cache(folder)},
    }


def waves() -> np.ndarray:
    """(16, 16) heights of crossing waves, mm, 0 to 1."""
    at = np.arange(SIDE) / SIDE
    heights = np.sin(2 * np.pi * 3 * at)[:, None] + np.sin(2 * np.pi * (5 * at[None, :] + 2 * at[:, None]))
    return np.asarray((heights - heights.min()) / np.ptp(heights))


def _files(folder: Path, *below: str) -> dict[str, bytes]:
    """Contents of the files in a folder, or in some folders below."""
    places: Iterable[Path] = [folder / name for name in below] or [folder]
    paths = [path for place in places for path in sorted(place.rglob("*")) if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def _runs(folder: Path) -> dict[str, bytes]:
    """Run directories of both methods that stopped after one of two steps."""
    from retouch.verbs import runs

    (folder / "begin.toml").write_text(
        RUN.replace("../", "").replace("METHOD", "gauss-newton").replace("STEPS", "1")
    )
    runs.optimize(folder / "begin.toml", folder / RESULTS)
    settings = (folder / RESULTS / "run.toml").read_text()
    (folder / RESULTS / "run.toml").write_text(settings.replace(f'"{folder}/', '"../'))
    for name, method in RUNS.items():
        (folder / name).mkdir()
        path = folder / name / "begin.toml"
        path.write_text(RUN.replace("METHOD", method).replace("STEPS", "1"))
        runs.optimize(path, folder / name / "out")
        # As in a folder that was moved: the files are beside the run directory, wherever that lies.
        settings = (folder / name / "out" / "run.toml").read_text()
        settings = settings.replace(f'"{folder}/', '"../').replace("steps = 1", "steps = 2")
        (folder / name / "run.toml").write_text(settings)
        (folder / name / "out" / "run.toml").unlink()
        for kept in ("history.jsonl", "checkpoint"):
            os.replace(folder / name / "out" / kept, folder / name / kept)
    found = _files(folder, *RUNS)
    return {
        path: content
        for path, content in found.items()
        if path.split("/")[1] in ("run.toml", "history.jsonl", "checkpoint")
    }


def _study(folder: Path) -> dict[str, bytes]:
    """A study of two rows that are done, without pictures."""
    from retouch.laboratory.studies import engine
    from retouch.laboratory.studies.page import write_study
    from retouch.laboratory.studies.rows import expand
    from retouch.laboratory.studies.study_file import load_study
    from retouch.laboratory.workers.jobs import JobResult, Runner, Work

    def in_process(work: Work, observer: object) -> Runner:
        return lambda jobs: (JobResult(job, work(job)) for job in jobs)

    run = RUN.replace("../", "").replace("METHOD", "gauss-newton").replace("STEPS", "1")
    (folder / "base.toml").write_text(run)
    (folder / "study.toml").write_text(STUDY_FILE)
    study = load_study(folder / "study.toml")
    expanded = expand(study)
    rows = engine.compute(expanded, folder / STUDY, in_process, study.measures)
    write_study(folder / STUDY, study, expanded, rows, quick=False)
    kept = ("study.json", "result.json", "heights.exr")
    files = {path: content for path, content in _files(folder, STUDY).items() if path.endswith(kept)}
    return files | {name: (folder / name).read_bytes() for name in ("base.toml", "study.toml")}


def _learning(folder: Path) -> dict[str, dict[str, bytes]]:
    """A data set of 24 textures, and a training on it that stopped after one of two epochs."""
    from retouch.laboratory.training.dataset import make_dataset, plan_dataset
    from retouch.laboratory.training.shard_jobs import run_shard
    from retouch.laboratory.training.train import TrainingRequest, train_net
    from retouch.laboratory.workers.jobs import JobResult
    from surrogate.nets.training import TrainingSettings

    plan = plan_dataset(5, 24, (), touch="layer", lights="none", samples=SIDE)
    make_dataset(
        plan, folder / DATA, lambda jobs: (JobResult(job, run_shard(job)) for job in jobs), lambda made: None
    )

    def stop(epoch: object) -> None:
        raise KeyboardInterrupt

    request = TrainingRequest(
        folder / DATA, folder / NETS, TrainingSettings(epochs=2), widths=(4, 4), reference="layer"
    )
    with contextlib.suppress(KeyboardInterrupt):
        train_net("touch", request, stop)
    data, nets = _files(folder, DATA), _files(folder, NETS)
    training = {name: content for name, content in nets.items() if name.endswith(".safetensors")}
    return {"trainings": data | training, "data sets": data | training}


def _net(folder: Path) -> dict[str, bytes]:
    """A small net of touch, untrained, with its card."""
    import hashlib

    from surrogate.nets.unet import NetShape, UNet
    from surrogate.nets.weights import ModelCard, Sample, save_net, weights_bytes

    net = UNet(NetShape(3, 1, (4, 4)))
    digest = hashlib.sha256(weights_bytes(net)).hexdigest()
    numbers: dict[str, float] = {"samples": 16, "poisson_ratio": 0.48}
    sample = (Sample(0, 1, {"roughness": 0.1}),)
    card = ModelCard("touch", net.shape, digest, numbers, {"seed": 0.0}, {}, {}, {"torch": "2"}, sample)
    save_net(folder / WEIGHTS, net, card)
    return _files(folder, WEIGHTS)


def _cache(folder: Path) -> dict[str, bytes]:
    """A small cached operator, in a folder of its own, and the operator that `evaluate` takes."""
    import tactile.layer.elastic_layer as layer
    from tactile.skin import Skin

    before = os.environ.get("RETOUCH_CACHE")
    os.environ["RETOUCH_CACHE"] = str(folder / CACHE)
    try:
        layer._operator.cache_clear()
        layer.elastic_layer_operator(Skin(), SIDE, 10.0, coarse=2)
    finally:
        layer._operator.cache_clear()
        if before is not None:
            os.environ["RETOUCH_CACHE"] = before
    return _files(folder, CACHE)
