"""Splits of a corpus: the source of a texture alone decides between training, validation and test."""

import hashlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, get_args

Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = get_args(Split)
SHARES: Mapping[Split, float] = MappingProxyType({"train": 0.8, "validation": 0.1, "test": 0.1})
"""Share of each split, of the sources and of a corpus."""

_PHOTOGRAPHS: Mapping[Split, str] = {
    "train": "astronaut camera cell coffee hubble_deep_field ihc microaneurysms retina rocket text",
    "validation": "chelsea coins",
    "test": "brick grass gravel",
}
# The example textures, which are cut from the three photographs above.
_TEST_FILES = (
    "59fc8f153dbb67a33f2dae1a54cd2f7253f4fba7a824c4903c63453b9184139b",
    "8baad203ef80d0b86921f307cb9f295380777826c82d1ca0a132e097ef0f668d",
    "89588ef998eb757a1e76ba14f9ccc7f543b5b88782974ce25bafd3bfe20cd1a6",
)
ASSIGNED: Mapping[str, Split] = MappingProxyType(
    {f"scikit-image/{name}": split for split, names in _PHOTOGRAPHS.items() for name in names.split()}
    | {f"file/{digest}": "test" for digest in _TEST_FILES}
)
"""Splits of single sources, which are too few for a hash; the example textures are never trained on."""


def split_of(source: str) -> Split:
    """Return the split of everything made from a source.

    Neither the seed of a corpus nor the order or number of its sources plays a part.

    Args:
        source: Name of the source.

    Returns:
        The split in `ASSIGNED`, else one by the SHA-256 of the name.
    """
    if source in ASSIGNED:
        return ASSIGNED[source]
    place = int.from_bytes(hashlib.sha256(source.encode()).digest()[:8], "big") / 2**64
    if place < SHARES["train"]:
        return "train"
    return "validation" if place < SHARES["train"] + SHARES["validation"] else "test"
