"""`retouch doctor` says what is missing, what to do about it, and whether an optimisation can run."""

import importlib.metadata
import json
import sys
from pathlib import Path

import pytest

from retouch.commands.main import main
from retouch.pages.meanings import NOT_VERIFIED, OTHER_FINGERS
from retouch.verbs import machine
from visual.backend import llvm


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The requirements of a machine where everything is there, whether Retouch itself is installed or not."""
    require(monkeypatch, "numpy>=1", "nothing>1; python_version < '3'", "nobody; extra == 'dev'")


def require(monkeypatch: pytest.MonkeyPatch, *texts: str) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: list(texts))


def finding(name: str) -> machine.Finding:
    return next(checked for checked in machine.doctor().findings if checked.name == name)


@pytest.fixture
def no_llvm(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise llvm.LLVMMissing(llvm.REMEDY)

    monkeypatch.setattr(llvm, "prepare", missing)


def test_this_machine_can_optimise(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    printed = capsys.readouterr().out
    assert printed.endswith("Ready.\n")
    assert "MISSING" not in printed
    words = " ".join(printed.split())
    assert "run on the processor only" in words and "CUDA" in words
    assert NOT_VERIFIED in words and OTHER_FINGERS in words


def test_json_holds_every_finding(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["ready"] is True
    assert [entry["name"] for entry in printed["findings"]] == [
        checked.name for checked in machine.doctor().findings
    ]
    assert set(printed["findings"][0]) == {"name", "ok", "detail", "remedy", "needed"}


def test_every_remedy_is_there_before_it_is_needed() -> None:
    assert all(checked.remedy for checked in machine.doctor().findings)


@pytest.mark.usefixtures("no_llvm")
def test_without_llvm_it_says_what_to_install(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert "apt install libllvm19" in printed
    assert finding("libLLVM").ok is False
    assert "scalar_rgb" in finding("Mitsuba").detail
    assert finding("Mitsuba").ok is False


def test_the_users_library_that_is_refused_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    llvm._choose.cache_clear()
    monkeypatch.setenv(llvm.VARIABLE, str(tmp_path / "libLLVM.so"))
    checked = finding("libLLVM")
    assert checked.ok
    assert f"{tmp_path / 'libLLVM.so'} refused: there is no such file" in checked.detail


@pytest.mark.parametrize(
    ("requirement", "fault"),
    [("numpy<1", "is not supported (<1)"), ("no-such-package", "no-such-package is missing")],
)
def test_a_package_that_does_not_fit_is_named(
    monkeypatch: pytest.MonkeyPatch, requirement: str, fault: str
) -> None:
    require(monkeypatch, requirement)
    checked = finding("packages")
    assert not checked.ok
    assert fault in checked.detail


def test_mitsuba_that_does_not_import_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    assert not finding("Mitsuba").ok


def test_an_old_python_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 10, 0))
    assert not machine.Diagnosis((machine._python(),)).ready


def test_a_cache_that_cannot_be_written_does_not_stop_an_optimisation(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "file" / "cache"))
    checked = finding("cache")
    assert not checked.ok
    assert machine.Diagnosis((checked,)).ready


def test_the_cache_is_measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path))
    (tmp_path / "operator").write_bytes(bytes(3 * 2**20))
    assert "3.0 MiB, writable" in finding("cache").detail


def test_looking_makes_no_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "cache"))
    machine._cache()
    assert not (tmp_path / "cache").exists()
