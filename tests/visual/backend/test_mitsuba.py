"""Modules name Mitsuba and Dr.Jit at their top; both load at first use, with the libLLVM chosen before."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from visual.backend import mitsuba, variants

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = """
import os, sys
from visual.backend import llvm
from visual.backend.mitsuba import dr, mi
import visual.exact.render, visual.reference.reference_renderer, visual.scene
print(*({"mitsuba", "drjit"} & sys.modules.keys()))
dr.thread_count()
print(*({"mitsuba", "drjit"} & sys.modules.keys()), os.environ[llvm.VARIABLE] == str(llvm.prepare()))
mi.variants()
print(*sorted({"mitsuba", "drjit"} & sys.modules.keys()))
"""


@pytest.mark.slow
def test_the_first_use_loads_and_chooses_llvm_before() -> None:
    process = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.splitlines() == ["", "drjit True", "drjit mitsuba"]


def test_attributes_follow_the_variant(mi: ModuleType) -> None:
    before = mi.variant()
    try:
        for name in ("scalar_rgb", "llvm_ad_rgb", "llvm_ad_mono"):
            variants.use(name)
            assert mitsuba.mi.variant() == name
            assert mitsuba.mi.Float is mi.Float
            assert mitsuba.mi.Mesh is mi.Mesh
    finally:
        variants.use(before)
