"""Splits of a corpus: the source of a texture alone decides between training, validation and test."""

import hashlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, get_args

Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = get_args(Split)
SHARES: Mapping[Split, float] = MappingProxyType({"train": 0.8, "validation": 0.1, "test": 0.1})
"""Share of each split, of the sources and of a corpus."""

ASSIGNED: Mapping[str, Split] = MappingProxyType(
    {
        "scikit-image/astronaut": "train",
        "scikit-image/camera": "train",
        "scikit-image/cell": "train",
        "scikit-image/coffee": "train",
        "scikit-image/hubble_deep_field": "train",
        "scikit-image/ihc": "train",
        "scikit-image/microaneurysms": "train",
        "scikit-image/retina": "train",
        "scikit-image/rocket": "train",
        "scikit-image/text": "train",
        "scikit-image/chelsea": "validation",
        "scikit-image/coins": "validation",
        "scikit-image/brick": "test",
        "scikit-image/grass": "test",
        "scikit-image/gravel": "test",
        # The example textures, which are cut from the three above.
        "file/59fc8f153dbb67a33f2dae1a54cd2f7253f4fba7a824c4903c63453b9184139b": "test",
        "file/8baad203ef80d0b86921f307cb9f295380777826c82d1ca0a132e097ef0f668d": "test",
        "file/89588ef998eb757a1e76ba14f9ccc7f543b5b88782974ce25bafd3bfe20cd1a6": "test",
    }
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
