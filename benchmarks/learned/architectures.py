"""Which net for what: plausible ones, trained for the same few minutes on the same data, error against time.

    python -m benchmarks.learned.architectures DATA [--minutes M]
    python -m benchmarks.learned.architectures DATA --times

Touch: pressure corrected between solver steps (the package's way) by the U-Net on squares of 4 x 4 or 2 x 2
pixels, and by a Fourier neural operator (Li et al., ICLR 2021); the U-Net without what the first solver steps
tell; strain from heights alone, as in the paper. Sight: ambient light by the same nets, with and without
horizons; parallel light by a U-Net that is told the light's direction, beside shadow sweeps, which learn
nothing. DATA is a data set of `retouch dataset --touch fem --lights random`, without optimised textures.

Errors on the test split in percent, median / mean; milliseconds of the net alone, forward / with gradient by
its inputs, one thread. One run each: a look, not a contest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

import tactile
from benchmarks.learned.unseen_textures import milliseconds, spread
from benchmarks.shared.common import load, machine, parser_of, save, table
from relief.surface import Surface
from retouch.laboratory.training.fields import studio_material
from retouch.laboratory.training.look_loss import LookLoss
from retouch.laboratory.training.look_loss import examples_of as look_examples
from retouch.laboratory.training.look_setup import studio_sky
from retouch.laboratory.training.touch_accuracy import LEAST_ROUGHNESS
from retouch.laboratory.training.touch_loss import LEAST_STRAIN, TouchLoss, skin_of, touch_loss
from retouch.laboratory.training.touch_loss import examples_of as touch_examples
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset, open_fieldset
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Examples, TrainingSettings, train
from surrogate.nets.unet import NetShape, UNet
from tactile.contact import ContactState
from tactile.net import CHANNELS, inputs, pressure
from tactile.strain import smallest_eigenvalue
from visual.backend.user_settings import user_settings_kept
from visual.exact.face_shading import unshadowed
from visual.fast import ambient_net
from visual.fast.bsdf_table import ABOVE
from visual.fast.horizons import DIRECTIONS
from visual.fast.lit_picture import lit_picture, pooled_faces
from visual.fast.refinement import face_slopes, refined
from visual.fast.shadow_sweep import shadow_sweep
from visual.lights.parallel import ParallelLights

MINUTES, SEED = 3.0, 0
WIDTHS = (24, 48, 72, 96)
MODES, OPERATOR_WIDTH, OPERATOR_BLOCKS = 8, 48, 4
TIMED = 15


class FourierOperator(nn.Module):
    """Blocks of a product in Fourier space, for the lowest frequencies, beside one in every pixel."""

    def __init__(self, maps: int, block: int = 4, width: int = OPERATOR_WIDTH) -> None:
        super().__init__()
        self.block = block
        self.enter = nn.Conv2d(maps * block**2, width, 1)
        shape = (OPERATOR_BLOCKS, 2, width, width, MODES, MODES)
        self.weights = nn.ParameterList(
            nn.Parameter(torch.randn(*shape[1:], 2) / width) for _ in range(shape[0])
        )
        self.beside = nn.ModuleList(nn.Conv2d(width, width, 3, padding=1) for _ in range(OPERATOR_BLOCKS))
        self.leave = nn.Conv2d(width, block**2, 1)
        nn.init.zeros_(self.leave.weight)
        assert self.leave.bias is not None
        nn.init.zeros_(self.leave.bias)

    def forward(self, maps: Tensor) -> Tensor:
        x = self.enter(functional.pixel_unshuffle(maps, self.block))
        for weights, beside in zip(self.weights, self.beside, strict=True):
            x = x + functional.silu(_spectral(x, torch.view_as_complex(weights)) + beside(x))
        return functional.pixel_shuffle(self.leave(x), self.block)


def _spectral(x: Tensor, weights: Tensor) -> Tensor:
    """The product of the lowest frequencies with weights (2, channels, channels, modes, modes)."""
    spectrum = torch.fft.rfft2(x)
    out = torch.zeros_like(spectrum)
    for rows, weight in ((slice(None, MODES), weights[0]), (slice(-MODES, None), weights[1])):
        out[:, :, rows, :MODES] = torch.einsum("bixy,ioxy->boxy", spectrum[:, :, rows, :MODES], weight)
    return torch.fft.irfft2(out, s=x.shape[-2:])


class Without(nn.Module):
    """A net that some of its inputs are kept from."""

    def __init__(self, net: nn.Module, hidden: tuple[int, ...]) -> None:
        super().__init__()
        self.net, self.hidden = net, list(hidden)

    def forward(self, maps: Tensor) -> Tensor:
        seen = maps.clone()
        seen[:, self.hidden] = 0.0
        found: Tensor = self.net(seen)
        return found


@dataclass(frozen=True)
class PressureWay(TouchLoss):
    """The package's way, its error that of roughness after the net alone."""

    def strain(self, net: nn.Module, examples: Examples) -> Tensor:
        zero = torch.zeros(len(examples["heights"]))
        guess = ContactState(examples["guess_pressure"], examples["guess_gap"], zero, 0, zero > 0.0, zero)
        maps = inputs(self.operator, examples["heights"], guess, self.mean_pressure)
        found = pressure(net, maps, guess.pressure, self.mean_pressure)
        return smallest_eigenvalue(self.operator.strain(found)) - self.flat_strain


@dataclass(frozen=True)
class StrainWay(TouchLoss):
    """Strain from heights, as the paper's net makes it."""

    def strain(self, net: nn.Module, examples: Examples) -> Tensor:
        heights = examples["heights"]
        n = heights.shape[-1]
        away = ((torch.arange(n) + 0.5) * (2.0 / n) - 1.0).abs()
        maps = (heights - heights.mean((-2, -1), keepdim=True), away.expand_as(heights))
        return 0.1 * net(torch.stack((*maps, away[:, None].expand_as(heights)), 1))[:, 0]

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        strain, wanted = self.strain(net, examples), examples["strain"]
        size = wanted.abs().mean((-2, -1)).clamp_min(LEAST_STRAIN)
        rough = tactile.roughness(strain, self.operator.size_mm, "polar")
        return (strain - wanted).abs().mean((-2, -1)) / size + (rough / examples["roughness"] - 1.0).abs()


class WithoutHorizons(LookLoss):
    """Ambient light from heights and slopes alone."""

    def _difference(self, net: nn.Module, examples: Examples) -> Tensor:
        unoccluded, wanted = examples["unoccluded"], examples["ambient"]
        maps = ambient_net.inputs(examples["heights"], self.size_mm, unoccluded)
        maps[:, [0, *range(3, 3 + len(DIRECTIONS))]] = 0.0
        found = unoccluded * functional.softplus(net(maps)[:, 0] + ambient_net.NEUTRAL_OUTPUT)
        return (found - wanted) / wanted.mean((-2, -1), keepdim=True)


class LightTask(LookLoss):
    """A picture under one parallel light, its direction given: what unshadowed radiance is to be times."""

    def __call__(self, net: nn.Module, examples: Examples) -> Tensor:
        """In parts of what the picture would be without shadows: nearly black ones must not decide."""
        part = examples["picture"].mean((-2, -1)) / examples["bare"].mean((-2, -1))
        scaled = self._difference(net, examples) * part[:, None, None]
        return scaled.square().mean((-2, -1)).add(1e-8).sqrt().mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """As the loss, by which the best net is chosen."""
        part = examples["picture"].mean((-2, -1)) / examples["bare"].mean((-2, -1))
        return super().errors(net, examples) * part

    def _difference(self, net: nn.Module, examples: Examples) -> Tensor:
        heights, bare = examples["heights"], examples["bare"]
        toward = examples["toward"][:, :, None, None].expand(-1, -1, *heights.shape[-2:])
        maps = ambient_net.inputs(heights, self.size_mm, bare.clamp_min(1e-6))[:, 1:]
        # A sigmoid in its place ends where all is lit, and learns nothing from there.
        found = bare * (1.0 + net(torch.cat((maps, toward), 1))[:, 0])
        return (found - examples["picture"]) / examples["picture"].mean((-2, -1), keepdim=True)

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        return {
            name: transformed_vectors(values, symmetry) if name == "toward" else transformed(values, symmetry)
            for name, values in examples.items()
        }


@dataclass(frozen=True)
class Candidate:
    """A way to be tried.

    Attributes:
        kind: of examples: touch, look or light.
        maps: that the net takes.
        make: the net.
        task: what it is trained for.
        error: (examples,) of a net, in percent.
    """

    kind: str
    maps: int
    make: Callable[[], nn.Module]
    task: Any
    error: Callable[[nn.Module, Examples], Tensor]


def main() -> None:
    torch.set_num_threads(1)
    parser = parser_of(__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--minutes", type=float, default=MINUTES)
    parser.add_argument("--only", default="", metavar="TEXT", help="candidates whose name begins with it")
    parser.add_argument("--times", action="store_true", help="measure times only, on a quiet machine")
    asked = parser.parse_args()
    data = open_fieldset(asked.data)
    candidates = candidates_on(data)
    kinds: dict[str, dict[Split, Examples]] = {}
    for name, candidate in candidates.items():
        if not name.startswith(asked.only):
            continue
        if not asked.times:
            if candidate.kind not in kinds:
                kinds = {candidate.kind: examples(data, candidate.kind)}
            row = tried(candidate, kinds[candidate.kind], asked.minutes)
            keep(name, {"kind": candidate.kind, "minutes": asked.minutes, **row})
            print(name, row, flush=True)
        torch.manual_seed(SEED)
        keep(name, net_times(candidate.make(), candidate.maps, data.request.samples))
    print(as_text(load("architectures")["rows"]))


def candidates_on(data: Fieldset) -> dict[str, Candidate]:
    """Candidates by name, for a data set."""
    side, size = data.request.samples, data.request.size_mm
    task = touch_loss(skin_of(data), side, size)
    parts = (task.operator, task.flat_strain, task.mean_pressure, task.young_modulus_mpa)
    between, direct = PressureWay(*parts), StrainWay(*parts)
    look, blind, light = LookLoss(size), WithoutHorizons(size), LightTask(size)
    count = ambient_net.CHANNELS - 1 + 3

    def unet(maps: int, block: int = 4) -> Callable[[], nn.Module]:
        return lambda: UNet(NetShape(maps, 1, WIDTHS, block))

    def roughness(way: PressureWay | StrainWay) -> Callable[[nn.Module, Examples], Tensor]:
        return lambda net, some: _roughness_error(way.strain(net, some), some, size)

    def pixels(way: LookLoss) -> Callable[[nn.Module, Examples], Tensor]:
        return lambda net, some: 100.0 * LookLoss.errors(way, net, some)

    hidden = tuple(range(1, 4))
    return {
        "touch: U-Net, 4 x 4": Candidate("touch", CHANNELS, unet(CHANNELS), between, roughness(between)),
        "touch: U-Net, 2 x 2": Candidate("touch", CHANNELS, unet(CHANNELS, 2), between, roughness(between)),
        "touch: Fourier operator": Candidate(
            "touch", CHANNELS, lambda: FourierOperator(CHANNELS), between, roughness(between)
        ),
        "touch: U-Net, 4 x 4, heights only": Candidate(
            "touch", CHANNELS, lambda: Without(unet(CHANNELS)(), hidden), between, roughness(between)
        ),
        "touch: U-Net, 4 x 4, heights to strain": Candidate("touch", 3, unet(3), direct, roughness(direct)),
        "ambient: U-Net, 4 x 4": Candidate(
            "look", ambient_net.CHANNELS, unet(ambient_net.CHANNELS), look, pixels(look)
        ),
        "ambient: U-Net, 2 x 2": Candidate(
            "look", ambient_net.CHANNELS, unet(ambient_net.CHANNELS, 2), look, pixels(look)
        ),
        "ambient: Fourier operator": Candidate(
            "look", ambient_net.CHANNELS, lambda: FourierOperator(ambient_net.CHANNELS), look, pixels(look)
        ),
        "ambient: U-Net, 4 x 4, no horizons": Candidate(
            "look", ambient_net.CHANNELS, unet(ambient_net.CHANNELS), blind, pixels(blind)
        ),
        "light: U-Net, 4 x 4, told the direction": Candidate(
            "light", count, unet(count), light, pixels(light)
        ),
        "light: U-Net, 2 x 2, told the direction": Candidate(
            "light", count, unet(count, 2), light, pixels(light)
        ),
        "light: swept, no net": Candidate("light", count, nn.Identity, None, _sweep_error(size)),
    }


def examples(data: Fieldset, kind: str) -> dict[Split, Examples]:
    """Examples of every split."""
    splits: tuple[Split, ...] = ("train", "validation", "test")
    if kind == "touch":
        task = touch_loss(skin_of(data), data.request.samples, data.request.size_mm)
        return {split: touch_examples(data, split, task) for split in splits}
    if kind == "look":
        return {split: look_examples(data, split, studio_sky()) for split in splits}
    return {split: light_examples(data, split) for split in splits}


@user_settings_kept
def light_examples(data: Fieldset, split: Split) -> Examples:
    """Pictures under each texture's first light, and what they were without shadows."""
    parts: dict[str, list[Tensor]] = {"heights": [], "picture": [], "toward": [], "bare": [], "faces": []}
    bsdf = studio_material()
    for shard in data.shards:
        places = shard.places(split)
        if not len(places):
            continue
        heights, pictures, toward = (shard.read(name, places) for name in ("heights", "pictures", "toward"))
        for relief, picture, light in zip(heights, pictures[:, 0], toward[:, 0], strict=True):
            slope_x, slope_y = face_slopes(torch.as_tensor(relief).double(), data.request.size_mm)
            lights = ParallelLights(light[None], np.full((1, 3), np.pi))
            radiance = unshadowed(bsdf, slope_x.numpy().ravel(), slope_y.numpy().ravel(), lights, ABOVE)
            faces = torch.as_tensor(radiance[0]).view(slope_x.shape).float()
            parts["heights"].append(torch.as_tensor(relief))
            parts["picture"].append(torch.as_tensor(picture))
            parts["toward"].append(torch.as_tensor(light).float())
            parts["bare"].append(pooled_faces(None, faces))
            if split == "test":
                parts["faces"].append(faces)
    return {name: torch.stack(values) for name, values in parts.items() if values}


def tried(candidate: Candidate, sets: Mapping[Split, Examples], minutes: float) -> dict[str, Any]:
    """Train a candidate, and measure it on the test split."""
    torch.manual_seed(SEED)
    net = candidate.make()
    epochs = 0
    if candidate.task is not None:
        settings = TrainingSettings(seed=SEED, epochs=1000, minutes=minutes, warmup=20)
        done = train(net, candidate.task, sets["train"], sets["validation"], settings)
        epochs = len(done.epochs)
    net.requires_grad_(False)
    test = sets["test"]
    count = len(test["heights"])
    parts = [
        candidate.error(net, {name: values[i : i + 16] for name, values in test.items()})
        for i in range(0, count, 16)
    ]
    errors = torch.cat(parts).double().numpy()
    errors = errors[np.isfinite(errors)]
    size = sum(values.numel() for values in net.parameters())
    return {"error_percent": spread(errors), "epochs": epochs, "parameters": size}


def transformed_vectors(vectors: Tensor, symmetry: int) -> Tensor:
    """Apply a symmetry of the square to vectors.

    Args:
        vectors: (..., 3) with x to the right, y up in the maps, z out of them.
        symmetry: As for `transformed`.

    Returns:
        The transformed vectors.
    """
    x, y, z = vectors.unbind(-1)
    for _ in range(symmetry % 4):
        x, y = -y, x
    return torch.stack((-x if symmetry >= 4 else x, y, z), dim=-1)


def _roughness_error(strain: Tensor, some: Examples, size_mm: float) -> Tensor:
    """Percent; not a number for textures too smooth for it to mean anything."""
    found, wanted = tactile.roughness(strain, size_mm, "polar"), some["roughness"]
    return torch.where(wanted >= LEAST_ROUGHNESS, 100.0 * (found / wanted - 1.0).abs(), math.nan)


def _sweep_error(size_mm: float) -> Callable[[nn.Module, Examples], Tensor]:
    def error(_: nn.Module, some: Examples) -> Tensor:
        errors = []
        for relief, light, faces, picture in zip(
            *(some[name] for name in ("heights", "toward", "faces", "picture")), strict=True
        ):
            toward = light.double() / light.double().norm()
            x, y, z = (float(part) for part in toward)
            sweep = shadow_sweep(Surface((len(relief), len(relief)), size_mm), (x, y, z), relief.dtype)
            found = lit_picture(refined(relief), faces, sweep)
            errors.append(100.0 * (found - picture).abs().mean() / picture.mean())
        return torch.stack(errors)

    return error


def net_times(net: nn.Module, maps: int, side: int) -> dict[str, Any]:
    """Times of a net alone; None for a net that does nothing."""
    if isinstance(net, nn.Identity):
        return {"milliseconds": None}
    net.requires_grad_(False)
    seen = [torch.randn(1, maps, side, side)] * TIMED
    spent = milliseconds(net, lambda values: net(values).square().sum(), seen, torch.get_num_threads())
    return {"milliseconds": list(spent)}


def keep(name: str, row: Mapping[str, Any]) -> None:
    """Add to the results."""
    rows = load("architectures").get("rows", {})
    rows[name] = {**rows.get(name, {}), **row}
    save("architectures", {"rows": rows, "machine": machine()})


def as_text(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """The table."""
    lines = []
    for name, row in rows.items():
        error, times = row["error_percent"], row["milliseconds"]
        lines.append(
            [
                *(name, f"{error['median']:.2f} / {error['mean']:.2f}", row["epochs"] or None),
                row["parameters"] or None,
                None if times is None else f"{times[0]:.1f} / {times[1]:.1f}",
            ]
        )
    return table(("what", "error, %: median / mean", "epochs", "parameters", "ms"), lines)


if __name__ == "__main__":
    main()
