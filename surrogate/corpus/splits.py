"""Splits of a corpus: the source of a texture alone decides between training, validation and test."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
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
# SHA-256 of the files of the example textures, which are cut from the three photographs above or drawn; of
# tiles also without what the header says of repeats, as older copies are.
_TEST_FILES = Path(__file__).with_name("test_files.txt").read_text(encoding="ascii").split()
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
