"""Training makes errors smaller, the same way every time, and goes on where it was."""

import itertools
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn
from torch.nn import functional

from relief.ground.errors import InputError
from relief.ground.tensors import Arrays, read_tensors, tensor_bytes
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Epoch, Examples, Training, TrainingSettings, beginning, errors, train
from surrogate.nets.training_checkpoint import (
    CHECKPOINT_FILE,
    CURVES,
    TrainingKey,
    load_training,
    save_training,
)
from surrogate.nets.unet import NetShape, UNet

SHAPE = NetShape(1, 1, (4, 6))
SETTINGS = TrainingSettings(seed=3, epochs=4, batch=4, learning_rate=1e-2, warmup=2)
KEY = TrainingKey("touch", SHAPE, SETTINGS, "0" * 64)


class Blur:
    """The net is to blur what it is shown."""

    def __call__(self, net: nn.Module, examples: Examples) -> Tensor:
        return self.errors(net, examples).mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        field = examples["field"]
        wanted = functional.avg_pool2d(field, 3, stride=1, padding=1, count_include_pad=False)
        return (net(field) - wanted).square().mean((1, 2, 3))

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        return {name: transformed(values, symmetry) for name, values in examples.items()}


def fields(count: int, seed: int) -> dict[str, Tensor]:
    return {"field": torch.randn(count, 1, 8, 8, generator=torch.Generator().manual_seed(seed))}


EXAMPLES, VALIDATION = fields(18, 0), fields(6, 1)


def new_net() -> UNet:
    torch.manual_seed(SETTINGS.seed)
    return UNet(SHAPE)


def trained(settings: TrainingSettings = SETTINGS) -> tuple[UNet, Training]:
    net = new_net()
    return net, train(net, Blur(), EXAMPLES, VALIDATION, settings)


def alike(one: Training, other: Training) -> bool:
    parts = ("weights", "best", "first", "second")
    pairs = [(getattr(one, part), getattr(other, part)) for part in parts]
    timeless = [[replace(epoch, seconds=0.0) for epoch in training.epochs] for training in (one, other)]
    return timeless[0] == timeless[1] and all(torch.equal(a[name], b[name]) for a, b in pairs for name in a)


@pytest.mark.slow
def test_errors_fall_below_a_third_of_what_they_were() -> None:
    before = errors(new_net(), Blur(), VALIDATION).mean()
    net, training = trained(replace(SETTINGS, epochs=30))
    after = errors(net, Blur(), VALIDATION).mean()
    assert after < before / 3
    assert training.best_epoch is not None and float(after) == pytest.approx(training.best_epoch.error)
    assert training.epochs[-1].loss < training.epochs[0].loss / 3


@pytest.mark.slow
def test_the_same_seed_gives_the_same_weights_bit_for_bit_and_another_does_not() -> None:
    assert alike(trained()[1], trained()[1])
    assert not alike(trained()[1], trained(replace(SETTINGS, seed=4))[1])


@pytest.mark.parametrize("epoch", [1, 2, 3])
def test_a_training_that_was_interrupted_ends_at_the_same_weights_bit_for_bit(
    tmp_path: Path, epoch: int
) -> None:
    def keep(training: Training) -> None:
        save_training(tmp_path, KEY, training)
        if len(training.epochs) == epoch:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(new_net(), Blur(), EXAMPLES, VALIDATION, SETTINGS, observer=keep)
    start = load_training(tmp_path, KEY)
    assert len(start.epochs) == epoch
    torch.manual_seed(99)
    resumed = train(UNet(SHAPE), Blur(), EXAMPLES, VALIDATION, SETTINGS, start)
    assert alike(resumed, trained()[1])


def test_the_best_weights_are_kept_not_the_last() -> None:
    """A rate at which nothing is learnt for long."""
    net, training = trained(replace(SETTINGS, learning_rate=0.3, epochs=8, last_rate=1.0))
    best = training.best_epoch
    assert best is not None and best.error == min(epoch.error for epoch in training.epochs)
    assert float(errors(net, Blur(), VALIDATION).double().mean()) == pytest.approx(best.error, rel=1e-6)


def test_a_training_ends_for_a_reason() -> None:
    def at(*found: float) -> Training:
        epochs = tuple(Epoch(k + 1, k, 0.0, error, 0.0, 30.0 * (k + 1)) for k, error in enumerate(found))
        return replace(beginning(new_net()), epochs=epochs)

    limits = TrainingSettings(epochs=5, patience=2, minutes=2.0)
    assert at().ended(limits) is None and at(2.0, 1.0, 1.5).ended(limits) is None
    assert "no better validation" in str(at(1.0, 2.0, 3.0).ended(limits))
    assert "minutes are over" in str(at(4.0, 3.0, 2.0, 1.0).ended(limits))
    assert "epochs are done" in str(at(5.0, 4.0, 3.0, 2.0, 1.0).ended(replace(limits, minutes=None)))
    assert "not finite" in str(at(1.0, float("nan")).ended(limits))


def test_the_rate_rises_and_then_falls_along_a_cosine() -> None:
    rates = [SETTINGS.rate(step, step / 20) for step in range(21)]
    assert rates[0] == pytest.approx(0.5 * SETTINGS.learning_rate, rel=0.01)
    assert all(later < earlier for earlier, later in itertools.pairwise(rates[2:]))
    assert rates[-1] == pytest.approx(SETTINGS.last_rate * SETTINGS.learning_rate)
    assert SETTINGS.rate(10, 0.5) == pytest.approx(0.505 * SETTINGS.learning_rate)


def test_without_examples_there_is_nothing_to_train() -> None:
    for examples, validation in ((fields(0, 0), VALIDATION), (EXAMPLES, {})):
        with pytest.raises(ValueError, match="nothing"):
            train(new_net(), Blur(), examples, validation, SETTINGS)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    train(
        new_net(),
        Blur(),
        EXAMPLES,
        VALIDATION,
        replace(SETTINGS, epochs=2),
        observer=lambda t: save_training(tmp_path, KEY, t),
    )
    return tmp_path


def test_curves_have_a_line_an_epoch(kept: Path) -> None:
    lines = [json.loads(line) for line in (kept / CURVES).read_text(encoding="utf-8").splitlines()]
    assert [line["number"] for line in lines] == [1, 2]
    assert lines[0].keys() == {"number", "steps", "loss", "error", "learning_rate", "seconds"}


OTHERS = {
    "data": replace(KEY, data="1" * 64),
    "settings.seed": replace(KEY, settings=replace(SETTINGS, seed=4)),
    "shape.widths": replace(KEY, shape=NetShape(1, 1, (4, 7))),
    "kind": replace(KEY, kind="look"),
}


@pytest.mark.parametrize("field", OTHERS)
def test_another_training_does_not_go_on(kept: Path, field: str) -> None:
    with pytest.raises(InputError, match=rf"{CHECKPOINT_FILE}: {field}: begun with"):
        load_training(kept, OTHERS[field])


def test_a_damaged_checkpoint_is_refused(kept: Path) -> None:
    path = kept / CHECKPOINT_FILE
    whole = path.read_bytes()
    for content in (b"", b"x" * 100, whole[:-8]):
        path.write_bytes(content)
        with pytest.raises(InputError, match=CHECKPOINT_FILE):
            load_training(kept, KEY)
    path.write_bytes(whole)
    for place in range(0, len(whole), 499):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :])
        with pytest.raises(InputError, match="damaged"):
            load_training(kept, KEY)
    path.unlink()
    with pytest.raises(InputError, match="nothing to go on from"):
        load_training(kept, KEY)


FORGERIES: dict[str, tuple[Callable[[Arrays, dict[str, Any]], object], str]] = {
    "a weight of no number": (lambda a, _: a["weights.leave.bias"].fill(np.nan), "weights.leave.bias"),
    "a mean of squares below zero": (lambda a, _: a["second.leave.bias"].fill(-1.0), "second.leave.bias"),
    "another shape": (lambda a, _: a.update({"best.leave.bias": np.zeros(3, np.float32)}), "best.leave.bias"),
    "another type": (lambda a, _: a.update({"best.leave.bias": np.zeros(1)}), "best.leave.bias"),
    "a tensor too few": (lambda a, _: a.pop("first.leave.bias"), "first.leave.bias"),
    "a tensor too many": (lambda a, _: a.update({"third": np.zeros(1, np.float32)}), "third"),
    "less than no time": (lambda _, h: h["epochs"][0].update(seconds=-1.0), "epochs.0.seconds"),
    "a missing epoch": (lambda _, h: h["epochs"].pop(0), "epochs"),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_numbers_out_of_range_are_refused_by_their_name(kept: Path, forgery: str) -> None:
    change, named = FORGERIES[forgery]
    arrays, text = read_tensors(kept / CHECKPOINT_FILE)
    arrays, header = {name: array.copy() for name, array in arrays.items()}, json.loads(text)
    change(arrays, header)
    (kept / CHECKPOINT_FILE).write_bytes(tensor_bytes(arrays, json.dumps(header)))
    with pytest.raises(InputError, match=rf"{CHECKPOINT_FILE}: (training: )?{named}"):
        load_training(kept, KEY)
