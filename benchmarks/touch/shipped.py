"""Operators of the named round fingers, as they come with Retouch: python -m benchmarks.touch.shipped.

To be run again where `tactile.elements.round_pad` builds other numbers, which `tests/tactile/test_shipped.py`
notices. Each finger takes a CPU minute and 4 MB.
"""

from mitsuba_scenes.fingers import bundled_skins
from optimize.settings.skins import load_skin
from tactile.elements.round_pad import SHIPPED, keep_with_package


def main() -> None:
    for old in SHIPPED.glob("*.safetensors"):
        old.unlink()
    for name in bundled_skins():
        skin = load_skin(name)
        if skin.patch_mm is not None:
            print(name, keep_with_package(skin, skin.patch_mm).name, flush=True)


if __name__ == "__main__":
    main()
