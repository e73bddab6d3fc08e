"""A net from a data set: trained, measured on textures that it has not seen, and written down."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import torch

from optimize.training.curves import curves_page
from optimize.training.setup import Kind, TrainingSetup
from relief.errors import InputError
from relief.files import write_atomically
from surrogate.data.field_set import Fieldset, open_fieldset
from surrogate.data.request import DATASET_FILE
from surrogate.nets.checkpoint import CHECKPOINT_FILE, TrainingKey, load_training, save_training
from surrogate.nets.training import Epoch, Settings, Training, train
from surrogate.nets.unet import Shape, UNet
from surrogate.nets.weights import Card, save_net, weights_bytes

PACKAGES = ("retouch", "torch", "numpy", "scipy", "scikit-image")
CURVES_PAGE = "curves.html"
TESTED = 400
"""Textures of the test split that a net is measured on; the first ones."""
WIDTHS, BLOCK = (24, 48, 72, 96), 4
"""Channels of the net's levels by default, and the side of the squares of pixels that it works on: squares of
2 x 2 take more than twice as long (docs/learned.md)."""


@dataclass(frozen=True)
class TrainingRequest:
    """What to train.

    Attributes:
        data: folder of the data set.
        out: where weights, card, curves and checkpoint go.
        widths: channels of the net's levels.
        device: "cpu" or "cuda".
        resume: go on from the checkpoint in `out`.
        tested: textures that it is measured on.
        reference: what it is measured against.
    """

    data: Path
    out: Path
    settings: Settings
    widths: tuple[int, ...] = WIDTHS
    device: str = "cpu"
    resume: bool = False
    tested: int = TESTED
    reference: Literal["fem", "layer"] = "fem"


def train_net(
    kind: Kind, request: TrainingRequest, tell: Callable[[Epoch], None] = lambda epoch: None
) -> Card:
    """Train a net and write ``KIND.safetensors``, ``KIND.json`` and the curves into `order.out`.

    Interrupted, it leaves a checkpoint after every epoch; resumed, it ends at the same weights.

    Raises:
        InputError: the data set is no good, `out` holds another training, or there is none to resume.
    """
    data = open_fieldset(request.data)
    setup = _setup(kind, data, request)
    shape = Shape(setup.inputs, 1, request.widths, BLOCK)
    side = data.request.samples
    if side % shape.multiple:
        raise InputError(f"{request.data}: samples: {side} is no multiple of {shape.multiple}")
    begun = TrainingKey(kind, shape, request.settings, _digest(request.data / DATASET_FILE))
    if not request.resume and (request.out / CHECKPOINT_FILE).exists():
        raise InputError(
            f"{request.out / CHECKPOINT_FILE}: a training lies here; go on with --resume, or choose another"
        )
    start = load_training(request.out, begun) if request.resume else None
    torch.manual_seed(request.settings.seed)
    net = UNet(shape).to(request.device)

    def keep(training: Training) -> None:
        save_training(request.out, begun, training)
        write_atomically(request.out / CURVES_PAGE, curves_page(kind, training.epochs).encode())
        tell(training.epochs[-1])

    there = setup.task.to(torch.device(request.device))
    training = train(net, there, setup.examples, setup.validation, request.settings, start, keep)
    best = training.best_epoch
    if best is None or not math.isfinite(best.error):
        raise InputError(f"{request.out}: the training went astray; try a smaller --learning-rate")
    card = _card(request, setup, data, net.cpu().requires_grad_(False), begun, training)
    save_net(request.out, net, card)
    return card


def _setup(kind: Kind, data: Fieldset, request: TrainingRequest) -> TrainingSetup:
    if kind == "touch":
        from optimize.training.touch_setup import touch_setup

        return touch_setup(data, request.tested, request.reference)
    from optimize.training.look_setup import look_setup

    return look_setup(data, request.tested)


def _card(
    request: TrainingRequest,
    setup: TrainingSetup,
    data: Fieldset,
    net: UNet,
    begun: TrainingKey,
    training: Training,
) -> Card:
    best = training.best_epoch
    assert best is not None
    splits = {split: data.count(split) for split in ("train", "validation", "test")}
    return Card(
        kind=setup.kind,
        shape=net.shape,
        sha256=hashlib.sha256(weights_bytes(net)).hexdigest(),
        valid=setup.valid,
        data={
            **{f"{split} textures": count for split, count in splits.items()},
            **setup.data,
            "corpus seed": data.request.seed,
            "dataset.json sha256": begun.data,
        },
        training={
            **{name: value for name, value in asdict(request.settings).items() if value is not None},
            "epochs done": training.epochs[-1].number,
            "best epoch": best.number,
            "best validation error": best.error,
            "seconds": training.epochs[-1].seconds,
            "ended": training.ended(request.settings) or "",
        },
        errors=setup.measure(net),
        versions={"reference": setup.reference} | {name: version(name) for name in PACKAGES},
        sample=setup.figures(net),
    )


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
