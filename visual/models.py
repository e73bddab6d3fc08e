"""Models of pictures: the names by which a descent chooses what its pictures come from."""

from __future__ import annotations

import warnings
from typing import Literal, get_args

from relief.errors import InputError

LookModel = Literal["exact", "fast"]
FORMER_NAME = "net"
"""Name of "fast" until version 0.2, which will refuse it: only its ambient light comes from a net."""


def look_model(name: str) -> LookModel:
    """The model of pictures of this name; its former name gives a `FutureWarning`.

    Raises:
        InputError: there is no such model.
    """
    if name == FORMER_NAME:
        warnings.warn('look.model: "net" is called "fast" now', FutureWarning, stacklevel=3)
        return "fast"
    for model in get_args(LookModel):
        if name == model:
            return model
    raise InputError(f'look.model: "{name}" is not one of {", ".join(get_args(LookModel))}')
