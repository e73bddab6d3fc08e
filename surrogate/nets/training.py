"""Training loop of every net: seeded, resumable after any epoch, with early stopping and curves.

What a net is trained for comes in as a `Loss`; this file knows neither touch nor sight. On the CPU the same
seed gives the same weights bit for bit, interrupted or not, unless a limit of time ends the training.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol

import numpy as np
import torch
from pydantic import ConfigDict, Field
from torch import Tensor, nn

from relief.ground.progress import stage, this_stage
from surrogate.nets.augmentation import SYMMETRIES

Examples = Mapping[str, Tensor]
"""Tensors by name; the first axis of each counts the examples."""

_ORDER, _SYMMETRY = range(2)
"""Streams of random numbers of an epoch: the order of the examples, and their symmetries."""


class Loss(Protocol):
    """Objective of a net."""

    def __call__(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return the loss of some examples, a differentiable scalar that training minimises."""

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return (examples,) errors, whose mean over the validation set decides which weights are best."""

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        """Return the examples after one of the eight symmetries of the square (`augmentation`)."""


@dataclass(frozen=True)
class TrainingSettings:
    """Settings of a training.

    Attributes:
        seed: Seed of the order of the examples and of their symmetries, and of the caller's initial weights.
        epochs: Most passes over the examples.
        minutes: Most minutes of training, None for no limit; the learning rate falls with whichever limit is
            nearer. With a limit of time the result depends on the machine's speed.
        batch: Examples of a step.
        learning_rate: Highest learning rate, reached after `warmup` steps; afterwards it falls along a cosine
            (Loshchilov and Hutter, ICLR 2017).
        warmup: Steps in which the learning rate rises.
        last_rate: Last learning rate, in parts of the highest.
        weight_decay: Weight decay of AdamW.
        largest_gradient: Largest norm of a gradient; longer ones are clipped.
        patience: Epochs without a better validation error after which training ends.
    """

    seed: Annotated[int, Field(ge=0)] = 0
    epochs: Annotated[int, Field(ge=1)] = 60
    minutes: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    batch: Annotated[int, Field(ge=1)] = 16
    learning_rate: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 2e-3
    warmup: Annotated[int, Field(ge=0)] = 50
    last_rate: Annotated[float, Field(ge=0, le=1)] = 0.01
    weight_decay: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 1e-4
    largest_gradient: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0
    patience: Annotated[int, Field(ge=1)] = 15

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    def rate(self, step: int, part: float) -> float:
        """Return the learning rate of a step, when a part (0 to 1) of the training is over."""
        falling = self.last_rate + (1.0 - self.last_rate) * 0.5 * (1.0 + math.cos(math.pi * min(part, 1.0)))
        return self.learning_rate * falling * min(1.0, (step + 1) / max(1, self.warmup))


@dataclass(frozen=True)
class Epoch:
    """Point of the training curves.

    Attributes:
        number: Number of the epoch, from 1.
        steps: Steps since the beginning.
        loss: Mean loss of the training examples.
        error: Mean error of the validation examples.
        learning_rate: Learning rate of the last step.
        seconds: Seconds since the beginning.
    """

    number: Annotated[int, Field(ge=1)]
    steps: Annotated[int, Field(ge=1)]
    loss: float
    error: float
    learning_rate: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    seconds: Annotated[float, Field(ge=0, allow_inf_nan=False)]


@dataclass(frozen=True)
class Training:
    """State of a training after an epoch; all tensors are on the CPU.

    Attributes:
        weights: Current weights.
        best: Weights after the epoch with the smallest validation error.
        first: First moments of AdamW, by the names of the weights.
        second: Second moments of AdamW.
        epochs: Completed epochs.
    """

    weights: Mapping[str, Tensor]
    best: Mapping[str, Tensor]
    first: Mapping[str, Tensor]
    second: Mapping[str, Tensor]
    epochs: tuple[Epoch, ...] = ()

    @property
    def best_epoch(self) -> Epoch | None:
        """The epoch with the smallest validation error, the earliest of several; None before the first."""
        return min(self.epochs, key=lambda epoch: epoch.error, default=None)

    def ended(self, settings: TrainingSettings) -> str | None:
        """Return why the training is over, in words for a person, or None while it is not."""
        best = self.best_epoch
        if best is None:
            return None
        last = self.epochs[-1]
        if not math.isfinite(last.error):
            return "a value is not finite"
        if last.number - best.number >= settings.patience:
            return f"{settings.patience} epochs brought no better validation"
        if last.number >= settings.epochs:
            return f"all of {settings.epochs} epochs are done"
        if settings.minutes is not None and last.seconds >= 60.0 * settings.minutes:
            return f"{settings.minutes:g} minutes are over"
        return None


def beginning(net: nn.Module) -> Training:
    """Return the state of a training before its first epoch."""
    weights = _copies(net.state_dict())
    zeros = {name: torch.zeros_like(values) for name, values in weights.items()}
    return Training(weights, weights, zeros, zeros)


def train(
    net: nn.Module,
    loss: Loss,
    examples: Examples,
    validation: Examples,
    settings: TrainingSettings,
    start: Training | None = None,
    observer: Callable[[Training], None] = lambda training: None,
) -> Training:
    """Train a net on its own device (CPU or CUDA).

    Args:
        net: The net, which ends with the best weights.
        loss: What the net is trained for.
        examples: Training examples, on the CPU; batches are moved to the net's device.
        validation: Validation examples, on the CPU.
        settings: Settings of the training.
        start: State to resume from; by default the beginning. The same settings give the same result as
            without the interruption, unless a limit of time ends the training.
        observer: Called after every epoch.

    Returns:
        The last state.

    Raises:
        ValueError: There are no examples for training, or none for validation.
    """
    if not _count(examples) or not _count(validation):
        raise ValueError("there is nothing to train on, or nothing to validate by")
    training = beginning(net) if start is None else start
    net.load_state_dict(dict(training.weights))
    optimiser = _optimiser(net, training, settings, _steps(examples, settings))
    left = (settings.epochs - len(training.epochs)) * _steps(examples, settings)
    with stage("training", left, at_most=True):
        while training.ended(settings) is None:
            training = _one_epoch(net, loss, examples, validation, settings, optimiser, training)
            observer(training)
    net.load_state_dict(dict(training.best))
    net.eval()
    return training


def errors(net: nn.Module, loss: Loss, examples: Examples, batch: int = 16) -> Tensor:
    """Return (examples,) errors of a net, on the CPU.

    Args:
        net: The net.
        loss: What the net is trained for.
        examples: Examples, on the CPU.
        batch: Examples at a time.
    """
    net.eval()
    with torch.no_grad():
        return torch.cat([loss.errors(net, part).cpu() for part in _in_order(examples, batch, _device(net))])


def _one_epoch(
    net: nn.Module,
    loss: Loss,
    examples: Examples,
    validation: Examples,
    settings: TrainingSettings,
    optimiser: torch.optim.AdamW,
    before: Training,
) -> Training:
    began = time.monotonic()
    number = len(before.epochs)
    earlier = before.epochs[-1].seconds if before.epochs else 0.0
    steps, rate, losses = number * _steps(examples, settings), 0.0, []
    net.train()
    for batch, symmetry in _shuffled(examples, settings, number, _device(net)):
        part = steps / (settings.epochs * _steps(examples, settings))
        if settings.minutes is not None:
            part = max(part, (earlier + time.monotonic() - began) / (60.0 * settings.minutes))
        rate = settings.rate(steps, part)
        for group in optimiser.param_groups:
            group["lr"] = rate
        optimiser.zero_grad()
        value = loss(net, loss.transformed(batch, symmetry))
        torch.autograd.backward(value)
        nn.utils.clip_grad_norm_(net.parameters(), settings.largest_gradient)
        optimiser.step()
        losses.append(value.detach())
        steps += 1
        this_stage()()
        if settings.minutes is not None and part >= 1.0:
            break
    error = float(errors(net, loss, validation, settings.batch).double().mean())
    mean_loss = float(torch.stack(losses).double().mean())
    weights = _copies(net.state_dict())
    best = before.best_epoch
    return Training(
        weights,
        weights if best is None or error < best.error else before.best,
        {name: _copy(optimiser.state[values]["exp_avg"]) for name, values in net.named_parameters()},
        {name: _copy(optimiser.state[values]["exp_avg_sq"]) for name, values in net.named_parameters()},
        (
            *before.epochs,
            Epoch(number + 1, steps, mean_loss, error, rate, earlier + time.monotonic() - began),
        ),
    )


def _optimiser(
    net: nn.Module, training: Training, settings: TrainingSettings, steps_of_epoch: int
) -> torch.optim.AdamW:
    optimiser = torch.optim.AdamW(
        net.parameters(), settings.learning_rate, weight_decay=settings.weight_decay
    )
    if training.epochs:
        for name, values in net.named_parameters():
            optimiser.state[values] = {
                "step": torch.tensor(float(len(training.epochs) * steps_of_epoch)),
                "exp_avg": training.first[name].to(values, copy=True),
                "exp_avg_sq": training.second[name].to(values, copy=True),
            }
    return optimiser


def _shuffled(
    examples: Examples, settings: TrainingSettings, epoch: int, device: torch.device
) -> Iterator[tuple[Examples, int]]:
    """Yield the batches of an epoch, each with its symmetry; they depend on seed and epoch alone."""
    order = np.random.default_rng((settings.seed, epoch, _ORDER)).permutation(_count(examples))
    symmetries = np.random.default_rng((settings.seed, epoch, _SYMMETRY))
    for first in range(0, len(order), settings.batch):
        places = torch.from_numpy(order[first : first + settings.batch])
        batch = {name: values[places].to(device) for name, values in examples.items()}
        yield batch, int(symmetries.integers(SYMMETRIES))


def _in_order(examples: Examples, batch: int, device: torch.device) -> Iterator[Examples]:
    for first in range(0, _count(examples), batch):
        yield {name: values[first : first + batch].to(device) for name, values in examples.items()}


def _steps(examples: Examples, settings: TrainingSettings) -> int:
    return math.ceil(_count(examples) / settings.batch)


def _count(examples: Examples) -> int:
    return min((len(values) for values in examples.values()), default=0)


def _device(net: nn.Module) -> torch.device:
    return next(net.parameters()).device


def _copies(values: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name: _copy(value) for name, value in values.items()}


def _copy(values: Tensor) -> Tensor:
    return values.detach().to("cpu", copy=True)
