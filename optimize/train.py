"""A net from a data set: trained, measured on textures that it has not seen, and written down."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import torch

import tactile
from optimize.curves import curves_page
from optimize.touch_accuracy import errors, felt
from optimize.touch_task import examples_of, reliefs_of, skin_of, touch_task
from surrogate import asked, corpus
from surrogate.errors import InputError
from surrogate.fieldset import Fieldset, open_fieldset
from surrogate.stored import write_whole
from surrogate.training import Epoch, Settings, Training, train
from surrogate.training_file import NAME, Begun, load_training, save_training
from surrogate.unet import Shape, UNet
from surrogate.weights import Card, Sample, save_net, weights_bytes
from tactile.hybrid import hybrid_operator
from tactile.model import TouchModel
from tactile.net import CHANNELS, GRADIENT_TOLERANCE, KIND, NetSolver, validity

PACKAGES = ("retouch", "torch", "numpy", "scipy", "scikit-image")
CURVES_PAGE = "curves.html"
TESTED = 400
"""Textures of the test split that a net is measured on; the first ones."""
TESTED_GRADIENTS = 64
"""Of them, those whose gradients are compared."""
SAMPLE_SEED, SAMPLES = 0, 4
"""Textures that a card tells figures of, without pictures."""
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


def train_touch(order: Order, tell: Callable[[Epoch], None] = lambda epoch: None) -> Card:
    """Train the touch net and write ``touch.safetensors``, ``touch.json`` and the curves into `order.out`.

    Interrupted, it leaves a checkpoint after every epoch; resumed, it ends at the same weights.

    Raises:
        InputError: the data set is no good, `out` holds another training, or there is none to resume.
    """
    data = open_fieldset(order.data)
    shape = Shape(CHANNELS, 1, order.widths, BLOCK)
    side = data.asked.samples
    if side % shape.multiple:
        raise InputError(f"{order.data}: samples: {side} is no multiple of {shape.multiple}")
    begun = Begun(KIND, shape, order.settings, _digest(order.data / asked.NAME))
    if not order.resume and (order.out / NAME).exists():
        raise InputError(f"{order.out / NAME}: a training lies here; go on with --resume, or choose another")
    start = load_training(order.out, begun) if order.resume else None
    skin = skin_of(data)
    task = touch_task(skin, side, data.asked.size_mm)
    examples, validation = (examples_of(data, split, task) for split in ("train", "validation"))
    torch.manual_seed(order.settings.seed)
    net = UNet(shape).to(order.device)

    def keep(training: Training) -> None:
        save_training(order.out, begun, training)
        write_whole(order.out / CURVES_PAGE, curves_page(KIND, training.epochs).encode())
        tell(training.epochs[-1])

    there = task.to(torch.device(order.device))
    training = train(net, there, examples, validation, order.settings, start, keep)
    best = training.best_epoch
    if best is None or not math.isfinite(best.error):
        raise InputError(f"{order.out}: the training went astray; try a smaller --learning-rate")
    card = _card(order, data, net.cpu().requires_grad_(False), begun, training)
    save_net(order.out, net, card)
    return card


def measure_touch_net(
    net: UNet, skin: tactile.Skin, data: Fieldset, tested: int, reference: Literal["fem", "layer"]
) -> dict[str, float]:
    """Errors of a net on the first textures of a data set's test split, which are pressed anew.

    Returns:
        By name; none where the split is empty.
    """
    reliefs, size = reliefs_of(data, "test", tested), data.asked.size_mm
    if not len(reliefs):
        return {}
    grads = min(TESTED_GRADIENTS, len(reliefs))
    truth = partial(tactile.press, size_mm=size, skin=skin, model=reference)
    model = _net_model(net, skin, reliefs.shape[-1], size)
    return errors(
        felt(model.press, reliefs, size, torch.float32, grads),
        felt(truth, reliefs, size, torch.float64, grads),
    )


def net_figures(net: UNet, skin: tactile.Skin, samples: int, size_mm: float) -> tuple[Sample, ...]:
    """What a net makes of some textures of the corpus."""
    model = _net_model(net, skin, samples, size_mm)
    figures = []
    for texture in corpus.recipes(SAMPLE_SEED, SAMPLES):
        relief = corpus.heights(texture, samples=samples)[None]
        found = felt(model.press, relief, size_mm, torch.float32, 0)
        told = {"roughness": float(found.roughness[0]), "contact_area_mm2": float(found.area[0])}
        figures.append(Sample(SAMPLE_SEED, texture.index, told))
    return tuple(figures)


def _net_model(net: UNet, skin: tactile.Skin, samples: int, size_mm: float) -> TouchModel:
    layer = tactile.touch_model(skin, samples, size_mm, torch.float32)
    solver = NetSolver(net, hybrid_operator(skin, samples, size_mm, torch.float32))
    return TouchModel(skin, layer.operator, layer.flat_strain, solver, GRADIENT_TOLERANCE)


def _card(order: Order, data: Fieldset, net: UNet, begun: Begun, training: Training) -> Card:
    skin, said, best = skin_of(data), data.asked, training.best_epoch
    assert best is not None
    splits = {split: data.count(split) for split in ("train", "validation", "test")}
    return Card(
        kind="touch",
        shape=net.shape,
        sha256=hashlib.sha256(weights_bytes(net)).hexdigest(),
        valid=validity(skin, said.samples, said.size_mm),
        data={
            **{f"{split} textures": count for split, count in splits.items()},
            "model of touch": said.touch,
            "corpus seed": said.seed,
            "young_modulus_mpa": skin.young_modulus_mpa,
            "force_n": skin.force_n,
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
        errors=measure_touch_net(net, skin, data, order.tested, order.reference),
        versions={"reference": order.reference} | {name: version(name) for name in PACKAGES},
        sample=net_figures(net, skin, said.samples, said.size_mm),
    )


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
