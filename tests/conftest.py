"""What every test shares: a cache folder, fixed seeds, one thread, Mitsuba with a libLLVM, truths."""

import os
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from types import ModuleType

import pytest

# Before numpy and torch, which read them once. Tests have a process a core; with two threads of BLAS
# tests of touch take 1.7 times the CPU seconds.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import torch

from tests.recorded import Truths

SLOW_S = 1.0
"""CPU seconds of a test, without the fixtures that it shares, from which on it is marked `slow`."""
CPU_S = "cpu_s"
"""Name under which a report has the CPU seconds of its test."""


@pytest.fixture(scope="session", autouse=True)
def cache_dir(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The cache folder of this session, empty at its start unless RETOUCH_TEST_CACHE names one to keep.

    Processes that share the tests of a session share its cache: each has its own folder beside the others'.
    """
    session = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        session = session.parent
    folder = Path(os.environ.get("RETOUCH_TEST_CACHE") or session / "cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETOUCH_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def mi(cache_dir: Path) -> ModuleType:
    """The module `mitsuba` with the variant for grey scenes."""
    from visual.backend.variants import load_mitsuba

    return load_mitsuba(colour=False)


@pytest.fixture
def tight_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contacts in double precision to twelve digits, as finite differences and symmetries need."""
    from tactile import contact

    monkeypatch.setitem(contact.STOPS, torch.float64, contact.Stop(residual=1e-12))


@pytest.fixture(autouse=True)
def _seed() -> None:
    """The same random numbers for a test whichever tests run before it."""
    torch.manual_seed(0)


def pytest_configure() -> None:
    """One thread for torch: the arrays of the tests are small, and the order of sums stays the same."""
    torch.set_num_threads(1)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of `make truths`."""
    group = parser.getgroup("recorded truths")
    group.addoption("--record-truths", action="store_true", help="compute recorded truths anew")
    group.addoption("--accept", default="", metavar="REASON", help="replace recorded truths that disagree")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measure a test by the CPU seconds of its process and of those that it waited for."""
    before = os.times()
    try:
        return (yield)
    finally:
        seconds = sum(now - then for now, then in zip(os.times()[:4], before[:4], strict=True))
        item.user_properties.append((CPU_S, seconds))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests that took long and are not marked `slow`; no test fails by its time."""
    long = []
    for report in chain.from_iterable(terminalreporter.stats.values()):
        if isinstance(report, pytest.TestReport) and report.when == "call" and "slow" not in report.keywords:
            seconds = dict(report.user_properties).get(CPU_S)
            if isinstance(seconds, float) and seconds >= SLOW_S:
                long.append(f"{report.nodeid} ({seconds:.1f} s)")
    if long:
        terminalreporter.write_line(f"not marked slow: {', '.join(long)}")


@pytest.fixture
def truths(request: pytest.FixtureRequest) -> Truths:
    """The recorded truths of a test."""
    option = request.config.getoption
    return Truths(request.node.nodeid, option("--record-truths"), option("--accept"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Where truths are recorded, run the tests that have some."""
    if config.getoption("--record-truths"):
        items[:] = [item for item in items if "truths" in getattr(item, "fixturenames", ())]
