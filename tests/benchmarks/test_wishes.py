"""Patches of newcomers' changes apply to this tree."""

import subprocess
import tomllib

import pytest

from benchmarks.shared.common import ROOT

FOLDER = ROOT / "benchmarks" / "wishes"
NAMES = [wish["name"] for wish in tomllib.loads((FOLDER / "wishes.toml").read_text(encoding="utf-8"))["wish"]]


@pytest.mark.parametrize("name", NAMES)
def test_a_patch_applies(name: str) -> None:
    command = ["git", "-C", str(ROOT), "apply", "--check", str(FOLDER / f"{name}.patch")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_each_patch_is_described() -> None:
    assert {path.stem for path in FOLDER.glob("*.patch")} == set(NAMES)
