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
# SHA-256 of the files of the example textures, which are cut from the three photographs above or drawn; of
# tiles also without what the header says of repeats, as older copies are.
_TEST_FILES = (
    "0d964111899e4371dcee04a43388f925d414e19048d79910c756a521c1136bb1",
    "1b3feec9711f2643e59b8e6f25cd2236f02280c83fefbb90be38b74b4a127acd",
    "1c607daa29fe6775232a707338c84e4b3206eae60bd1ff761425abdaa976eb39",
    "20d48585ea6868d57346b6871ec06cda5804156767cb5a1c2a22e841e311769a",
    "243ce80892825b628c636415e62da03cc6e26e778e5e526d91f0de2f65aa5033",
    "25eb9bff6c3b226c6643d43ec3fa5f31ff49e18ed7b61f0900be8f877cd09b75",
    "26ee006bf0c0800dac3f473b66497bf7288eb9a81a1db1b6ee0d96d7668e1503",
    "2aaedc27831223b7f30d6d4bdcd74aa9ffe9ce96f5fb6856fab27c18d9ae642c",
    "2c63fff00ed1b804231edfba9f3cbe6089e6935ea18752866c1d6d4ac4301513",
    "2f72d7cad7d66ae2e8d5cc8e70c8888c37c96cd9f62ae0b0173e568c2b1d775a",
    "3ebd21bb292b4a51f5fb2cf47a13e8371416e84be9e0f866852e8e02c68381e1",
    "41721adcf92274bb792087d1db8ebf1a65d2ec083c7032cddad4350b02a46ae9",
    "43ca5d56f62a1d6dd3d1848737ce3c95850b3ae9a07c79e6222e3028242c38b3",
    "472d62ea5bcf6530bd7165f15387f34ad44224b0d4310f79410b0f219624a159",
    "47b7468d4a39a92343db8a5f2ea23474e81b62ed7be1c2321250fdc44998c567",
    "48af6e446f7c2cb99c3ae6d45fe74eca5f0571ba57c9e3b2bb41dbc9091ed80d",
    "5f392105172bb98fa366a6d000470905985d8be91d3162e68212595959a6f942",
    "645478f0026b076a8275a1e424ebdd94e4210586e1b56a82f7e017059164547b",
    "67f3358c47ac3da1ce3260fc9ee9ec461d634da92522fcf59931aad15fbcd4e3",
    "6dd90030d30fcfff32cdb12845a38b6468575098a227a3fcdb71704304716796",
    "834faddc719c46dfafbc0d7aaf762ef875c02334cd421b5ea2b5e0cc0eebb40b",
    "873a965fa12d49a9e43b2f167af2e4c597ef21bc7bfde3eadf64b3990569f1f7",
    "876ce4df7ebf38bfce202f23fe7e94c73d0c7f6aaf35b5da64e4e8f39921e107",
    "8b38e85dcf3555a12625118f3af85f94f90c7fcb3f18c716796af77db9f21c91",
    "91431c04c9ba8698b71bbd194763d96e5b3d811dd064ea5fe3a43c6cb201895a",
    "9f670ee3c3e1fb0fdd72bca1a22415dc3c5cf273fd863fef9da92e3d1f8c07d2",
    "b42242409435619f46e486853f8a11f681ea9070ae336994e2c77d07dc3f6818",
    "d42bc3fbc0a9197bd38348857930b40d60e36a8471dd0e66afb2de823fb04dd5",
    "de64b5c88c0509439f37b08ba10fa1cebb5a503788c8643c0935427c24948195",
    "e3d791c16fcfaecc502e526b2621cefd1f4a15bd50d0042df0772762f6f59b8a",
    "e5bd8396fb7269acc328db7b0aae27da8620b6610945a099f9394c68ba8ac28b",
    "f4d5c31bdf7c7cb5a79d8e501eb1ea2859b44df97bf11c8c07068e3c2ad6173f",
    "f57102f8f34cb97d4a7b579c86beb5f495b7f38f3ee7a7fe7cf29203667adcfc",
    "f6139b81b406def8985d4a0a88ab5027bd811f9bb613ddf6c4a96f5429ea7784",
    "f621b13c9cbaf6c7156ee26ebf081b60c36ad5811a284774e1c242f60690296a",
    "fb530864b3a78ed1b70b85d65a99ca53630b122d7a32b0a741a8c274b8248122",
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
