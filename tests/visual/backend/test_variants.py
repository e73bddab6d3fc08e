"""The variant follows the scene and the machine, and says so."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from relief.ground.errors import InputError
from visual.backend import llvm, variants
from visual.backend.variants import choose_variant, is_differentiable, load_mitsuba, require_gradients

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def no_llvm(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise llvm.LLVMMissing(f"no libLLVM ({llvm.REMEDY})")

    monkeypatch.setattr(llvm, "prepare", missing)


def test_a_grey_scene_needs_one_channel_and_a_coloured_one_three() -> None:
    assert choose_variant(colour=False).name == "llvm_ad_mono"
    assert choose_variant(colour=True).name == "llvm_ad_rgb"
    assert is_differentiable(choose_variant(colour=True).name)


@pytest.mark.parametrize("llvm_too", [True, False], ids=["with libLLVM", "without"])
def test_a_cuda_device_is_taken_only_if_named(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, llvm_too: bool
) -> None:
    if not llvm_too:
        request.getfixturevalue("no_llvm")
    monkeypatch.setattr(variants, "has_cuda", lambda: True)
    for colour, channels in ((False, "mono"), (True, "rgb")):
        assert choose_variant(colour).name == (f"llvm_ad_{channels}" if llvm_too else "scalar_rgb")
        chosen = choose_variant(colour, f"cuda_ad_{channels}")
        assert chosen.name == f"cuda_ad_{channels}" and is_differentiable(chosen.name)


def test_the_users_variant_wins() -> None:
    chosen = choose_variant(colour=False, variant="scalar_rgb")
    assert chosen.name == "scalar_rgb"
    assert not is_differentiable(chosen.name)


def test_an_unknown_variant_names_the_nearest() -> None:
    with pytest.raises(InputError, match=r"'llvm_ad_mno'.*nearest is 'llvm_ad_mono'"):
        choose_variant(colour=False, variant="llvm_ad_mno")


def test_cuda_without_a_device_is_one_clear_error(mi: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    import drjit

    monkeypatch.setattr(drjit, "has_backend", lambda backend: False)
    with pytest.raises(InputError, match="no usable CUDA device"):
        choose_variant(colour=False, variant="cuda_ad_mono")


@pytest.mark.usefixtures("no_llvm")
def test_without_llvm_pictures_are_rendered_and_nothing_more() -> None:
    chosen = choose_variant(colour=False)
    assert chosen.name == "scalar_rgb" and not is_differentiable(chosen.name)
    assert "apt install" in chosen.reason
    with pytest.raises(InputError, match=r"'llvm_ad_mono' cannot run here.*apt install"):
        choose_variant(colour=False, variant="llvm_ad_mono")


def test_with_one_core_exr_files_are_read(mi: ModuleType, tmp_path: Path) -> None:
    mi.Bitmap(np.ones((5, 8, 3), dtype=np.float32)).write(str(tmp_path / "sky.exr"))
    script = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
from visual.backend.variants import llvm
llvm.prepare()
import drjit
drjit.set_thread_count(1)
from visual.backend.variants import load_mitsuba
print(load_mitsuba(colour=True).Bitmap("sky.exr").size())
"""
    read = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    assert read.stdout.strip() == "[8, 5]"


def test_gradients_are_there_with_llvm(mi: ModuleType) -> None:
    assert load_mitsuba(colour=False) is mi
    assert mi.variant() == "llvm_ad_mono"
    require_gradients()


def test_gradients_of_a_scalar_variant_are_refused(mi: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mi, "variant", lambda: "scalar_rgb")
    with pytest.raises(InputError, match="or llvm_ad_mono"):
        require_gradients()


@pytest.mark.usefixtures("no_llvm")
def test_gradients_without_llvm_say_what_to_install(mi: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mi, "variant", lambda: "scalar_rgb")
    with pytest.raises(InputError, match="apt install"):
        require_gradients()


def test_many_changes_of_the_variant_warn_of_nothing(mi: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dr.Jit warns of its 1001st compiled function, which a study reaches by changing the variant.

    Here the warning is an error, which Mitsuba swallows: the integrators after the first would be missing.
    """
    import drjit.ast

    before = mi.variant()
    other = "llvm_ad_mono" if before == "llvm_ad_rgb" else "llvm_ad_rgb"
    compiled = []
    for start in (0, 2000):
        monkeypatch.setattr(drjit.ast, "_syntax_counter", start)
        variants.use(other)
        compiled.append(vars(drjit.ast)["_syntax_counter"] - start)
        variants.use(before)
    assert compiled[0] == compiled[1] > 1
