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
from optimize.training.setup import Kind, Lesson
from relief.errors import InputError
from relief.files import write_atomically
from surrogate.data import request as asked
from surrogate.data.field_set import Fieldset, open_fieldset
from surrogate.nets.checkpoint import NAME, Begun, load_training, save_training
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
class Order:
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


def train_net(kind: Kind, order: Order, tell: Callable[[Epoch], None] = lambda epoch: None) -> Card:
    """Train a net and write ``KIND.safetensors``, ``KIND.json`` and the curves into `order.out`.

    Interrupted, it leaves a checkpoint after every epoch; resumed, it ends at the same weights.

    Raises:
        InputError: the data set is no good, `out` holds another training, or there is none to resume.
    """
    data = open_fieldset(order.data)
    lesson = _lesson(kind, data, order)
    shape = Shape(lesson.inputs, 1, order.widths, BLOCK)
    side = data.asked.samples
    if side % shape.multiple:
        raise InputError(f"{order.data}: samples: {side} is no multiple of {shape.multiple}")
    begun = Begun(kind, shape, order.settings, _digest(order.data / asked.NAME))
    if not order.resume and (order.out / NAME).exists():
        raise InputError(f"{order.out / NAME}: a training lies here; go on with --resume, or choose another")
    start = load_training(order.out, begun) if order.resume else None
    torch.manual_seed(order.settings.seed)
    net = UNet(shape).to(order.device)

    def keep(training: Training) -> None:
        save_training(order.out, begun, training)
        write_atomically(order.out / CURVES_PAGE, curves_page(kind, training.epochs).encode())
        tell(training.epochs[-1])

    there = lesson.task.to(torch.device(order.device))
    training = train(net, there, lesson.examples, lesson.validation, order.settings, start, keep)
    best = training.best_epoch
    if best is None or not math.isfinite(best.error):
        raise InputError(f"{order.out}: the training went astray; try a smaller --learning-rate")
    card = _card(order, lesson, data, net.cpu().requires_grad_(False), begun, training)
    save_net(order.out, net, card)
    return card


def _lesson(kind: Kind, data: Fieldset, order: Order) -> Lesson:
    if kind == "touch":
        from optimize.training.touch_setup import touch_lesson

        return touch_lesson(data, order.tested, order.reference)
    from optimize.training.look_setup import look_lesson

    return look_lesson(data, order.tested)


def _card(order: Order, lesson: Lesson, data: Fieldset, net: UNet, begun: Begun, training: Training) -> Card:
    best = training.best_epoch
    assert best is not None
    splits = {split: data.count(split) for split in ("train", "validation", "test")}
    return Card(
        kind=lesson.kind,
        shape=net.shape,
        sha256=hashlib.sha256(weights_bytes(net)).hexdigest(),
        valid=lesson.valid,
        data={
            **{f"{split} textures": count for split, count in splits.items()},
            **lesson.data,
            "corpus seed": data.asked.seed,
            "dataset.json sha256": begun.data,
        },
        training={
            **{name: value for name, value in asdict(order.settings).items() if value is not None},
            "epochs done": training.epochs[-1].number,
            "best epoch": best.number,
            "best validation error": best.error,
            "seconds": training.epochs[-1].seconds,
            "ended": training.ended(order.settings) or "",
        },
        errors=lesson.measure(net),
        versions={"reference": lesson.reference} | {name: version(name) for name in PACKAGES},
        sample=lesson.figures(net),
    )


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
