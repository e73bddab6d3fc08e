"""The libLLVM chosen for Dr.Jit works, and each candidate is probed once."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from relief.ground.files import cache_folder
from visual.backend import llvm, llvm_candidates
from visual.backend.llvm_candidates import Library

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """No user's choice, no memory on disk or in the process, before the test and after it."""
    # Set before it is deleted, so that what `prepare` puts there is taken back too.
    monkeypatch.setenv(llvm.VARIABLE, "")
    monkeypatch.delenv(llvm.VARIABLE)
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "cache"))
    llvm._choose.cache_clear()
    yield
    llvm._choose.cache_clear()


@pytest.fixture
def probes(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the libraries probed; a probe finds a fault in those whose name has `bad` in it."""
    names: list[str] = []

    def probe(library: Library) -> str:
        names.append(library.path.parent.name)
        return "it does not work" if "bad" in library.path.parent.name else ""

    monkeypatch.setattr(llvm, "_probe", probe)
    return names


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., list[Path]]:
    """Makes a machine that has the named libraries and no others."""

    def install(*names: str) -> list[Path]:
        paths = [tmp_path / name for name in names]
        for path in paths:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"")
        monkeypatch.setattr(llvm_candidates, "_loader_paths", lambda: iter(paths))
        monkeypatch.setattr(llvm_candidates, "_folder_paths", lambda: iter(()))
        return paths

    return install


@pytest.mark.parametrize(
    ("path", "version"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM-14.so.1", (14,)),
        ("/usr/lib/x86_64-linux-gnu/libLLVM-14.0.6.so.1", (14, 0, 6)),
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", (19, 1)),
        ("/usr/lib64/libLLVM-22.so", (22,)),
        ("/opt/homebrew/Cellar/llvm/21.1.2/lib/libLLVM.dylib", (21, 1, 2)),
        ("/opt/homebrew/Cellar/llvm@19/19.1.7/lib/libLLVM.dylib", (19,)),
        ("/opt/lib/libLLVM.21.1.dylib", (21, 1)),
        ("/opt/lib/libLLVM.so", ()),
        ("/usr/lib/llvm-19/lib/libLLVM-C.so.19", None),
        ("/usr/lib/llvm-14/lib/libLLVMCore.a", None),
        ("/opt/lib/libLLVM.so.19.1-rust-1.83.0-stable", None),
    ],
)
def test_the_name_tells_the_version(path: str, version: tuple[int, ...] | None) -> None:
    assert llvm_candidates.parse_version(Path(path)) == version


def test_the_newest_that_works_is_taken(machine: Callable[..., list[Path]], probes: list[str]) -> None:
    paths = machine("a/libLLVM-9.so", "b/libLLVM.so.19.1", "bad/libLLVM.so.30.1", "c/libLLVM.so.22.1")
    assert llvm.prepare() == paths[3]
    assert os.environ[llvm.VARIABLE] == str(paths[3])
    assert probes == ["bad", "c"]


def test_versions_known_to_abort_are_never_run(machine: Callable[..., list[Path]], probes: list[str]) -> None:
    machine("a/libLLVM-14.so.1", "b/libLLVM-15.so.1", "c/libLLVM-16.so.1")
    verdicts = [llvm.judge(library) for library in llvm.candidates()]
    assert [verdict.usable for verdict in verdicts] == [False, False, False]
    assert "aborts" in verdicts[0].fault
    assert "older" in verdicts[2].fault
    assert probes == []


def test_links_to_one_library_are_one_candidate(
    machine: Callable[..., list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    (library,) = machine("a/libLLVM.so.19.1")
    link = library.with_name("libLLVM-19.so")
    link.symlink_to(library)
    monkeypatch.setattr(llvm_candidates, "_loader_paths", lambda: iter([link, library]))
    assert [candidate.path for candidate in llvm.candidates()] == [library]


def test_the_answer_is_remembered_by_other_processes(
    machine: Callable[..., list[Path]], probes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = machine("a/libLLVM.so.19.1")
    llvm.prepare()
    llvm._choose.cache_clear()
    monkeypatch.delenv(llvm.VARIABLE)
    assert llvm.prepare() == path
    assert probes == ["a"]


def test_a_library_that_changed_is_tried_again(machine: Callable[..., list[Path]], probes: list[str]) -> None:
    (path,) = machine("a/libLLVM.so.19.1")
    llvm.prepare()
    path.write_bytes(b"another build")
    llvm.judge(llvm.candidates()[0])
    assert probes == ["a", "a"]


@pytest.mark.parametrize("content", ["", "{", "[1]", '{"a": 1}', "[" * 100_000])
def test_a_damaged_memory_is_ignored(
    machine: Callable[..., list[Path]], probes: list[str], content: str
) -> None:
    memory = cache_folder() / "llvm.json"
    memory.parent.mkdir()
    memory.write_text(content)
    machine("a/libLLVM.so.19.1")
    llvm.prepare()
    assert list(json.loads(memory.read_text()).values()) == [""]
    assert [path.name for path in memory.parent.iterdir()] == ["llvm.json"]


def test_a_cache_that_cannot_be_written_is_no_obstacle(
    machine: Callable[..., list[Path]], probes: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "file" / "cache"))
    (path,) = machine("a/libLLVM.so.19.1")
    assert llvm.prepare() == path


def test_a_probe_that_takes_too_long_is_not_remembered(
    machine: Callable[..., list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(llvm, "PROBE_SECONDS", 0.01)
    machine("a/libLLVM.so.19.1")
    assert "longer than" in llvm.judge(llvm.candidates()[0]).fault
    assert not cache_folder().exists()


@pytest.mark.slow
def test_without_dr_jit_a_line_names_the_library_that_it_lacks(
    machine: Callable[..., list[Path]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As on a bare Debian without libatomic1. It may be installed next: the verdict is not remembered."""
    lacks = "libatomic.so.1: cannot open shared object file: No such file or directory"
    module = (
        f"try:\n    raise ImportError('{lacks}')\nexcept ImportError:\n    raise NameError('_drjit_ext')\n"
    )
    (tmp_path / "drjit.py").write_text(module)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{ROOT}")
    machine("a/libLLVM.so.19.1")
    assert llvm.judge(llvm.candidates()[0]).fault == f"Dr.Jit does not load: {lacks}"
    assert not cache_folder().exists()

    command = [sys.executable, "-m", "retouch", "render", str(ROOT / "mitsuba_scenes" / "studio.xml")]
    child = subprocess.run([*command, "-o", tmp_path / "out"], capture_output=True, text=True, check=False)
    assert child.returncode == 2
    assert child.stderr == f"retouch: mitsuba does not load: {lacks} ({llvm.REMEDY})\n"


def test_a_probe_that_is_interrupted_is_not_remembered(
    machine: Callable[..., list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(llvm, "_PROBE", "import os, signal; os.kill(os.getpid(), signal.SIGTERM)")
    machine("a/libLLVM.so.19.1")
    assert "was killed" in llvm.judge(llvm.candidates()[0]).fault
    assert not cache_folder().exists()


def test_the_users_library_wins_if_it_works(
    machine: Callable[..., list[Path]], probes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    older, _ = machine("a/libLLVM.so.19.1", "b/libLLVM.so.22.1")
    monkeypatch.setenv(llvm.VARIABLE, str(older))
    assert llvm.prepare() == older


@pytest.mark.parametrize(
    ("requested", "fault"),
    [
        ("bad/libLLVM.so.19.1", "it does not work"),
        ("c/libLLVM-15.so.1", "LLVM 15 aborts"),
        ("nowhere/libLLVM.so", "no such file"),
    ],
)
def test_a_users_library_that_does_not_work_is_named_in_one_line(
    machine: Callable[..., list[Path]],
    probes: list[str],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    tmp_path: Path,
    requested: str,
    fault: str,
) -> None:
    good, *_ = machine("a/libLLVM.so.22.1", "bad/libLLVM.so.19.1", "c/libLLVM-15.so.1")
    monkeypatch.setenv(llvm.VARIABLE, str(tmp_path / requested))
    assert llvm.prepare() == good
    (record,) = caplog.records
    assert requested in record.getMessage()
    assert fault in record.getMessage()


def test_the_users_library_may_be_a_bare_name(
    machine: Callable[..., list[Path]], probes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    older, _ = machine("a/libLLVM.so.19.1", "b/libLLVM.so.22.1")
    monkeypatch.setenv(llvm.VARIABLE, older.name)
    assert llvm.prepare() == older


def test_without_any_library_one_line_says_what_to_install(
    machine: Callable[..., list[Path]], capsys: pytest.CaptureFixture[str]
) -> None:
    machine("a/libLLVM-14.so.1")
    with pytest.raises(llvm.LLVMMissing, match="apt install libllvm19"):
        llvm.prepare()
    assert llvm.main() == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_file_that_is_no_library_fails_its_probe(machine: Callable[..., list[Path]]) -> None:
    machine("a/libLLVM.so.19.1")
    verdict = llvm.judge(llvm.candidates()[0])
    assert "LLVM backend is inactive" in verdict.fault


def test_the_library_of_this_machine_runs_a_kernel_and_is_found_again_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = llvm.prepare()
    monkeypatch.setattr(llvm, "_probe", None)
    assert llvm.prepare() == path
