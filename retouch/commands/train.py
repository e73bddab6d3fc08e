"""`retouch train`: train the learned models on a data set.

Trains a net on a data set of `retouch dataset`, stops when the validation error no longer falls, and measures
the net on textures of the test split: touch, the contact of the skin, against finite elements; look, ambient
light, against horizons. DIR gets the weights, the card with the net's training data and errors, and the
training curves. There is a checkpoint after every epoch: with --resume the same command continues from the
checkpoint and ends at the same weights.

examples:
  retouch dataset -o data --count 6300 --lights none
  retouch train touch --data data -o nets/touch
  retouch train touch --data data -o nets/touch --resume
  retouch train look --data data -o nets/look        (a data set with pictures)

The guide's page "Surrogates" describes the nets and their errors.
"""

import argparse
from pathlib import Path

import retouch
from retouch.commands.options import add, add_out, add_talk, keywords, report, seed, whole_number

MOST_EPOCHS = 100_000


AFTER_INTERRUPT = "; the same command with --resume goes on"
"""End of the line that an interrupt prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add(parser, "net", "which net", choices=("touch", "look"))
    add(parser, "--data FOLDER", "folder of a data set of `retouch dataset`", type=Path, required=True)
    add_out(parser, "DIR", "results folder", required=True)
    add(parser, "--resume", "continue from the checkpoint in DIR")
    add(parser, "--seed S", "random seed (default: 0)", type=seed, default=0)
    text = "most passes over the textures (default: 60)"
    add(parser, "--epochs N", text, type=whole_number(1, MOST_EPOCHS))
    add(parser, "--minutes M", "most minutes of training (default: no limit)", type=_positive)
    add(parser, "--batch N", "textures of a training step (default: 16)", type=whole_number(1, 4096))
    add(parser, "--learning-rate R", "highest rate (default: 0.002)", type=_positive)
    text = "channels of the net's levels, finest first (default: 24,48,72,96)"
    add(parser, "--widths A,B,...", text, type=_widths)
    add(parser, "--device", "where to train (default: cuda if there is one)", choices=("cpu", "cuda"))
    add_talk(parser, "the card of the net")


def run(arguments: argparse.Namespace) -> int:
    trained = retouch.train(**keywords(arguments, retouch.train))
    errors = [f"  {name.replace('_', ' ')}: {value:.4g}" for name, value in trained.card.errors.items()]
    ended = f"{trained.folder}: {trained.card.training['ended']}"
    return report(arguments, trained.as_json(), [ended, *errors])


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return value


def _widths(text: str) -> tuple[int, ...]:
    from surrogate.nets.unet import MOST_LEVELS, MOST_WIDTH

    parts = text.split(",")
    if len(parts) > MOST_LEVELS:
        raise argparse.ArgumentTypeError(f"{text!r}: more than {MOST_LEVELS} levels")
    return tuple(whole_number(1, MOST_WIDTH)(part) for part in parts)
