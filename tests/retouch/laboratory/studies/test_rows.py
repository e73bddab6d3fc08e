"""A study file becomes checked rows, and what is wrong with it is told in one line."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from mitsuba_scenes.studies import bundled_studies
from optimize.settings.run_file import load_run, run_keys
from relief.ground.errors import InputError
from relief.heightmap import load_heights, save_heights_exr
from retouch.laboratory.studies import rows
from retouch.laboratory.studies.document import read_document
from retouch.laboratory.studies.row_key import DEFAULTS, row_key
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import load_study

HEAD = 'title = "T"\nbase = "gravel.toml"\n'
AXES = '[[tables]]\nname = "a"\n[tables.axes]\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "own.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("path", bundled_studies(), ids=lambda path: path.stem)
def test_each_bundled_study_is_sound(path: Path) -> None:
    study = load_study(path)
    whole, quick = expand(study), expand(study, quick=True)
    assert whole.faults == quick.faults == ()
    assert 0 < len(quick.rows) < len(whole.rows)


def test_rows_are_the_product_of_the_axes(tmp_path: Path) -> None:
    axes = (
        '"touch.jnd" = [-1, 1]\nmodels = [{ label = "slow", look.weight = 2 }, { label = "x", seed = 3 }]\n'
    )
    (table,) = expand(load_study(written(tmp_path, f"{HEAD}{AXES}{axes}"))).tables
    assert [tuple(row.labels.values()) for row in table.rows] == [
        *((-1, "slow"), (-1, "x"), (1, "slow"), (1, "x")),
    ]
    assert [row.settings.touch.numbers()["jnd"] for row in table.rows] == [-1, -1, 1, 1]
    assert [(row.settings.look.weight, row.settings.seed) for row in table.rows[:2]] == [(2, 0), (None, 3)]


def test_settings_give_way_in_the_order_study_table_quick_axis(tmp_path: Path) -> None:
    within = "set = { seed = 2, look.weight = 2 }\n[tables.axes]\ntouch.jnd = [1, 2]\n"
    table = AXES.replace("[tables.axes]\n", within)
    quick = '[quick]\nset = { "look.weight" = 3, "touch.jnd" = 7 }\naxes = { "touch.jnd" = [2] }\n'
    own = '[set]\nseed = 1\n"look.weight" = 1.5\n"touch.roughness" = 0.1\n'
    study = load_study(written(tmp_path, f"{HEAD}{own}{table}{quick}"))
    (row,) = expand(study, quick=True).rows.values()
    assert (row.settings.seed, row.settings.look.weight) == (2, 3)
    assert row.settings.touch.numbers() == {"jnd": 2}


def test_textures_of_a_folder_replace_the_axis(tmp_path: Path, texture: Path) -> None:
    folder = tmp_path / "own"
    folder.mkdir()
    shutil.copy(texture, folder / "a.exr")
    save_heights_exr(folder / "b.exr", 0.5 * load_heights(texture))
    for name in ("b.png", "a-preview.png"):  # the second as `retouch prepare` names its preview of a.exr
        shutil.copy(Path(load_run("gravel.toml").texture), folder / name)
    study = load_study(written(tmp_path, f'{HEAD}{AXES}texture = ["gravel", "brick"]\n'))
    (table,) = expand(study, textures=folder).tables
    assert [row.settings.texture for row in table.rows] == [folder / n for n in ("a.exr", "b.exr", "b.png")]
    assert table.axes["texture"] == ("a", str(folder / "b.exr"), str(folder / "b.png"))


def test_skins_are_an_axis(tmp_path: Path) -> None:
    (tmp_path / "soft.toml").write_text("young_modulus_mpa = 0.25\n")
    text = f'{HEAD}[set]\n"touch.force_n" = 5\n{AXES}"touch.skin" = ["paper", "soft.toml"]\n'
    (table,) = expand(load_study(written(tmp_path, text))).tables
    assert [tuple(row.labels.values()) for row in table.rows] == [("paper",), ("soft",)]
    skins = [row.settings.touch.finger for row in table.rows]
    assert [(skin.young_modulus_mpa, skin.force_n) for skin in skins] == [(0.5, 10.0), (0.25, 10.0)]
    assert len({row_key(row.settings) for row in table.rows}) == 2


def test_regions_are_an_axis_however_long_the_paths_of_their_masks(tmp_path: Path) -> None:
    folder = tmp_path / ("long" * 50)
    folder.mkdir()
    for name in ("scene.xml", "texture.png", "left.png", "right.png"):
        (folder / name).write_text(name)
    (folder / "run.toml").write_text('scene = "scene.xml"\ntexture = "texture.png"\n')
    one = '{ mask = "left.png", jnd = 2 }'
    two = f'{one}, {{ mask = "right.png", jnd = -1, graded = true }}'
    regions = f"regions = [{{ label = 1, touch.region = [{one}] }}, {{ label = 2, touch.region = [{two}] }}]"
    text = HEAD.replace("gravel.toml", "run.toml") + AXES + regions
    (table,) = expand(load_study(written(folder, text))).tables
    left, right = (folder / "left.png", [2], False), (folder / "right.png", [-1], True)
    told = [
        [(region.mask, [goal for *_, goal in region.goals()], region.graded) for region in each]
        for each in (row.settings.touch.region for row in table.rows)
    ]
    assert told == [[left], [left, right]]


def test_rows_that_coincide_between_tables_are_one(study_file: Path) -> None:
    expanded = expand(load_study(study_file))
    assert [len(table.rows) for table in expanded.tables] == [2, 2]
    assert len(expanded.rows) == 4
    assert len(expand(load_study(study_file), quick=True).rows) == 1


def test_a_row_is_found_again_by_what_decides_its_run(tmp_path: Path, texture: Path) -> None:
    moved = tmp_path / "moved.exr"
    shutil.copy(texture, moved)
    first = load_run("gravel.toml", [f'texture="{texture}"', "height_scale=1.0"])
    same = [f'texture="{moved}"', "descent.steps=100", 'look.model="exact"']
    assert row_key(first) == row_key(load_run("gravel.toml", same))
    for other in ("descent.steps=99", "define.resolution=64", "touch.jnd=1", "seed=1"):
        assert row_key(first) != row_key(load_run("gravel.toml", [*same, other]))


def test_a_changed_default_raises_the_number_of_the_defaults(tmp_path: Path) -> None:
    """A new setting is recorded here; a default that changes raises `DEFAULTS` as well."""
    defaults = {name: repr(value) for name, value in run_keys().items()}
    found = hashlib.sha256(json.dumps(defaults, sort_keys=True).encode()).hexdigest()
    assert (DEFAULTS, found[:16]) == (1, "c6778d691a42964e")


def test_settings_at_their_defaults_are_not_in_the_key(tmp_path: Path) -> None:
    for name in ("scene.xml", "texture.png"):
        (tmp_path / name).write_text(name)
    path = tmp_path / "run.toml"
    path.write_text('scene = "scene.xml"\ntexture = "texture.png"\ntouch.jnd = 2\n')
    plain = row_key(load_run(path))
    for name, value in run_keys().items():
        if isinstance(value, (bool, int, float, str)) and not name.startswith("touch.skin"):
            stated = json.dumps(value)
            assert row_key(load_run(path, [f"{name}={stated}"])) == plain, name


@pytest.mark.parametrize("study", ["figure10", "figure15", "figure17", "figure19", "figure22", "front"])
def test_rows_that_are_committed_are_found(study: str) -> None:
    """Rows of committed studies are those of the study files, so that `--from` takes them over."""
    path = Path(__file__).parents[4] / "benchmarks" / "results" / "studies" / f"{study}.json"
    assert read_document(path).records.keys() == expand(load_study(study)).rows.keys()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("title = 3", "title: Input should be a valid string (given: 3)"),
        (f"{HEAD}", "tables: missing"),
        (f"{HEAD}tabels = 1\n{AXES}seed = [1]", "tabels: no such key; the nearest is tables"),
        (f"{HEAD}{AXES}seed = []", "tables.0.axes.seed: List should have at least 1 item"),
        (f"{HEAD}{AXES}seed = 1", "tables.0.axes.seed: Input should be a valid list"),
        (f'{HEAD}measures = ["smell"]\n{AXES}seed = [1]', "measures: smell: no such name; there are"),
        (f"{HEAD}{AXES}seed = [1]\n[quick.axes]\nseeds = [1]", "quick.axes: seeds: no such name"),
        (f'{HEAD}{AXES}seed = [1]\n[quick]\ntables = ["b"]', "quick.tables: b: no such name; there are a"),
        (f"{HEAD}{AXES}seed = [1]\n{AXES}seed = [2]", "tables: two are called a"),
        (HEAD.replace("gravel", "sand") + f"{AXES}seed = [1]", "base: sand.toml: no such file"),
        (HEAD.replace("gravel", "x" * 300) + f"{AXES}seed = [1]", ".toml: no such file"),
        (f"{HEAD}{AXES}touch.jndd = [1]", "a: touch.jndd: no such key of a run; the nearest is touch.jnd"),
        (f'{HEAD}{AXES}seed = ["x"]', "a: seed x: seed: Input should be a valid integer (given: 'x')"),
        (f"{HEAD}{AXES}free = [{{ seed = 1 }}]", "a: free: a value of several settings has a label"),
        (f'{HEAD}{AXES}free = [{{ label = "x", sead = 1 }}]', "a: free: sead: no such key of a run"),
        (f"{HEAD}[set]\nsead = 1\n{AXES}seed = [1]", "a: seed 1: sead: no such key; the nearest is seed"),
        (f"{HEAD}[set]\n{'a.' * 200}a = 1\n{AXES}seed = [1]", "set: a key has more than 8 parts"),
        (f'{HEAD}{AXES}"\\u001b[0m" = [1]', "tables.0.axes"),
        ("a = [", "not TOML"),
    ],
)
def test_a_fault_of_the_file_is_told_in_one_line(tmp_path: Path, text: str, fault: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        expand(load_study(path))
    assert fault in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_labels_are_numbers_or_short_texts(tmp_path: Path) -> None:
    values = '[1, 2.5, nan, true, 1979-05-27, "a\\u001bb", "%s"]' % ("x" * 999)
    (table,) = expand(load_study(written(tmp_path, f"{HEAD}{AXES}define.x = {values}\n"))).tables
    assert table.axes["define.x"] == (1, 2.5, "nan", True, "1979-05-27", "a?b", "x" * 80)


def test_a_faulty_row_does_not_take_the_others_along(tmp_path: Path) -> None:
    axes = 'seed = [1, 1, 2]\ntexture = ["gravel", "nowhere.png"]\n'
    other = '[[tables]]\nname = "b"\n[tables.axes]\n"touch.jnt" = [1]\n'
    expanded = expand(load_study(written(tmp_path, f"{HEAD}{AXES}{axes}{other}")))
    assert [row.settings.seed for row in expanded.rows.values()] == [1, 2]
    assert [line.partition("own.toml: ")[2] for line in expanded.faults] == [
        "b: touch.jnt: no such key of a run; the nearest is touch.jnd",
        f"a: seed 1, texture nowhere: texture: {tmp_path}/nowhere.png: no such file",
        "a: seed 1, texture gravel: is the same run as seed 1, texture gravel; it is shown once",
        f"a: seed 1, texture nowhere: texture: {tmp_path}/nowhere.png: no such file",
        f"a: seed 2, texture nowhere: texture: {tmp_path}/nowhere.png: no such file",
    ]


def test_rows_are_counted_before_any_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = list(range(400))
    other = AXES.replace('"a"', '"b"')
    text = f"{HEAD}{AXES}seed = {numbers}\n{other}seed = {numbers}\ndescent.steps = {numbers}\n"
    study = load_study(written(tmp_path, text))
    monkeypatch.setattr(rows, "_run", lambda *_: pytest.fail("a row is built"))
    with pytest.raises(InputError, match=r"own\.toml: tables: 160400 rows are more than 100000$"):
        expand(study)


def test_a_folder_without_textures_is_refused(tmp_path: Path) -> None:
    study = load_study(written(tmp_path, f'{HEAD}{AXES}texture = ["gravel"]\n'))
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: holds no height map"):
        expand(study, textures=tmp_path / "empty")
    with pytest.raises(InputError, match="nowhere: no such folder"):
        expand(study, textures=tmp_path / "nowhere")
    with pytest.raises(InputError, match="no table has an axis texture"):
        expand(load_study(written(tmp_path, f"{HEAD}{AXES}seed = [1]\n")), textures=tmp_path / "empty")
