"""A data set is the same whoever makes it, in whatever order, and whoever dies on the way."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

import tactile
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from retouch.laboratory.training import shard_jobs
from retouch.laboratory.training.dataset import DatasetPlan, ShardResult, make_dataset, plan_dataset
from retouch.laboratory.training.fields import touch_fields
from retouch.laboratory.training.shard_jobs import ShardJob, run_shard
from retouch.laboratory.workers.cluster import run_on_client, run_on_dask
from retouch.laboratory.workers.jobs import GIVEN_UP, JobResult, WorkerError
from retouch.laboratory.workers.processes import run_here
from surrogate.corpus import manifest
from surrogate.corpus import recipes as corpus
from surrogate.corpus.optimised import store
from surrogate.corpus.photographs import Photograph, by_name, folder
from surrogate.data.field_set import FAILURES, open_fieldset, shard_path, text_of_failures
from surrogate.data.request import DATASET_FILE
from tests.retouch.laboratory.training.shard_works import MARKED, dies_always, dies_once, is_mistaken, slow

SIDE = 16

ROOT = Path(__file__).resolve().parents[4]


def small(count: int = 7, **options: object) -> DatasetPlan:
    """Few textures of few samples, touch alone."""
    chosen = {"touch": "layer", "lights": "none", "samples": SIDE, "shard_size": 2} | options
    return plan_dataset(5, count, (), **chosen)  # type: ignore[arg-type]


def in_process(jobs: Iterable[ShardJob]) -> Generator[JobResult, None, None]:
    """Here, one after another."""
    for job in jobs:
        yield JobResult(job, run_shard(job))


def ignore(_: ShardResult) -> None:
    pass


def files(path: Path) -> dict[str, str]:
    """Checksums of all files of a folder, by name."""
    return {
        str(file.relative_to(path)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(path.rglob("*"))
        if file.is_file()
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small data set, as made in this process."""
    out = tmp_path_factory.mktemp("whole") / "data"
    assert make_dataset(small(), out, in_process, ignore) == []
    return out


def test_two_commands_do_not_write_into_one_folder(tmp_path: Path) -> None:
    with only_writer(tmp_path), pytest.raises(InputError, match="another command is writing into this"):
        make_dataset(small(), tmp_path, in_process, ignore)
    assert list(tmp_path.iterdir()) == []


def test_it_holds_what_was_asked(whole: Path) -> None:
    found = open_fieldset(whole)
    assert len(found.shards) == found.request.shards and found.count() == 7
    for shard in found.shards:
        reliefs = shard.read("heights")
        touched = touch_fields(reliefs, 10.0, tactile.Skin(), "layer")
        for row, relief in zip(shard.rows, reliefs, strict=True):
            assert isinstance(row.entry.texture, corpus.Recipe)
            np.testing.assert_array_equal(relief, corpus.heights(row.entry.texture, samples=SIDE))
        for name, values in touched.items():
            np.testing.assert_allclose(shard.read(name), values, rtol=1e-6, atol=1e-7)


def test_pictures_come_with_their_lights(tmp_path: Path) -> None:
    plan = small(2, touch="none", lights="random", directions=2, strata=6)
    make_dataset(plan, tmp_path / "data", in_process, ignore)
    (shard,) = open_fieldset(tmp_path / "data").shards
    assert shard.read("pictures").shape == (2, 2, SIDE, SIDE)
    toward = shard.read("toward")
    assert len(np.unique(toward.reshape(-1, 3), axis=0)) == 4
    assert (shard.read("pictures").mean((2, 3)) > 0).all()
    assert 0.2 < shard.read("ambient").mean() < 0.6


def test_the_order_of_shards_changes_nothing(whole: Path, tmp_path: Path) -> None:
    def backward(jobs: Iterable[ShardJob]) -> Generator[JobResult, None, None]:
        yield from in_process(reversed(list(jobs)))

    make_dataset(small(), tmp_path / "data", backward, ignore)
    assert files(tmp_path / "data") == files(whole)


def test_what_is_there_is_not_made_again(whole: Path, tmp_path: Path) -> None:
    out, done = tmp_path / "data", list[int]()

    def interrupted(jobs: Iterable[ShardJob]) -> Generator[JobResult, None, None]:
        for result in in_process(jobs):
            done.append(result.job.number)
            yield result
            if len(done) == 2:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_dataset(small(), out, interrupted, ignore)
    assert files(out).items() < files(whole).items() and len(files(out)) == 3
    results: list[ShardResult] = []
    make_dataset(small(), out, interrupted_never(done), results.append)
    assert done == [0, 1, 2, 3] and sum(made.textures for made in results) == 7
    assert files(out) == files(whole)


@pytest.mark.parametrize("optimised", [False, True])
def test_a_larger_count_extends_and_makes_complete_shards_no_more(tmp_path: Path, optimised: bool) -> None:
    options: dict[str, Any] = {}
    if optimised:
        relief = np.random.default_rng(1).uniform(0, 1, (SIDE, SIDE)).astype(np.float32)
        texture = store(tmp_path / "run", "plate", relief, "scikit-image/gravel")
        manifest.write_manifest(tmp_path / "run" / manifest.MANIFEST_FILE, [manifest.entry(texture, relief)])
        options = {"optimised": tmp_path / "run"}
    out, done = tmp_path / "data", list[int]()
    make_dataset(small(3, **options), out, in_process, ignore)
    make_dataset(small(**options), out, interrupted_never(done), ignore)
    assert done == [1, 2, 3]
    make_dataset(small(**options), tmp_path / "anew", in_process, ignore)
    assert files(out) == files(tmp_path / "anew")


def interrupted_never(done: list[int]) -> partial[Generator[JobResult, None, None]]:
    def noted(jobs: Iterable[ShardJob], done: list[int]) -> Generator[JobResult, None, None]:
        for result in in_process(jobs):
            done.append(result.job.number)
            yield result

    return partial(noted, done=done)


def test_a_shard_that_is_damaged_is_made_again(whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "data"
    make_dataset(small(), out, in_process, ignore)
    path = shard_path(out, 2)
    content = path.read_bytes()
    for damaged in (content[:-10], content[:-5] + bytes([content[-5] ^ 1]) + content[-4:]):
        path.write_bytes(damaged)
        (out / "shards" / ".00002-abc.partial").mkdir()
        make_dataset(small(), out, in_process, ignore)
        assert files(out) == files(whole)
        assert not (out / "shards" / ".00002-abc.partial").exists()


@pytest.mark.slow
def test_processes_make_the_same_files_and_a_killed_one_loses_nothing(whole: Path, tmp_path: Path) -> None:
    killed = partial(dies_once, mark=tmp_path / "died")
    make_dataset(small(), tmp_path / "data", partial(run_here, workers=2, work=killed), ignore)
    assert (tmp_path / "died").exists()
    assert files(tmp_path / "data") == files(whole)


@pytest.mark.slow
def test_pictures_are_the_same_in_every_process(tmp_path: Path) -> None:
    plan = small(3, touch="none", lights="random", directions=2, strata=6, shard_size=1)
    make_dataset(plan, tmp_path / "here", in_process, ignore)
    make_dataset(plan, tmp_path / "there", partial(run_here, workers=2, work=run_shard), ignore)
    assert files(tmp_path / "here") == files(tmp_path / "there")


@pytest.mark.slow
@pytest.mark.slow
def test_a_script_without_a_guard_is_run_once(tmp_path: Path) -> None:
    """Workers do not import the script of their caller, as a notebook saved as a script has no guard."""
    script = tmp_path / "mine.py"
    script.write_text(
        "print('run')\nimport retouch\n"
        "made = retouch.dataset('data', 7, touch='layer', lights='none', samples=36, workers=2)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = (sys.executable, script.name)
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout.count("run")) == (0, 1), done.stderr


@pytest.mark.slow
def test_a_shard_that_always_takes_its_worker_down_is_given_up_and_the_others_are_not(
    whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "data"
    failures = make_dataset(small(), out, partial(run_here, workers=1, work=dies_always), ignore)
    assert [(failure.index, failure.reason) for failure in failures] == [(2, GIVEN_UP), (3, GIVEN_UP)]
    assert (out / FAILURES).read_text(encoding="utf-8") == text_of_failures(failures)
    assert [shard.number for shard in open_fieldset(out).shards] == [0, 2, 3]
    make_dataset(small(), out, in_process, ignore)
    assert files(out) == files(whole)


@pytest.mark.slow
def test_a_mistake_in_a_worker_is_shown_with_its_traceback(tmp_path: Path) -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        make_dataset(small(), tmp_path / "data", partial(run_here, workers=1, work=is_mistaken), ignore)


def test_a_texture_that_fails_is_left_out_and_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = corpus.heights

    def spoilt(texture: corpus.Recipe, *rest: object, **options: int) -> np.ndarray:
        heights = made(texture, **options)  # type: ignore[arg-type]
        return heights * np.float32(np.nan) if texture.index == 2 else heights

    def unable(heights: np.ndarray, *rest: object) -> dict[str, np.ndarray]:
        if any(np.array_equal(relief, fifth) for relief in heights):
            raise tactile.ContactError("contact not converged")
        return touch_fields(heights, *rest)  # type: ignore[arg-type]

    plan = small()
    fifth = made(next(iter(plan.textures(2))), samples=SIDE)  # type: ignore[arg-type]
    monkeypatch.setattr(shard_jobs.corpus, "heights", spoilt)
    monkeypatch.setattr(shard_jobs, "touch_fields", unable)
    failures = make_dataset(plan, tmp_path / "data", in_process, ignore)
    assert [(failure.index, failure.reason) for failure in failures] == [
        (2, "heights: not every value is finite"),
        (4, "touch: contact not converged"),
    ]
    assert (tmp_path / "data" / FAILURES).read_text(encoding="utf-8") == text_of_failures(failures)
    found = open_fieldset(tmp_path / "data")
    assert len(found.shards) == found.request.shards and found.failures() == failures
    assert [row.index for shard in found.shards for row in shard.rows] == [0, 1, 3, 5, 6]


def read(path: Path) -> np.ndarray:
    return np.load(path)


@pytest.fixture
def hills(tmp_path: Path) -> list[Photograph]:
    (tmp_path / "hills").mkdir()
    random = np.random.default_rng(0)
    np.save(tmp_path / "hills" / "a.npy", random.uniform(0, 500, (64, 80)))
    return folder(tmp_path / "hills", read)


def test_workers_need_no_files_of_the_user(hills: list[Photograph], tmp_path: Path) -> None:
    run = tmp_path / "optimised"
    relief = np.random.default_rng(1).uniform(0, 1, (SIDE, SIDE)).astype(np.float32)
    texture = store(run, "plate", relief, hills[0].name)
    manifest.write_manifest(run / manifest.MANIFEST_FILE, [manifest.entry(texture, relief)])
    options = {"touch": "none", "lights": "studio", "strata": 6, "samples": SIDE}
    plan = plan_dataset(5, 3, hills, procedural_share=0.0, optimised=run, **options)  # type: ignore[arg-type]
    job = plan.job(0)
    for file in tmp_path.rglob("*.npy"):
        file.unlink()
    make_dataset(plan, tmp_path / "data", lambda _: in_process([job]), ignore)
    (shard,) = open_fieldset(tmp_path / "data").shards
    np.testing.assert_array_equal(shard.read("heights")[3], relief)
    assert shard.rows[3].entry.texture == texture
    assert by_name(hills).keys() == {row.entry.texture.source for row in shard.rows}


def test_pictures_that_cannot_be_read_are_told_before_any_work(
    hills: list[Photograph], tmp_path: Path
) -> None:
    np.save(tmp_path / "hills" / "a.npy", np.zeros((64, 64)))
    with pytest.raises(InputError, match="is flat"):
        plan_dataset(5, 3, hills)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"count": 6}, "count: 7, not 6"),
        ({"count": 8, "touch": "fem"}, "touch: layer, not fem"),
        ({"touch": "fem"}, "touch: layer, not fem"),
        ({"skin": tactile.Skin(force_n=2.0)}, r"skin: force_n 10\.0, not 2\.0"),
    ],
)
def test_a_folder_with_another_data_set_is_refused(
    whole: Path, change: dict[str, object], field: str
) -> None:
    before = files(whole)
    with pytest.raises(InputError, match=rf"{DATASET_FILE}: {field}") as caught:
        make_dataset(small(**change), whole, in_process, ignore)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value) and files(whole) == before


def test_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").touch()
    with pytest.raises(InputError, match="holds files that are not a data set's"):
        make_dataset(small(), tmp_path, in_process, ignore)
    with pytest.raises(InputError, match="is a file"):
        make_dataset(small(), tmp_path / "thesis.txt", in_process, ignore)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_worker_with_other_packages_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    job = small().job(0)
    monkeypatch.setattr(shard_jobs, "version", lambda name: "0.0")
    with pytest.raises(InputError, match="the data set is made by version"):
        run_shard(job)


def test_failures_are_listed_even_if_there_are_none(whole: Path) -> None:
    assert (whole / FAILURES).read_bytes() == b""


@pytest.mark.slow
def test_a_dask_cluster_makes_the_same_files_though_a_worker_is_killed(whole: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")

    def killing(jobs: Iterable[ShardJob]) -> Generator[JobResult, None, None]:
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            results = run_on_client(jobs, client, slow)
            yield next(results)
            pids = client.run(os.getpid)
            working = [worker for worker, keys in client.processing().items() if keys]
            os.kill(pids[working[0]], signal.SIGKILL)
            yield from results

    make_dataset(small(), tmp_path / "data", killing, ignore)
    assert files(tmp_path / "data") == files(whole)


@pytest.mark.slow
def test_a_local_cluster_is_made_where_one_is_asked_for(whole: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    make_dataset(
        small(), tmp_path / "data", partial(run_on_dask, address="local", workers=1, work=run_shard), ignore
    )
    assert files(tmp_path / "data") == files(whole)


def test_marked_shards_are_there_to_be_killed() -> None:
    assert MARKED in range(small().request.shards)


@pytest.mark.slow
def test_a_polite_kill_takes_the_workers_along(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "optimize", "dataset", "-o", str(tmp_path / "data"), "--count", "4000"]
    options = ["--touch", "layer", "--lights", "none", "--workers", "2", "-q"]
    with subprocess.Popen([*command, *options], cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        parent = psutil.Process(process.pid)
        deadline = time.monotonic() + 120.0
        while len(workers := parent.children(recursive=True)) < 2:
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.05)
        process.terminate()
        assert process.wait() == 130
        assert process.stderr is not None and "the same command goes on" in process.stderr.read()
    assert psutil.wait_procs(workers, timeout=300.0)[1] == []
