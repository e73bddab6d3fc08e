"""Learned models: their data sets, and their training."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import torch

from relief.ground.errors import InputError
from relief.ground.progress import Progress, stage, this_stage
from relief.heightmap import load_field
from retouch.laboratory.training.dataset import DIRECTIONS, ShardResult, make_dataset, plan_dataset
from retouch.laboratory.training.setup import Kind
from retouch.laboratory.training.shard_jobs import run_shard
from retouch.laboratory.training.train import WIDTHS, TrainingRequest, train_net
from retouch.laboratory.workers.choice import runner
from retouch.verbs.progress_display import followed
from surrogate.corpus.photographs import bundled, folder
from surrogate.data.shard import Failure
from surrogate.nets.training import Epoch, TrainingSettings
from surrogate.nets.weights import ModelCard

LEAST_SAMPLES, MOST_SAMPLES = 36, 4096


@dataclass(frozen=True)
class DatasetMade:
    """A data set that was made or completed.

    Attributes:
        folder: of the data set.
        textures: number of textures, with fields and without.
        failures: textures without fields.
    """

    folder: Path
    textures: int
    failures: tuple[Failure, ...]

    def as_json(self) -> dict[str, Any]:
        """What `retouch dataset --json` prints."""
        failures = [asdict(failure) for failure in self.failures]
        return {"folder": str(self.folder), "textures": self.textures, "failures": failures}


@dataclass(frozen=True)
class TrainedNet:
    """A net that was trained.

    Attributes:
        folder: of its weights, card, curves and checkpoint.
        card: the net's training data and errors.
    """

    folder: Path
    card: ModelCard

    def as_json(self) -> dict[str, Any]:
        """What `retouch train --json` prints."""
        return {"folder": str(self.folder), **asdict(self.card)}


def dataset(
    out: str | os.PathLike[str],
    count: int,
    *,
    seed: int = 0,
    textures: Sequence[str | os.PathLike[str]] = (),
    optimised: str | os.PathLike[str] | None = None,
    touch: Literal["fem", "layer", "none"] = "fem",
    lights: Literal["random", "studio", "none"] = "random",
    directions: int | None = None,
    samples: int = 144,
    workers: int | None = None,
    dask: str | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> DatasetMade:
    """Draw a corpus of textures, and compute how each feels and looks.

    Args:
        out: folder of the data set, new or unfinished.
        count: number of textures to draw.
        seed: of the corpus.
        textures: folders of further height maps to cut textures from.
        optimised: folder of optimised textures to add, with their manifest.
        touch: model of touch; "none": no fields of touch.
        lights: "random", elevation 10 to 80 degrees; "studio", its three lights; "none", no pictures.
        directions: number of random lights of each texture; None: 8.
        samples: shadow rays a pixel where light and shadow meet.
        workers, dask, quiet, progress: as in `study`.

    Raises:
        InputError: a texture cannot be read, no field is left to compute, or the folder holds another set.
    """
    if lights != "random" and directions is not None:
        fixed = f'directions: lights="{lights}" fixes the directions'
        raise InputError(fixed, f"--directions: --lights {lights} fixes the directions")
    if touch == lights == "none":
        fault = "no field is left to compute"
        raise InputError(f"touch, lights: {fault}", f"--touch none --lights none: {fault}")
    if not LEAST_SAMPLES <= samples <= MOST_SAMPLES:
        raise InputError(f"samples: {samples} is not a number from {LEAST_SAMPLES} to {MOST_SAMPLES}")
    photographs = bundled()
    for path in textures:
        photographs += folder(Path(path), load_field)
    plan = plan_dataset(
        seed,
        count,
        photographs,
        optimised=None if optimised is None else Path(optimised),
        touch=touch,
        lights=lights,
        directions=DIRECTIONS if directions is None else directions,
        strata=math.ceil(math.sqrt(samples)),
    )
    chosen, total = runner(run_shard, workers, dask), plan.request.total
    with followed(progress, quiet), stage("data set"):
        failures = make_dataset(plan, Path(out), chosen, _teller(total))
    return DatasetMade(Path(out), total, tuple(failures))


def _teller(total: int) -> Callable[[ShardResult], None]:
    """An observer that reports of each shard how many textures are done."""
    count = 0

    def observer(result: ShardResult) -> None:
        nonlocal count
        count += result.textures
        shard = "a shard abandoned" if result.shard is None else f"shard {result.shard.number}"
        this_stage().describe(f"{shard}: {count} of {total} textures")

    return observer


def train(
    net: Kind,
    data: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    seed: int = 0,
    epochs: int | None = None,
    minutes: float | None = None,
    batch: int | None = None,
    learning_rate: float | None = None,
    widths: Sequence[int] = WIDTHS,
    device: Literal["cpu", "cuda"] | None = None,
    resume: bool = False,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TrainedNet:
    """Train a net on a data set, and measure it on textures of the test split.

    Args:
        net: "touch", the contact of the skin, or "look", ambient light.
        data: folder of the data set.
        out: folder for weights, card, curves and checkpoint.
        seed: of the training.
        epochs: most passes over the textures; None: 60.
        minutes: most minutes; None: no limit.
        batch: textures of a training step; None: 16.
        learning_rate: highest rate; None: 0.002.
        widths: channels of the net's levels, finest first.
        device: where to train; None: "cuda" if there is one.
        resume: go on from the checkpoint in `out`.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: the data set does not serve, `out` holds another training, there is none to resume, the
            training diverges, or there is no such device.
    """
    has_cuda = torch.cuda.is_available()
    if device == "cuda" and not has_cuda:
        fault = "torch finds no such device"
        raise InputError(f'device="cuda": {fault}', f"--device cuda: {fault}")
    options = {"epochs": epochs, "minutes": minutes, "batch": batch, "learning_rate": learning_rate}
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    settings = TrainingSettings(seed=seed, **given)
    chosen = device or ("cuda" if has_cuda else "cpu")
    request = TrainingRequest(
        Path(data), Path(out), settings, device=chosen, resume=resume, widths=tuple(widths)
    )

    def report(epoch: Epoch) -> None:
        this_stage().describe(
            f"epoch {epoch.number} of at most {settings.epochs}: loss {epoch.loss:.4f}, "
            f"validation {epoch.error:.4f}, {epoch.seconds:.0f} s"
        )

    with followed(progress, quiet):
        return TrainedNet(Path(out), train_net(net, request, report))
