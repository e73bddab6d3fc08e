"""A run file says what is wanted; whatever it says wrong is told in one line that names file and key."""

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from optimize.descent.methods import METHODS
from optimize.settings import run_file as config
from relief.ground.errors import InputError

SCENES = Path(__file__).resolve().parents[3] / "mitsuba_scenes"


@pytest.fixture
def run_file(tmp_path: Path) -> Path:
    """A run file with a scene and a texture that exist, which is all that loading it looks at."""
    for name in ("studio.xml", "relief.png"):
        (tmp_path / name).write_bytes(b"")
    return write(tmp_path, "[touch]\nroughness = 0.07\n")


def write(folder: Path, rest: str, first: str = "") -> Path:
    path = folder / "run.toml"
    path.write_text(f'scene = "studio.xml"\ntexture = "relief.png"\nrelief_mm = 1.2\n{first}\n{rest}')
    return path


def fault(path: Path, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        config.load_run(path, overrides)
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_paths_are_relative_to_the_run_file(
    run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("/")
    run = config.load_run(run_file)
    assert run.scene == tmp_path / "studio.xml"
    assert run.texture == tmp_path / "relief.png"


def test_defaults_are_those_of_the_design(run_file: Path) -> None:
    run = config.load_run(run_file)
    assert (run.touch.young_modulus_mpa, run.touch.poisson_ratio, run.touch.force_n) == (0.5, 0.48, 10.0)
    assert (run.descent.method, run.descent.learning_rate, run.descent.regularisation) == (
        "gauss-newton",
        0.027,
        0.06,
    )
    assert (run.touch.model, run.look.model, run.verify.model) == ("layer", "exact", "fem")


def test_touch_has_a_net_and_the_look_has_none(run_file: Path) -> None:
    assert config.load_run(run_file, ["touch.model=net"]).touch.model == "net"
    with pytest.raises(InputError, match=r"look\.model: Input should be 'exact', .* \(given: 'net'\)$"):
        config.load_run(run_file, ["look.model=net"])


def test_methods_take_keys_that_run_files_have() -> None:
    keys = set(config.run_keys())
    for name, method in METHODS.items():
        assert method.takes <= keys, name


def test_a_run_cannot_be_changed(run_file: Path) -> None:
    run = config.load_run(run_file)
    with pytest.raises(ValidationError):
        run.seed = 1


@pytest.mark.parametrize("name", ["gravel", "brick", "grass"])
def test_the_examples_load(name: str) -> None:
    run = config.load_run(SCENES / f"{name}.toml")
    assert run.texture.name == f"{name}.png"
    assert run.touch.numbers()["jnd"]


def test_the_resolved_run_loads_to_the_same_from_another_folder(run_file: Path, tmp_path: Path) -> None:
    run = config.load_run(run_file, ["seed=7", "touch.contact_area_scale=0.8", "define.resolution=64"])
    elsewhere = tmp_path / "elsewhere" / "run.toml"
    elsewhere.parent.mkdir()
    elsewhere.write_text(config.dump_resolved(run))
    assert config.load_run(elsewhere) == run


def test_a_graded_region_is_written_and_read_again(
    run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m.png").write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    region = 'touch.region=[{mask="m.png", jnd=2, graded=true}, {mask="m.png", jnd=1}]'
    run = config.run_from_scene("studio.xml", "relief.png", ["relief_mm=1", region])
    assert [one.graded for one in run.touch.region] == [True, False]
    resolved = tmp_path / "elsewhere" / "run.toml"
    resolved.parent.mkdir()
    resolved.write_text(config.dump_resolved(run), encoding="utf-8")
    assert config.load_run(resolved) == run
    of_file = config.load_run(write(tmp_path, '[[touch.region]]\nmask = "m.png"\ngraded = true\njnd = 2'))
    assert of_file.touch.region == run.touch.region[:1]
    line = fault(write(tmp_path, '[[touch.region]]\nmask = "m.png"\ngraded = "yes"\njnd = 2'))
    assert "touch.region.0.graded: " in line and "boolean" in line


def test_a_path_with_quotes_and_backslashes_survives(tmp_path: Path) -> None:
    odd = tmp_path / 'a "b" \\ é.png'
    scene = tmp_path / "studio.xml"
    for path in (odd, scene):
        path.write_bytes(b"")
    run = config.run_from_scene(scene, odd, ["touch.jnd=-1"])
    resolved = tmp_path / "run.toml"
    resolved.write_text(config.dump_resolved(run), encoding="utf-8")
    assert config.load_run(resolved) == run


def test_a_scene_and_a_texture_make_a_run(
    run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = config.run_from_scene("studio.xml", "relief.png", ["touch.jnd=1.5", "relief_mm=1"])
    assert run.scene == tmp_path / "studio.xml"
    assert run.touch.numbers()["jnd"] == 1.5


def test_overrides_are_toml_values_and_bare_words(run_file: Path) -> None:
    run = config.load_run(
        run_file, ["descent.method=adam", "descent.shadow_edges=false", 'look.model="exact"', "size_mm=20"]
    )
    assert run.descent.method == "adam"
    assert run.descent.shadow_edges is False
    assert run.size_mm == 20.0


def test_the_papers_stopping_rule_comes_with_its_tolerance_and_constant_weights(
    run_file: Path, tmp_path: Path
) -> None:
    run = config.load_run(run_file, ["descent.method=adam", "descent.stop=paper"])
    assert (run.descent.tolerance, run.descent.growth) == (config.PAPER_TOLERANCE, 1.0)
    stop = ["descent.method=adam", "descent.stop=paper"]
    own = config.load_run(
        run_file, [*stop, "descent.tolerance=0.05", "descent.growth=3", "descent.smoothing=20"]
    )
    assert (own.descent.tolerance, own.descent.growth, own.descent.smoothing) == (0.05, 3.0, 20.0)
    resolved = tmp_path / "resolved.toml"
    resolved.write_text(config.dump_resolved(own), encoding="utf-8")
    assert config.load_run(resolved) == own
    # A method without stopping rules keeps its own tolerance where runs share the rule.
    other = config.load_run(run_file, ["descent.stop=paper"], shared=["descent.stop"])
    assert other.descent.tolerance == 0.01
    plain = config.load_run(run_file)
    assert (plain.descent.tolerance, plain.descent.growth, plain.look.weight) == (0.01, 30.0, None)


@pytest.mark.parametrize(
    "override",
    [
        "descent.stop=never",
        "descent.growth=0.5",
        "descent.growth=1e9",
        "descent.smoothing=-1",
        "descent.smoothing=1e9",
    ],
)
def test_settings_of_adam_have_bounds(run_file: Path, override: str) -> None:
    with pytest.raises(InputError, match=override.partition("=")[0].replace(".", r"\.")):
        config.load_run(run_file, [override])


def test_an_overridden_target_replaces_the_other_way_to_state_it(run_file: Path) -> None:
    run = config.load_run(run_file, ["touch.jnd=2"])
    assert run.touch.numbers()["jnd"] == 2
    assert "roughness" not in run.touch.numbers()


def test_an_overridden_path_is_relative_to_the_working_directory(
    run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "mine.png").write_bytes(b"")
    monkeypatch.chdir(tmp_path / "here")
    assert config.load_run(run_file, ["texture=mine.png"]).texture == tmp_path / "here" / "mine.png"


@pytest.mark.parametrize(
    ("touch", "key"),
    [
        ("roughness = -0.1", "touch.roughness"),
        ("roughness = true", "touch.roughness"),
        ('roughness = "0.07"', "touch.roughness"),
        ("roughness = nan", "touch.roughness"),
        ("roughness = inf", "touch.roughness"),
        ("jnd = 100", "touch.jnd"),
        ("jnd = 1\nforce_n = -10", "touch.force_n"),
        ("jnd = 1\npoisson_ratio = 0.4995", "touch.poisson_ratio"),
        ("jnd = 1\nyoung_modulus_mpa = 0", "touch.young_modulus_mpa"),
        ('jnd = 1\nmodel = "fem"', "touch.model"),
        ("contact_area_mm2 = 2e6", "touch.contact_area_mm2"),
        ("jnd = 1\nroughness = 0.1", "exclude each other"),
        ("contact_area_mm2 = 40\ncontact_area_scale = 0.8", "exclude each other"),
        ("", "a target is missing"),
        ('jnd = 1\n[look]\nmodel = "quick"', "look.model"),
        ("jnd = 1\nthickness_mm = 1e9", "touch.thickness_mm"),
        ("jnd = 1\n[look]\nweight = -1", "look.weight"),
        ("jnd = 1\n[look]\nsamples = 0", "look.samples"),
        ("jnd = 1\n[descent]\nsteps = 0", "descent.steps"),
        ("jnd = 1\n[descent]\ntolerance = 1.5", "descent.tolerance"),
        ('jnd = 1\n[verify]\nmodel = "truth"', "verify.model"),
        ('jnd = 1\nfingers = "many"', "touch.fingers"),
        ("jnd = 1\nfingers_weight = 0", "touch.fingers_weight"),
        ('contact_area_mm2 = 40\nfingers = "range"', "touch: fingers: a range of fingers needs a goal of"),
        ('jnd = 1\nfingers = "range"\n[descent]\nmethod = "adam"', "touch.fingers: adam steers one finger"),
    ],
)
def test_a_value_out_of_range_is_named(run_file: Path, touch: str, key: str) -> None:
    line = fault(write(run_file.parent, f"[touch]\n{touch}\n"))
    assert line.startswith(str(run_file))
    assert key in line


def test_a_contact_area_is_compared_with_the_plate_as_soon_as_its_size_is_known(run_file: Path) -> None:
    touch = "[touch]\ncontact_area_mm2 = 200.0\n"
    assert "touch.contact_area_mm2" in fault(write(run_file.parent, touch, "size_mm = 10"))
    assert config.load_run(write(run_file.parent, touch)).size_mm is None


@pytest.mark.parametrize("key", ["size_mm", "relief_mm", "height_scale"])
def test_lengths_and_scales_have_bounds(run_file: Path, key: str) -> None:
    for value in ("0", "-1", "1e300", "inf", "nan", "1e-9", "true", '"1"', "9" * 400):
        line = fault(run_file, f"{key}={value}")
        assert line.startswith(f"overrides: {key}: ") and len(line) < 600


@pytest.mark.parametrize(
    ("first", "rest", "wrong", "right"),
    [
        ("releif = 1", "[touch]\njnd = 1", "releif", "relief_mm"),
        ("", "[touch]\njnd = 1\nforce = 3", "touch.force", "touch.force_n"),
        ("", "[touch]\njnd = 1\n[descent]\nmehtod = 'adam'", "descent.mehtod", "descent.method"),
        ("", "[touch]\njnd = 1\n[luck]", "luck", "look"),
        ("", "[[touch.region]]\nmask = 'm.png'\njdn = 1", "touch.region.0.jdn", "touch.region.0.jnd"),
    ],
)
def test_an_unknown_key_is_answered_with_the_nearest(
    run_file: Path, first: str, rest: str, wrong: str, right: str
) -> None:
    line = fault(write(run_file.parent, rest, first))
    assert line.endswith(f"{wrong}: no such key; the nearest is {right}")


@pytest.mark.parametrize("key", ["scene", "texture"])
def test_a_path_that_no_file_system_takes_is_no_such_file(run_file: Path, key: str) -> None:
    with pytest.raises(InputError, match=rf"{key}: .*xxx: no such file"):
        config.load_run(run_file, [f"{key}={'x' * 300}"])
    with pytest.raises(InputError, match="no such file"):
        config.load_run("x" * 300 + ".toml")


def test_a_value_of_two_lines_is_told_in_one(run_file: Path) -> None:
    with pytest.raises(InputError) as caught:
        config.load_run(run_file, ['look.model="two\\nlines\\u001b[2J"'])
    assert str(caught.value).isprintable()


def test_what_is_missing_is_named(run_file: Path) -> None:
    run_file.write_text('scene = "studio.xml"\n[touch]\njnd = 1\n')
    assert fault(run_file).endswith("texture: missing")
    assert "no such file" in fault(run_file.parent / "other.toml")
    assert "texture: " in fault(write(run_file.parent, "[touch]\njnd = 1\n"), "texture=absent.png")


@pytest.mark.parametrize(
    "content", [b"scene = ", b"\xff\xfe", b"a = " + b"[" * 20000], ids=["cut", "binary", "deep"]
)
def test_what_is_not_toml_is_named(run_file: Path, content: bytes) -> None:
    run_file.write_bytes(content)
    assert "not TOML" in fault(run_file)


@pytest.mark.parametrize("content", ["{}=1", "[{}]", "a={{{}=1}}"], ids=["key", "table", "inline"])
def test_a_key_of_many_parts_is_refused_at_once(run_file: Path, content: str) -> None:
    run_file.write_text(content.format(".".join("a" * 300_000)))
    assert "dots" in fault(run_file)


@pytest.mark.parametrize("override", ["seed", "=3", "touch..jnd=1", "seed.x=1", "seed=1\nsize_mm=3"])
def test_an_override_that_is_none_is_named(run_file: Path, override: str) -> None:
    with pytest.raises(InputError, match=r"seed|=3|jnd"):
        config.load_run(run_file, ["seed=1", override])


def test_a_range_of_fingers_has_a_weight(run_file: Path) -> None:
    touch = config.load_run(run_file, ["touch.fingers=range", "touch.fingers_weight=5"]).touch
    assert (touch.fingers, touch.fingers_weight) == ("range", 5.0)
    assert config.load_run(run_file).touch.fingers == "one"


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (("descent.smoothing=5",), "descent.smoothing: has no effect by gauss-newton; adam takes it"),
        (("descent.learning_rate=0.01",), "descent.learning_rate: has no effect by gauss-newton; adam"),
        (("descent.growth=1",), "descent.growth: has no effect by gauss-newton; adam takes it"),
        (("look.samples=4",), "look.samples: has no effect by gauss-newton; adam takes it"),
        (("descent.stop=paper",), "descent.stop: has no effect by gauss-newton; adam takes it"),
        (("touch.fingers_weight=5",), 'touch.fingers_weight: has no effect without touch.fingers = "range"'),
        (("descent.method=adam", "touch.fingers_weight=5"), "touch.fingers_weight: has no effect by adam"),
        (
            ("descent.method=adam", "look.model=fast", "look.samples=4"),
            "look.samples: has no effect by the l",
        ),
        (("look.model=shading", "descent.shadow_edges=false"), "descent.shadow_edges: has no effect by the"),
        (("descent.method=scaling", "look.model=fast"), "look.model: has no effect by scaling; gauss-newton"),
        (("descent.method=scaling", "look.weight=2"), "look.weight: has no effect by scaling; gauss-newton"),
        (("descent.method=scaling", "look.samples=4"), "look.samples: has no effect by scaling; adam takes"),
        (("descent.method=scaling", "descent.regularisation=1"), "descent.regularisation: has no effect by"),
        (("descent.method=scaling", "descent.steps=7"), "descent.steps: has no effect by scaling; gauss-n"),
        (("verify.model=layer", "verify.resolution=32"), "verify.resolution: has no effect without verify."),
        (("verify.model=none", "verify.corrections=2"), "verify.corrections: has no effect without verify."),
        (("texture=mm.exr", "relief_mm=1"), "relief_mm: is for pictures; the texture holds mm, which"),
        (("height_scale=2",), "height_scale: is for files that hold mm; a picture is scaled by relief_mm"),
    ],
)
def test_a_setting_without_effect_is_refused_unless_runs_share_it(
    run_file: Path, settings: tuple[str, ...], line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(run_file.parent)
    Path("mm.exr").write_bytes(b"")
    with pytest.raises(InputError, match=f"^{re.escape(f'overrides: {line}')}"):
        config.load_run(run_file, settings)
    run = config.load_run(run_file, settings, shared=[line.partition(":")[0]])
    assert [f"{key}: {reason}".startswith(line) for key, reason in run.without_effect().items()] == [True]
    # All of its settings are written, and a run goes on with what it has.
    Path("run.toml").write_text(config.dump_resolved(run), encoding="utf-8")
    assert config.load_settings(Path("run.toml")) == run


def test_what_is_so_anyway_may_be_said(run_file: Path) -> None:
    adam = ("descent.method=adam", "look.model=auto", "look.samples=4")
    run = config.load_run(run_file, ["verify.model=layer", "verify.corrections=0", *adam])
    assert run.without_effect() == {}
    run_file.write_text(config.dump_resolved(run), encoding="utf-8")
    assert config.load_run(run_file, ["seed=3"]).seed == 3


def test_a_key_of_a_file_that_an_override_leaves_without_effect_is_told(
    run_file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (run_file.parent / "mm.exr").write_bytes(b"")
    other = f"texture={run_file.parent / 'mm.exr'}"
    assert config.load_run(run_file, [other]).texture.name == "mm.exr"
    assert caplog.messages == [
        f"{run_file}: relief_mm: is for pictures; the texture holds mm, which height_scale scales"
    ]
    with pytest.raises(InputError, match="relief_mm: is for pictures"):
        config.load_run(run_file, [other, "relief_mm=2"])
    run_file.write_text(run_file.read_text() + '[descent]\nmethod = "adam"\nsmoothing = 100\n')
    assert config.load_run(run_file, ["descent.method=gauss-newton"]).descent.smoothing == 100.0
    assert caplog.messages[1:] == [
        f"{run_file}: descent.smoothing: has no effect by gauss-newton; adam takes it"
    ]
