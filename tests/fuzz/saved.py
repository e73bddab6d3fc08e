"""Files that Retouch itself has written: runs, trainings, data sets and caches, each tampered with."""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from safetensors.numpy import load, save

from relief.ground.tensors import Arrays
from surrogate.data.shard import _HEADER
from surrogate.validation import parse_json
from tests.fuzz.bases import CACHE, DATA, NETS, RESULTS, RUNS, WEIGHTS
from tests.fuzz.case import Case, chance, edited, edits, several_edits
from tests.fuzz.tampered import arrays_changed, json_changed, resealed, sealed_tensors, tampered

CHECKPOINT = "checkpoint/descent.safetensors"
SHARD = f"{DATA}/shards/00000.safetensors"
TRAINING = f"{NETS}/training.safetensors"


@lru_cache(maxsize=16)
def _opened(content: bytes, key: str, skipped: int) -> tuple[Arrays, Any]:
    """Arrays and JSON of a sound safetensors file."""
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    return load(content), json.loads(header["__metadata__"][key][skipped:])


@st.composite
def checkpoints(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A run directory, of either method, whose checkpoint, settings or history were tampered with."""
    method = draw(st.sampled_from(tuple(RUNS)))
    files = {name: content for name, content in base.items() if not name.startswith(tuple(RUNS))}
    files |= {name: content for name, content in base.items() if name.startswith(method)}
    name = draw(st.sampled_from((CHECKPOINT,) * 8 + ("run.toml", "history.jsonl")))
    path = f"{method}/{name}"
    if name == CHECKPOINT:
        files[path] = draw(tampered(files[path], *_opened(files[path], "checked", 8), sealed_tensors))
    elif name == "run.toml" and draw(st.booleans()):
        value = draw(st.sampled_from(("0", "1", "3", "100000", "-1", "nan")))
        key = draw(st.sampled_from(("steps", "corrections", "samples", "seed", "tolerance")))
        lines = files[path].decode().splitlines()
        files[path] = "\n".join(
            f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines
        ).encode()
    elif name == "history.jsonl" and draw(st.booleans()):
        rows = [json.loads(line) for line in files[path].splitlines()]
        files[path] = "".join(json.dumps(row) + "\n" for row in draw(json_changed(rows))).encode()
    else:
        files[path] = edited(files[path], draw(several_edits()))
    return Case("checkpoints", files, [method], ("resume", method, "-q") if whole else ())


@st.composite
def results(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A finished run whose result.json was tampered with; the paths in the file are those of the base."""
    files = dict(base)
    path = f"{RESULTS}/result.json"
    content = json.loads(files[path])
    for _ in range(draw(st.integers(0, 2))):
        content = draw(json_changed(content)) if isinstance(content, dict) and content else content
    text = json.dumps(content).replace("1e+300", draw(st.sampled_from(("1e+300", "1e999"))))
    files[path] = edited(text.encode(), draw(several_edits()) if chance(draw, 3) else [])
    options = draw(st.sampled_from(((), ("--json",))))
    return Case("results", files, [], ("resume", RESULTS, *options) if whole else ())


@st.composite
def trainings(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """The checkpoint of a training, tampered with."""
    files = dict(base)
    files[TRAINING] = draw(tampered(files[TRAINING], *_opened(files[TRAINING], "checked", 8), sealed_tensors))
    return Case("trainings", files, [], TRAIN if whole else ())


TRAIN = ("train", "touch", "--data", DATA, "-o", NETS, "--epochs", "2", "--widths", "4,4", "-q", "--resume")
"""The command that goes on with the training of `tests.fuzz.bases`."""


def sealed_shard(arrays: Any, header: Any) -> bytes:
    """A shard whose checksums are those of its arrays, as far as it has the fields for these."""
    header = json.loads(json.dumps(header))
    if isinstance(header, dict) and isinstance(header.get("checksums"), dict):
        for name, array in arrays.items():
            if name in header["checksums"] and array.ndim:
                header["checksums"][name] = [
                    zlib.crc32(np.ascontiguousarray(part).tobytes()) for part in array
                ]
    text = json.dumps(header)
    try:
        parsed = parse_json(_HEADER, text, "")
        text = json.dumps(dict(header, checksum=parsed.sealed().checksum))
    except ValueError:
        pass
    return save({name: np.ascontiguousarray(array) for name, array in arrays.items()}, {"shard": text})


@st.composite
def data_sets(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A data set of which a shard or the request was tampered with."""
    files = dict(base)
    if draw(st.integers(0, 3)):
        files[SHARD] = draw(tampered(files[SHARD], *_opened(files[SHARD], "shard", 0), sealed_shard))
    else:
        path = f"{DATA}/dataset.json"
        if draw(st.booleans()):
            files[path] = json.dumps(draw(json_changed(json.loads(files[path])))).encode()
        else:
            files[path] = edited(files[path], draw(several_edits()))
    del files[TRAINING]
    return Case("data sets", files, [], TRAIN[:-1] if whole else ())


@st.composite
def weights(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A net and its card, of which one or both were tampered with; mostly the card has the right checksum."""
    files, net, card = dict(base), f"{WEIGHTS}/touch.safetensors", f"{WEIGHTS}/touch.json"
    if draw(st.booleans()):
        arrays = draw(arrays_changed(load(files[net])))
        files[net] = save({name: np.ascontiguousarray(array) for name, array in arrays.items()})
    else:
        files[net] = edited(files[net], draw(several_edits()))
    content = json.loads(files[card])
    if draw(st.booleans()):
        content = draw(json_changed(content))
    if not chance(draw, 5):
        content["sha256"] = hashlib.sha256(files[net]).hexdigest()
    files[card] = edited(json.dumps(content).encode(), draw(several_edits()) if chance(draw, 4) else [])
    return Case("weights", files)


@st.composite
def caches(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A cached operator, tampered with; the sealed ones stand for files of another program."""
    files, foreign = dict(base), False
    for name in sorted(files):
        if name.startswith(CACHE):
            arrays, text = _opened(files[name], "checked", 8)
            files[name] = draw(tampered(files[name], arrays, text, sealed_tensors))
            # With a right checksum the numbers are another program's own.
            foreign |= files[name] != base[name] and resealed(files[name]) == files[name]
    if chance(draw, 10):
        files[f"{CACHE}/llvm.json"] = edited(b'{"x": "y"}', draw(st.lists(edits(), max_size=3)))
    return Case("caches", files, [foreign], ("evaluate", "plate.exr", "--json") if whole else ())
