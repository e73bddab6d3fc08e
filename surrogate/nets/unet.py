"""U-Net, compact: maps of a relief in, maps of the same size out.

Residual blocks with pre-activation (He et al., ECCV 2016) stand in the arrangement of Ronneberger et al.
(MICCAI 2015). The net works on blocks of pixels rather than pixels (`NetShape.block`), which costs a quarter.
Padding is with zeros, and channels lie innermost, because both are quickest on a CPU; a net that must know
where the plate ends needs inputs that say so.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

import torch
from pydantic import ConfigDict, Field
from torch import Tensor, nn
from torch.nn import functional

MOST_CHANNELS, MOST_WIDTH, MOST_LEVELS = 64, 512, 6
"""Limits of a net that is read from a file, so that a hostile file cannot fill the memory."""


@dataclass(frozen=True)
class NetShape:
    """Shape of a net: everything that decides its parameters except their values.

    Attributes:
        inputs: Number of input maps.
        outputs: Number of output maps.
        widths: Channels of each level, finest first; each level has half the resolution of the one before.
        block: Side, in pixels, of the squares that the finest level works on.
    """

    inputs: Annotated[int, Field(ge=1, le=MOST_CHANNELS)]
    outputs: Annotated[int, Field(ge=1, le=MOST_CHANNELS)]
    widths: Annotated[
        tuple[Annotated[int, Field(ge=1, le=MOST_WIDTH)], ...], Field(min_length=1, max_length=MOST_LEVELS)
    ] = (16, 32, 48, 64)
    block: Annotated[int, Field(ge=1, le=4)] = 2

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    @property
    def multiple(self) -> int:
        """Number that must divide the side of a map."""
        return int(self.block * 2 ** (len(self.widths) - 1))


class UNet(nn.Module):
    """U-Net from (batch, inputs, n, n) to (batch, outputs, n, n); n is a multiple of ``shape.multiple``.

    The last layer begins at zero: an untrained net adds nothing to the caller's first approximation.
    """

    def __init__(self, shape: NetShape) -> None:
        super().__init__()
        self.shape = shape
        widths, pixels = shape.widths, shape.block**2
        self.enter = nn.Conv2d(pixels * shape.inputs, widths[0], 1)
        self.first = Residual(widths[0], widths[0])
        steps = list(pairwise(widths))
        self.down = nn.ModuleList(Residual(fine, coarse) for fine, coarse in steps)
        self.up = nn.ModuleList(Residual(coarse + fine, fine) for fine, coarse in steps)
        self.leave = _convolution(widths[0], pixels * shape.outputs)
        nn.init.zeros_(self.leave.weight)
        if self.leave.bias is not None:
            nn.init.zeros_(self.leave.bias)

    def forward(self, maps: Tensor) -> Tensor:
        if maps.shape[-1] % self.shape.multiple or maps.shape[-2] % self.shape.multiple:
            raise ValueError(f"maps of {tuple(maps.shape[-2:])} are no multiple of {self.shape.multiple}")
        x = self.first(self.enter(_blocks(maps, self.shape.block)))
        skips = []
        for block in self.down:
            skips.append(x)
            x = block(functional.avg_pool2d(x, 2))
        for block in reversed(self.up):
            wide = functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)
            x = block(torch.cat((wide, skips.pop()), dim=1))
        return functional.pixel_shuffle(self.leave(functional.silu(x)), self.shape.block).contiguous()


def _blocks(maps: Tensor, side: int) -> Tensor:
    """Do what `torch.nn.functional.pixel_unshuffle` does, in a third of its time, channels innermost."""
    batch, count, rows, cols = maps.shape
    apart = maps.reshape(batch, count, rows // side, side, cols // side, side).permute(0, 1, 3, 5, 2, 4)
    blocks = apart.reshape(batch, count * side * side, rows // side, cols // side)
    return blocks.contiguous(memory_format=torch.channels_last)


class Residual(nn.Module):
    """Two convolutions beside a shortcut."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.one = _convolution(inputs, outputs)
        self.two = _convolution(outputs, outputs)
        self.shortcut = nn.Conv2d(inputs, outputs, 1) if inputs != outputs else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        inner: Tensor = self.two(functional.silu(self.one(functional.silu(x))))
        shortcut: Tensor = self.shortcut(x)
        return shortcut + inner


def _convolution(inputs: int, outputs: int) -> nn.Conv2d:
    return nn.Conv2d(inputs, outputs, 3, padding=1)
