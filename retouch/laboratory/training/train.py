"""Training of a net on a data set: loop, measurement on the test split, weights and card."""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import torch

from relief.ground.errors import InputError
from relief.ground.files import only_writer, write_atomically
from retouch.laboratory.training.look import look_setup
from retouch.laboratory.training.setup import Kind, TrainingSetup, card_samples
from retouch.laboratory.training.touch import touch_setup
from retouch.pages.rendering import render_page
from retouch.pages.svg import Series, line_chart
from surrogate.data.field_set import Fieldset, open_fieldset
from surrogate.data.request import DATASET_FILE
from surrogate.nets.training import Epoch, Training, TrainingSettings, train
from surrogate.nets.training_checkpoint import CHECKPOINT_FILE, TrainingKey, load_training, save_training
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import ModelCard, save_net, weights_bytes

PACKAGES = ("retouch", "torch", "numpy", "scipy", "scikit-image")
"""Packages whose versions a card lists."""
CURVES_PAGE = "curves.html"
TESTED = 400
"""Most textures of the test split, from the first, that a net is measured on."""
WIDTHS, BLOCK = (24, 48, 72, 96), 4
"""Channels of the net's levels, and side in pixels of the squares that the finest level works on; squares of
2 x 2 pixels take more than twice as long."""


@dataclass(frozen=True)
class TrainingRequest:
    """Request for a training.

    Attributes:
        data: Folder of the data set.
        out: Folder for weights, card, curves and checkpoint.
        settings: Settings of the training.
        widths: Channels of the net's levels, finest first.
        device: "cpu" or "cuda".
        resume: Whether the checkpoint in `out` is resumed.
        tested: Most textures that the net is measured on.
        reference: Model of touch that the touch net is measured against.
    """

    data: Path
    out: Path
    settings: TrainingSettings
    widths: tuple[int, ...] = WIDTHS
    device: str = "cpu"
    resume: bool = False
    tested: int = TESTED
    reference: Literal["fem", "layer"] = "fem"


def train_net(
    kind: Kind, request: TrainingRequest, observer: Callable[[Epoch], None] = lambda epoch: None
) -> ModelCard:
    """Train a net and write ``KIND.safetensors``, ``KIND.json`` and the curves into ``request.out``.

    There is a checkpoint after every epoch; a training that is interrupted and resumed ends at the same
    weights.

    Args:
        kind: Kind of the net.
        request: What to train, and on which data.
        observer: Called after every epoch.

    Returns:
        The card of the net.

    Raises:
        InputError: The data set does not serve, ``request.out`` holds another training, there is none to
            resume, another command writes into ``request.out``, or the training diverges.
    """
    data = open_fieldset(request.data)
    if kind == "touch":
        setup = touch_setup(data, request.tested, request.reference)
    else:
        setup = look_setup(data, request.tested)
    shape = NetShape(setup.inputs, 1, request.widths, BLOCK)
    side = data.request.samples
    if side % shape.multiple:
        raise InputError(f"{request.data}: samples: {side} is no multiple of {shape.multiple}")
    checksum = hashlib.sha256((request.data / DATASET_FILE).read_bytes()).hexdigest()
    key = TrainingKey(kind, shape, request.settings, checksum)
    start = load_training(request.out, key) if request.resume else None
    torch.manual_seed(request.settings.seed)
    net = UNet(shape).to(request.device)

    def after_epoch(training: Training) -> None:
        save_training(request.out, key, training)
        write_atomically(request.out / CURVES_PAGE, _curves_page(kind, training.epochs))
        observer(training.epochs[-1])

    loss = setup.loss.to(torch.device(request.device))
    with only_writer(request.out):
        if start is None and (request.out / CHECKPOINT_FILE).exists():
            exists = f"{request.out / CHECKPOINT_FILE}: exists; {{}}, or choose another folder"
            raise InputError(exists.format("resume=True goes on"), exists.format("--resume goes on"))
        training = train(net, loss, setup.examples, setup.validation, request.settings, start, after_epoch)
        best = training.best_epoch
        if best is None or not math.isfinite(best.error):
            raise InputError(f"{request.out}: the training diverged; try a smaller learning rate")
        card = _card(setup, data, net.cpu().requires_grad_(False), key, training)
        save_net(request.out, net, card)
    return card


def _card(setup: TrainingSetup, data: Fieldset, net: UNet, key: TrainingKey, training: Training) -> ModelCard:
    best = training.best_epoch
    assert best is not None
    splits = {split: data.count(split) for split in ("train", "validation", "test")}
    return ModelCard(
        kind=setup.kind,
        shape=net.shape,
        sha256=hashlib.sha256(weights_bytes(net)).hexdigest(),
        valid=setup.valid,
        data={
            **{f"{split} textures": count for split, count in splits.items()},
            **setup.data,
            "corpus seed": data.request.seed,
            "dataset.json sha256": key.data,
        },
        training={
            **{name: value for name, value in asdict(key.settings).items() if value is not None},
            "epochs done": training.epochs[-1].number,
            "best epoch": best.number,
            "best validation error": best.error,
            "seconds": training.epochs[-1].seconds,
            "ended": training.ended(key.settings) or "",
        },
        errors=setup.measure(net),
        versions={"reference": setup.reference} | {name: version(name) for name in PACKAGES},
        sample=card_samples(data.request.samples, partial(setup.figures, net)),
    )


def _curves_page(kind: str, epochs: Sequence[Epoch]) -> bytes:
    """Return the page, which needs no other file.

    Args:
        kind: Kind of the net.
        epochs: Points of the curves, at least one.
    """
    best, last = min(epochs, key=lambda epoch: epoch.error), epochs[-1]
    numbers = [float(epoch.number) for epoch in epochs]
    chart = line_chart(
        "Relative errors, added",
        [
            Series("training", numbers, [epoch.loss for epoch in epochs], "before"),
            Series("validation", numbers, [epoch.error for epoch in epochs], "after"),
        ],
        "epoch",
    )
    caption = (
        f"{last.number} epochs of {last.steps // last.number} steps in {last.seconds:.0f} s; "
        f"best validation {best.error:.4g} after epoch {best.number}."
    )
    return render_page(
        "curves.html.j2", pair={"title": f"Training of the {kind} net"}, chart=chart, caption=caption
    )
