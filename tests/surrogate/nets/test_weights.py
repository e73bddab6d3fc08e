"""Weights are read as they were written, and nothing else is."""

import hashlib
import json
import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file, save_file

from relief.ground.errors import InputError
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import (
    FOLDER,
    LARGEST_CARD,
    ModelCard,
    Sample,
    load_net,
    read_card,
    save_net,
    weights_bytes,
    weights_path,
)

ROOT = Path(__file__).resolve().parents[3]
SHAPE = NetShape(2, 1, (3, 4))


@pytest.fixture
def net() -> UNet:
    net = UNet(SHAPE)
    torch.nn.init.normal_(net.leave.weight)
    return net


def card_of(net: UNet) -> ModelCard:
    return ModelCard(
        kind="touch",
        shape=net.shape,
        sha256=hashlib.sha256(weights_bytes(net)).hexdigest(),
        valid={"samples": 16.0},
        data={"model of touch": "fem", "corpus seed": 3},
        training={"seed": 0},
        errors={"roughness_median_percent": 1.5},
        versions={"torch": torch.__version__},
        sample=(Sample(0, 1, {"roughness": 0.05}),),
    )


@pytest.fixture
def folder(tmp_path: Path, net: UNet) -> Path:
    save_net(tmp_path, net, card_of(net))
    return tmp_path


def test_a_net_is_read_as_it_was_written(folder: Path, net: UNet) -> None:
    found, card = load_net("touch", folder)
    assert card == card_of(net)
    maps = torch.randn(1, 2, 8, 8)
    assert torch.equal(found(maps), net(maps))
    assert not any(values.requires_grad for values in found.parameters()) and not found.training


def test_the_same_net_is_the_same_file(folder: Path, net: UNet) -> None:
    assert weights_path("touch", folder).read_bytes() == weights_bytes(net)


def test_a_card_of_other_weights_is_not_written(tmp_path: Path, net: UNet) -> None:
    with pytest.raises(ValueError, match="does not belong"):
        save_net(tmp_path, net, replace(card_of(net), sha256="0" * 64))
    assert not list(tmp_path.iterdir())


def test_a_net_that_is_not_there_says_how_it_is_made(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"look\.json: no such file.*retouch train look"):
        load_net("look", tmp_path)


def complaint(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_net("touch", folder)
    message = str(caught.value)
    assert message.startswith(str(folder)) and "\n" not in message
    return message


def respell(folder: Path, **changes: Any) -> None:
    path = weights_path("touch", folder).with_suffix(".json")
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | changes), encoding="utf-8")


CARDS: dict[str, tuple[dict[str, Any], str]] = {
    "another kind": ({"kind": "look"}, "kind"),
    "an unknown kind": ({"kind": "smell"}, "kind"),
    "an unknown key": ({"colour": 1}, "colour"),
    "another format": ({"format": 1}, "format"),
    "no checksum": ({"sha256": "x"}, "sha256"),
    "a net without end": ({"shape": {"inputs": 2, "outputs": 1, "widths": [10**9], "block": 2}}, "shape"),
    "a net of no width": ({"shape": {"inputs": 2, "outputs": 1, "widths": [], "block": 2}}, "shape.widths"),
    "no number": ({"errors": {"roughness": float("nan")}}, "errors"),
}


@pytest.mark.parametrize("case", CARDS)
def test_a_bad_card_is_refused_by_file_and_field(folder: Path, case: str) -> None:
    changes, field = CARDS[case]
    respell(folder, **changes)
    message = complaint(folder)
    assert "touch.json" in message and field in message


def test_a_card_too_long_is_refused(folder: Path) -> None:
    weights_path("touch", folder).with_suffix(".json").write_bytes(b" " * (LARGEST_CARD + 1))
    assert "is longer than" in complaint(folder)


def spoilt(folder: Path, spoil: Callable[[dict[str, torch.Tensor]], object]) -> None:
    """Other tensors, and a card that vouches for them."""
    path = weights_path("touch", folder)
    tensors = load_file(path)
    spoil(tensors)
    save_file(tensors, path)
    respell(folder, sha256=hashlib.sha256(path.read_bytes()).hexdigest())


SPOILERS: dict[str, tuple[Callable[[dict[str, torch.Tensor]], object], str]] = {
    "a tensor is missing": (lambda t: t.pop("enter.bias"), "enter.bias: missing"),
    "a tensor too many": (lambda t: t.update(extra=torch.zeros(3)), "extra: no such tensor"),
    "another shape": (lambda t: t.update({"enter.bias": torch.zeros(9)}), "enter.bias: torch.float32 (9,)"),
    "another type": (lambda t: t.update({"enter.bias": torch.zeros(3).double()}), "torch.float64"),
    "no number": (lambda t: t["enter.bias"].fill_(float("nan")), "enter.bias: not every value is finite"),
}


@pytest.mark.parametrize("spoiler", SPOILERS)
def test_weights_that_are_not_the_nets_are_refused(folder: Path, spoiler: str) -> None:
    spoil, said = SPOILERS[spoiler]
    spoilt(folder, spoil)
    assert said in complaint(folder)


def test_weights_that_the_card_does_not_vouch_for_are_refused(folder: Path) -> None:
    path = weights_path("touch", folder)
    path.write_bytes(path.read_bytes()[:-1] + b"\1")
    assert "SHA-256" in complaint(folder)


class Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return pytest.fail, ("it was unpickled",)


@pytest.mark.parametrize(
    "content", [b"", b"x" * 64, b"\xff" * 8 + b"{}", pickle.dumps(Bomb())], ids=["0", "x", "header", "pickle"]
)
def test_what_is_no_safetensors_file_is_refused_and_not_run(folder: Path, content: bytes) -> None:
    path = weights_path("touch", folder)
    path.write_bytes(content)
    respell(folder, sha256=hashlib.sha256(content).hexdigest())
    assert "touch.safetensors" in complaint(folder)


def test_what_comes_with_the_package_is_whole_and_small() -> None:
    kinds = {path.stem for path in FOLDER.glob("*") if path.suffix in (".json", ".safetensors")}
    for kind in kinds:
        card = read_card(kind)
        net, _ = load_net(kind)
        assert net.shape == card.shape
        assert card.errors and card.data and card.training and card.versions
    assert sum(path.stat().st_size for path in FOLDER.glob("*")) < 20_000_000


@pytest.mark.slow
def test_loading_a_net_loads_no_textures() -> None:
    script = """
import sys
import surrogate.nets.weights
print(*(name for name in sys.modules if name.startswith(("surrogate.corpus", "surrogate.families"))))
"""
    command = [sys.executable, "-c", script]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert process.stdout.strip() == ""
