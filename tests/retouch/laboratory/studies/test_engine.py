"""A study computes what is missing, once, whatever is killed or full on the way."""

import csv
import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image

from mitsuba_scenes import find_file
from mitsuba_scenes.studies import bundled_studies
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import RESULT
from optimize.run_directory.results import HISTORY
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from relief.heightmap import save_heights_exr
from retouch.commands.main import main
from retouch.laboratory.studies import engine, row_job
from retouch.laboratory.studies.document import flat_rows, read_document
from retouch.laboratory.studies.engine import DOCUMENT, ROWS, SPREADSHEET, Rows, compute, known, row_folder
from retouch.laboratory.studies.measuring import measures
from retouch.laboratory.studies.page import write_study
from retouch.laboratory.studies.records import FAILURE, FILE, INTERRUPTED
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import load_study
from retouch.laboratory.workers.jobs import JobResults
from tests.optimize.kills import copied_at_every_step
from tests.retouch.laboratory.studies.conftest import in_process

ROOT = Path(__file__).resolve().parents[4]


def done(study_file: Path, out: Path, quick: bool = False, **options: object) -> Rows:
    """The study computed in this process and written."""
    study = load_study(study_file)
    expanded = expand(study, quick)
    rows = compute(expanded, out, in_process, study.measures, **options)  # type: ignore[arg-type]
    write_study(out, study, expanded, rows, quick)
    return rows


@pytest.fixture(scope="module")
def whole(study_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the finished study."""
    out = tmp_path_factory.mktemp("whole") / "tiny"
    rows = done(study_file, out)
    assert len(rows.records) == 4 and not rows.failures
    return out


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "copy"))


def computed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Folders in which a run is begun from now on."""
    begun: list[str] = []
    run = row_job._run

    def noted(job: row_job.RowJob) -> object:
        begun.append(job.folder.name)
        return run(job)

    monkeypatch.setattr(row_job, "_run", noted)
    return begun


def table(out: Path) -> list[dict[str, object]]:
    """The rows of a study without times."""
    times = re.compile("time_s|seconds|cpu_s|_mb")
    rows = flat_rows(read_document(out / DOCUMENT))
    return [{key: value for key, value in row.items() if not times.search(key)} for row in rows]


def test_rows_keep_the_keys_of_the_run(whole: Path) -> None:
    rows = flat_rows(read_document(whole / DOCUMENT))
    assert [(row["table"], row.get("touch.jnd"), row.get("descent.steps")) for row in rows] == [
        *(("feel", 0.5, None), ("feel", 2, None), ("steps", None, 1), ("steps", None, 100)),
    ]
    for row in rows:
        result = json.loads((whole / ROWS / str(row["row"])[:12] / "result.json").read_text())
        for section, key in (
            ("touch", "target_roughness"),
            ("touch", "verified_roughness"),
            ("look", "change_percent"),
        ):
            assert row[key] == pytest.approx(result[section][key], rel=1e-6)
        pixels = result["look"]["pixel_change_percent"]
        assert row["pixel_change_percent"] == pytest.approx(sum(pixels) / len(pixels), rel=1e-6)
        assert row["reason"] == result["stop"]["reason"]
        assert row["time_s.total"] == pytest.approx(result["time_s"]["total"], rel=1e-6)
        assert row["seconds_per_step"] == pytest.approx(
            result["time_s"]["descent"] / result["stop"]["steps"], rel=1e-6
        )


def test_the_spreadsheet_has_the_same_rows(whole: Path) -> None:
    with (whole / SPREADSHEET).open(newline="") as file:
        sheet = list(csv.DictReader(file))
    rows = flat_rows(read_document(whole / DOCUMENT))
    assert len(sheet) == len(rows) == 4
    for line, row in zip(sheet, rows, strict=True):
        assert {name: line[name] for name in row} == {n: "" if v is None else str(v) for n, v in row.items()}


def test_what_is_done_is_not_done_again(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, before = computed(monkeypatch), table(copy)
    assert len(done(study_file, copy).records) == 4
    assert begun == [] and table(copy) == before
    assert len(done(study_file, copy, quick=True).records) == 1 and begun == []
    assert len(table(copy)) == 1


@pytest.mark.parametrize(
    "content", [b"", b"[]", b'{"key": 3}', b"\xff", b'{"key":"%s","columns":{"a":NaN}}' % (b"0" * 64)]
)
def test_a_damaged_record_is_written_again_without_a_run(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    begun, before = computed(monkeypatch), table(copy)
    for path in copy.glob(f"{ROWS}/*/{FILE}"):
        path.write_bytes(content)
    done(study_file, copy)
    assert begun == [] and table(copy) == before


def test_a_new_version_of_a_measure_is_measured_without_a_run(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the rows are of a version with fewer settings, and of a checkout that is gone."""
    begun = computed(monkeypatch)
    for folder in (copy / ROWS).iterdir():
        settings = (folder / "run.toml").read_text()
        (folder / "run.toml").write_text(settings.replace('scene = "', 'scene = "/gone'))
        result = json.loads((folder / "result.json").read_text())
        del result["settings"]["look"]["masking"]
        (folder / "result.json").write_text(json.dumps(result))
    other = measures.Measure("pace", 2, {"pages": "Number."}, lambda *_: {"pages": 7.0})
    monkeypatch.setitem(measures.MEASURES, "pace", other)
    rows = done(study_file, copy)
    assert begun == []
    for record in rows.records.values():
        assert record.cells["pages"] == 7.0 and "seconds_per_step" not in record.cells
        assert record.cells["cpu_s"] is not None


@pytest.mark.slow
def test_a_row_whose_settings_name_files_that_are_gone_is_computed(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, before = computed(monkeypatch), table(copy)
    folder = row_folder(copy, next(iter(expand(load_study(study_file), quick=True).rows.values())))
    (folder / FILE).unlink()
    (folder / "run.toml").write_text((folder / "run.toml").read_text().replace('scene = "', 'scene = "/gone'))
    assert not done(study_file, copy).failures
    assert begun == [folder.name] and table(copy) == before


@pytest.mark.slow
@pytest.mark.sentinel
def test_again_computes_anew(study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, before = computed(monkeypatch), table(copy)
    done(study_file, copy, quick=True, again=True)
    assert len(begun) == 1
    done(study_file, copy)
    assert len(begun) == 1 and table(copy) == before


def test_rows_of_a_document_count_as_done(
    study_file: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = computed(monkeypatch)
    done(study_file, tmp_path / "out", given=read_document(whole / DOCUMENT).records)
    assert begun == [] and table(tmp_path / "out") == table(whole)


@pytest.mark.parametrize("hostile", ["swapped", "axes", "nan", "huge", "foreign", "escape", "deep", "list"])
def test_a_document_is_not_believed(whole: Path, tmp_path: Path, hostile: str) -> None:
    content = json.loads((whole / DOCUMENT).read_text())
    first, second, *_ = content["records"]
    columns = content["records"][first]["columns"]
    if hostile == "swapped":
        content["records"][first] = content["records"][second]
    columns["steps"] = {"nan": float("nan"), "huge": 10**400}.get(hostile, columns["steps"])
    content["records"][first] |= {"colour": "red"} if hostile == "foreign" else {}
    columns["reason"] = "\x1b[31m" if hostile == "escape" else columns["reason"]
    if hostile == "axes":
        del content["tables"][0]["rows"][0]["labels"]["touch.jnd"]
    path = tmp_path / "study.json"
    path.write_text({"deep": "[" * 100_000, "list": "[]"}.get(hostile) or json.dumps(content))
    with pytest.raises(InputError, match=r"study\.json: not the document of a study") as caught:
        read_document(path)
    assert "\n" not in str(caught.value) and "\x1b" not in str(caught.value)


@pytest.mark.slow
def test_all_bundled_studies_are_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in [path.stem for path in bundled_studies()]:
        assert main(["study", name, "--quick", "--redraw", "-o", str(tmp_path / name)]) == 0
        assert capsys.readouterr().out.startswith(f"{tmp_path / name}/index.html: 0 rows, 0 failed, ")
        assert read_document(tmp_path / name / DOCUMENT).quick
    assert main(["study"]) == 2


def test_a_folder_of_other_files_is_refused(study_file: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").touch()
    with pytest.raises(InputError, match="holds files that are not a study's"):
        done(study_file, tmp_path)
    with pytest.raises(InputError, match="is a file"):
        done(study_file, tmp_path / "thesis.txt")


def test_two_commands_do_not_compute_in_one_folder(study_file: Path, copy: Path) -> None:
    with only_writer(copy / ROWS), pytest.raises(InputError, match="another command is writing into this"):
        done(study_file, copy)


@pytest.mark.slow
def test_a_full_disk_ends_the_study_and_the_same_command_goes_on(
    study_file: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, write = tmp_path / "out", row_job.write_atomically

    def full(path: Path, content: bytes) -> None:
        if len(list(out.glob(f"{ROWS}/*/{FILE}"))) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write(path, content)

    with monkeypatch.context() as disk:
        disk.setattr(row_job, "write_atomically", full)
        with pytest.raises(
            OSError, match="No space left on device; when that is mended, the same command goes on"
        ):
            done(study_file, out)
    begun = computed(monkeypatch)
    done(study_file, out)
    assert len(begun) == 1 and table(out) == table(whole)


@pytest.mark.slow
def test_a_row_that_fails_is_tried_once_more_and_listed(
    study_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    (tmp_path / "few.toml").write_text(
        study_file.read_text().replace("[0.5, 2]", "[0.5]").replace("100]", "]")
    )
    _, row = expand(load_study(tmp_path / "few.toml")).rows.values()
    row_folder(out, row).mkdir(parents=True)
    (row_folder(out, row) / "thesis.txt").touch()
    command = ["study", str(tmp_path / "few.toml"), "-o", str(out), "--workers", "1"]
    assert main(command) == 1
    told, shown = capsys.readouterr()
    assert told.startswith(f"{out / engine.PAGE}: 1 rows, 1 failed")
    assert shown.count("holds an earlier run") == 3 and shown.count("tried once more at the end") == 1
    assert "holds an earlier run" in (out / engine.PAGE).read_text()
    (failure,) = out.glob(f"{ROWS}/*/{FAILURE}")
    assert "holds an earlier run" in json.loads(failure.read_text())["reason"]
    assert [bool(row["failure"]) for row in table(out)] == [False, True]
    assert main([*command, "--redraw", "--json"]) == 1
    assert [bool(row["failure"]) for row in json.loads(capsys.readouterr().out)["rows"]] == [False, True]


CANNOT_RUN = {
    'texture = "grey.png"': "grey.png: relief_mm: missing; a picture needs",
    'texture = "bad.exr"': "bad.exr: damaged or not an EXR",
    'texture = "flat.exr"': "flat.exr: touch.jnd: the texture is flat",
    'scene = "bad.xml"': "bad.xml: ",
    'define = { colour = "red" }': "studio.xml: defines: colour: the scene has no such parameter",
    "repeats = true": "repeats: the sides do not fit",
    "size_mm = 2.0": "smaller than pairs of receptors",
    "touch.contact_area_mm2 = 1e6": "touch.contact_area_mm2: 1e+06: ",
    'touch.feel_of = "flat.exr"': "touch.feel_of: ",
    'touch.roughness_map = "grey.png"': "touch.roughness_range: missing",
    'scene = "near.xml"': "near.xml: ",
    "touch.young_modulus_mpa = 1e9": "is a pressure of",
}
"""Settings of rows that cannot run, and what is told of each."""


def test_rows_that_cannot_run_are_told_before_the_first_is_computed(texture: Path, tmp_path: Path) -> None:
    Image.new("L", (32, 32)).save(tmp_path / "grey.png")
    save_heights_exr(tmp_path / "flat.exr", np.ones((32, 32)))
    for name in ("bad.exr", "bad.xml"):
        (tmp_path / name).write_bytes(b"neither")
    lamp = '<emitter type="point"><point name="position" x="0" y="0" z="2"/></emitter></scene>'
    studio = find_file("studio", ".xml").read_text()
    (tmp_path / "near.xml").write_text(
        studio.replace("textures/gravel.png", "flat.exr").replace("</scene>", lamp)
    )
    settings = ["seed = 0", *CANNOT_RUN, "seed = 1"]
    values = ", ".join(f"{{ label = {number}, {one} }}" for number, one in enumerate(settings))
    rest = f'set.texture = "{texture}"\n[[tables]]\nname = "a"\n[tables.axes]\nof = [{values}]\n'
    (tmp_path / "own.toml").write_text(f'title = "T"\nbase = "gravel.toml"\n{rest}')
    expanded = expand(load_study(tmp_path / "own.toml"))
    jobs = list[row_job.RowJob]()

    def noted(rows: Iterable[row_job.RowJob]) -> JobResults[row_job.RowJob]:
        jobs.extend(rows)
        yield from ()

    rows = compute(expanded, tmp_path / "out", lambda work, told: noted)
    (table,) = expanded.tables
    first, *faulty, last = table.rows
    assert [job.key for job in jobs] == [first.key, last.key]
    for row, part in zip(faulty, CANNOT_RUN.values(), strict=True):
        assert part in rows.failures.pop(row.key)
    assert not rows.failures and len(known(expanded, tmp_path / "out").failures) == len(faulty)


def test_a_mistake_of_the_program_fails_its_row_alone(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(row_job, "_run", lambda job: 1 / 0)
    study = load_study(study_file)
    expanded = expand(study)
    first = next(iter(expanded.rows.values()))
    shutil.rmtree(row_folder(copy, first))
    rows = done(study_file, copy)
    assert rows.failures == {first.key: "ZeroDivisionError: division by zero"} and len(rows.records) == 3
    assert "_computed" in json.loads((row_folder(copy, first) / FAILURE).read_text())["traceback"]
    assert known(expanded, copy).failures == rows.failures


# Kills


def test_a_row_that_a_signal_ended_is_not_done(
    study_file: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = load_study(study_file)
    expanded = expand(study)
    path = next(copy.glob(f"{ROWS}/*/{FILE}"))
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"columns": record["columns"] | {"reason": INTERRUPTED}}))
    assert len(known(expanded, copy, study.measures).records) == 3
    result = read_verification(path.parent)
    assert result is not None
    stop = result.stop.model_copy(update={"reason": INTERRUPTED})
    monkeypatch.setattr(row_job, "_run", lambda job: (result.model_copy(update={"stop": stop}), 1.0))
    (path.parent / RESULT).unlink()
    assert list(done(study_file, copy).failures.values()) == ["was interrupted; the same command goes on"]


@pytest.mark.slow
def test_a_row_that_was_killed_goes_on_where_it_was(
    study_file: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, copies = Path(shutil.copytree(whole, tmp_path / "out")), tmp_path / "copies"
    first = next(iter(expand(load_study(study_file), quick=True).rows.values()))
    with monkeypatch.context() as patch:
        copied_at_every_step(patch, copies)
        done(study_file, tmp_path / "quick", quick=True)
    shutil.rmtree(row_folder(out, first))
    shutil.copytree(copies / "2", row_folder(out, first))
    rows = done(study_file, out)
    assert not rows.failures
    assert [record.columns["cpu_s"] is None for record in rows.records.values()].count(True) == 1
    same(table(out), table(whole))


def same(rows: list[dict[str, object]], others: list[dict[str, object]]) -> None:
    """Assert that two tables are equal but for rounding."""
    for row, other in zip(rows, others, strict=True):
        assert row.keys() == other.keys()
        for key, value in row.items():
            expected = pytest.approx(value, rel=1e-4, abs=1e-9) if isinstance(value, float) else value
            assert other[key] == expected, key


@pytest.mark.slow
def test_a_killed_command_takes_its_workers_along_and_is_repeated(
    study_file: Path, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "optimize",
        "study",
        str(study_file),
        "-o",
        str(out),
        "--workers",
        "2",
        "-q",
    ]
    with subprocess.Popen(command, cwd=ROOT) as process:
        parent = psutil.Process(process.pid)
        while not any(path.read_bytes().count(b"\n") > 1 for path in out.glob(f"{ROWS}/*/{HISTORY}")):
            assert process.poll() is None
            time.sleep(0.02)
        workers = parent.children(recursive=True)
        process.send_signal(signal.SIGKILL)
    assert psutil.wait_procs(workers, timeout=300.0)[1] == []
    done(study_file, out)
    same(table(out), table(whole))
