"""What every test shares: a cache folder, fixed seeds, one thread, and Mitsuba with a libLLVM that works."""

import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

# As the command line has it, and before torch, which reads it once.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
os.environ.setdefault("KMP_BLOCKTIME", "0")

import torch


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


@pytest.fixture(autouse=True)
def _seed() -> None:
    """The same random numbers for a test whichever tests run before it."""
    torch.manual_seed(0)


def pytest_configure() -> None:
    """One thread for torch: the arrays of the tests are small, and the order of sums stays the same."""
    torch.set_num_threads(1)
