"""The command does what its help says, tells what it did, and starts quickly."""

import importlib.metadata
import json
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

import tactile
from optimize.descent.stop_reason import StopReason
from optimize.run_directory import finished_run
from optimize.run_directory.results import write_relief
from optimize.runs import job
from optimize.settings import run_file as config
from optimize.verification.verification import Verification
from relief.ground.errors import InputError
from relief.ground.formatting import between, number, percent, plus_minus
from relief.heightmap import load_heights, save_heights_exr
from relief.relief import Relief
from retouch.commands import main as cli
from retouch.commands import optimize as cli_optimize
from retouch.commands.main import main
from retouch.commands.summary import summary
from retouch.verbs import runs
from tactile.measures import measure_touch
from tests.retouch.pages.plausible import FINGERS, content, of_a_print, verified
from visual.exact.view import View
from visual.scene import Scene

ROOT = Path(__file__).resolve().parents[3]
STUDIO = ROOT / "mitsuba_scenes" / "studio.xml"
SMALL = ["-D", "resolution=32", "-D", "texture=waves.exr"]
FAST = ["--set", "descent.steps=2", "--set", "verify.samples=4", "--set", "verify.resolution=16", *SMALL]


@pytest.fixture(autouse=True)
def waves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """In an empty working directory, a relief of smooth waves, 0 to 0.6 mm, 32 x 32 over 10 mm."""
    monkeypatch.chdir(tmp_path)
    at = (np.arange(32) + 0.5) / 32
    relief = 0.3 + 0.15 * np.sin(8 * np.pi * at)[:, None] + 0.15 * np.cos(6 * np.pi * at)[None, :]
    save_heights_exr("waves.exr", relief)
    return tmp_path / "waves.exr"


def output(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """What a command that succeeds prints."""
    assert main(argv) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    return printed.out


def python(script: str, *argv: str) -> subprocess.CompletedProcess[str]:
    """A script in a process of its own, with the checkout's packages."""
    script = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{script}"
    return subprocess.run([sys.executable, "-c", script, *argv], capture_output=True, text=True, check=False)


def exr(path: Path) -> np.ndarray:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.array(file.parts[0].channels["Y"].pixels)


# Starting


def test_help_shows_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    text = capsys.readouterr().out
    assert all(f"    {verb} " in text for verb in cli.VERBS)


@pytest.mark.parametrize("verb", cli.VERBS)
def test_the_help_of_a_verb_has_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([verb, "--help"])
    text = capsys.readouterr().out
    assert f"\n  retouch {verb} " in text or f"\n  retouch {verb}\n" in text


def test_version_is_that_of_the_package(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.metadata, "version", {"retouch": "1.2.3"}.__getitem__)
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == "retouch 1.2.3\n"


def loaded(*argv: str) -> tuple[int, set[str]]:
    """The exit status of a command in a process of its own, and the packages that it has imported."""
    script = """
from retouch.commands.main import main
try:
    status = main(sys.argv[1:])
except SystemExit as end:
    status = end.code
print(status, *{name.partition(".")[0] for name in sys.modules})
"""
    status, *packages = python(script, *argv).stdout.splitlines()[-1].split()
    return int(status), set(packages)


HEAVY = {"torch", "scipy", "skfem", "pypardiso", "mitsuba", "drjit", "trimesh", "skimage", "jinja2"}
"""Packages that take a good part of a second to import each."""


@pytest.mark.parametrize("argv", [["--help"], *([verb, "--help"] for verb in cli.VERBS)], ids=" ".join)
def test_help_imports_nothing_heavy(argv: list[str]) -> None:
    status, packages = loaded(*argv)
    assert status == 0
    assert packages & {*HEAVY, "numpy", "PIL", "rich", "pydantic"} == set()


@pytest.mark.parametrize(
    "command",
    [
        *("", "nonsense", "optimize --nonsense", "evaluate waves.exr --size-mm wide"),
        *("optimize absent.toml", "optimize torn.toml", "optimize absent.xml --texture waves.exr --jnd 1"),
        *("optimize gravel.toml --set touch.rough=1", "optimize gravel.toml --set touch.jnd=many"),
        *("optimize gravel.toml --set verify.resolution=33", "optimize gravel.toml --texture absent.exr"),
        *("optimize studio.xml", "optimize studio.xml --texture waves.exr", "resume absent"),
        *("optimize waves.exr", "optimize waves.exr --scene absent --jnd 1", "optimize torn.png --jnd 1"),
        *("evaluate absent.exr", "evaluate waves.exr --force-n -1", "export absent.exr -o plate.stl"),
        *("render absent.xml", "render studio.xml --texture absent.exr", "render studio.xml --relief-mm 1"),
    ],
)
def test_what_is_refused_is_refused_before_anything_heavy_is_imported(command: str) -> None:
    Path("torn.toml").write_text("scene = ")
    Path("torn.png").write_text("nothing")
    status, packages = loaded(*command.split())
    assert status == cli.BAD_INPUT
    assert packages & HEAVY == set()


@pytest.mark.slow
@pytest.mark.parametrize("argv", [["evaluate", "waves.exr"], ["export", "waves.exr", "-o", "waves.stl"]])
def test_what_only_touches_does_not_load_mitsuba(argv: list[str]) -> None:
    status, packages = loaded(*argv)
    assert status == 0
    assert packages & {"mitsuba", "drjit"} == set()


@pytest.mark.slow
def test_a_reader_who_leaves_early_is_no_error(waves: Path) -> None:
    command = [sys.executable, "-m", "optimize", "evaluate", str(waves), "--json"]
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    complaints = process.stderr.read()
    process.stderr.close()
    assert process.wait() == cli.BROKEN_PIPE
    # A slow machine says what it does.
    assert b"retouch" not in complaints and b"Error" not in complaints


def test_ctrl_c_needs_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(tactile, "press", interrupt)
    assert main(["evaluate", "waves.exr"]) == 130


# retouch evaluate


def test_evaluate_tells_the_librarys_numbers(waves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (entry,) = json.loads(output(capsys, "evaluate", str(waves), "--force-n", "5", "--json"))
    skin = tactile.Skin(force_n=5.0)
    touch = tactile.press(load_heights(waves), skin=skin)
    assert entry["texture"] == str(waves)
    assert entry["roughness"] == pytest.approx(tactile.roughness(touch.strain).item(), rel=1e-9)
    assert entry["contact_area_mm2"] == pytest.approx(tactile.contact_area(touch.gap).item(), rel=1e-9)
    assert entry["contact_fraction"] == touch.contact_fraction.item()
    assert (entry["size_mm"], entry["model"], entry["skin"]["force_n"]) == (10.0, "layer", 5.0)
    assert "jnd_from_first" not in entry


def test_evaluate_compares_with_the_first(waves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr("low.exr", 0.3 * load_heights(waves))
    save_heights_exr("flat.exr", np.full((32, 32), 0.5))
    first, low, flat = json.loads(output(capsys, "evaluate", "waves.exr", "low.exr", "flat.exr", "--json"))
    assert first["jnd_from_first"] == 0.0
    assert low["jnd_from_first"] == pytest.approx(tactile.jnd_apart(low["roughness"], first["roughness"]))
    assert low["jnd_from_first"] < 0.0
    assert flat["jnd_from_first"] is None
    assert flat["contact_fraction"] == 1.0


def test_evaluate_prints_a_line_for_each_texture(capsys: pytest.CaptureFixture[str]) -> None:
    name = "a relief with a rather [long] name that would not fit into a terminal of eighty columns.exr"
    Path("waves.exr").rename(name)
    header, first, second, skin, contact = output(capsys, "evaluate", name, name).splitlines()
    assert header.split("  ")[0] == "texture"
    assert first.startswith(name) and second.startswith(name)
    assert "mm²" in first and "%" in first
    assert "10 N" in skin and "counts skin close by" in contact


def test_relief_mm_is_for_pictures_and_height_scale_for_files_that_hold_mm(
    waves: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heights = load_heights(waves)
    Image.fromarray(np.rint(heights / heights.max() * 65535).astype(np.uint16)).save("waves.png")
    relief = ["--relief-mm", str(heights.max())]
    first, second = json.loads(output(capsys, "evaluate", "waves.png", "waves.exr", *relief, "--json"))
    assert abs(second["jnd_from_first"]) < 1e-3
    scaled = ["evaluate", "waves.exr", "waves.png", *relief, "--height-scale", "0.5", "--json"]
    low, high = json.loads(output(capsys, *scaled))
    touch = tactile.press(0.5 * heights)
    assert low["roughness"] == pytest.approx(tactile.roughness(touch.strain).item(), rel=1e-9)
    assert high["roughness"] == first["roughness"]


def test_size_and_relief_come_along_with_the_heights_of_a_run(
    waves: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pressed: list[tuple[float, float]] = []
    measure = measure_touch

    def measured(relief: Relief, *others: Any, **more: Any) -> Any:
        pressed.append((relief.heights.max(), relief.width_mm))
        return measure(replace(relief, width_mm=10.0), *others, **more)

    monkeypatch.setattr("retouch.verbs.evaluation.measure_touch", measured)
    heights = load_heights(waves)
    write_relief(Path("run"), Relief(heights, 20.0))
    files = ("run/heights.png", "run/heights.exr", "waves.exr")
    # The finger presses on 10 mm of a plate, however wide it is.
    assert "10 N on 10 x 10 mm.\n" in output(capsys, "evaluate", *files)
    assert pressed == [(pytest.approx(heights.max()), size) for size in (20.0, 20.0, 10.0)]
    assert main(["evaluate", files[0], "--size-mm", "10", "--json"]) == 0
    printed = capsys.readouterr()
    (entry,) = json.loads(printed.out)
    assert entry["size_mm"] == pressed[-1][1] == 10.0
    assert printed.err == "run/heights.png: size_mm: 10 replaces the 20 of the file's header\n"
    assert " 20 x 20 x " in output(capsys, "export", "run/heights.png", "-o", "plate.stl")
    assert main(["export", "run/heights.png", "-o", "a.stl", "--size-mm", "15"]) == 0
    assert " 15 x 15 x " in capsys.readouterr().out


# retouch render


def test_render_writes_a_picture_of_every_condition(capsys: pytest.CaptureFixture[str]) -> None:
    printed = output(
        capsys, "render", str(STUDIO), *SMALL, "-D", "relief_mm=1", "--samples", "4", "-o", "a/b"
    )
    conditions = ("light-10", "light-130", "light-250")
    names = sorted(f"{name}.{suffix}" for name in conditions for suffix in ("exr", "png"))
    assert sorted(path.name for path in Path("a/b").iterdir()) == names
    assert sorted(Path("a").iterdir()) == [Path("a/b")]
    for name in conditions:
        radiance = exr(Path(f"a/b/{name}.exr"))
        assert radiance.shape == (32, 32) and radiance.dtype == np.float32
        # The studio's lights give a white plate that faces them radiance 1.
        shown = np.asarray(Image.open(f"a/b/{name}.png"), dtype=np.float64) / 255
        linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(linear, np.clip(radiance, 0, 1), atol=0.006)
        (line,) = (line for line in printed.splitlines() if line.startswith(name))
        assert float(line.split()[1]) == pytest.approx(radiance.mean(), rel=0.01)


@pytest.mark.slow
def test_render_tells_the_noise_of_each_picture(capsys: pytest.CaptureFixture[str]) -> None:
    errors = []
    for samples in ("16", "256"):
        printed = output(capsys, "render", str(STUDIO), *SMALL, "--samples", samples)
        assert f"{samples} samples each" in printed
        (error,) = re.findall(r"light-10 +\S+ +(\S+)\s%", printed)
        errors.append(float(error))
    # Strata make it fall faster than one over the root of the samples.
    assert 4.0 < errors[0] / errors[1] < 16.0


@pytest.mark.slow
def test_render_shows_another_texture_and_repeats_itself(capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr("flat.exr", np.zeros((32, 32)))
    same = ["render", str(STUDIO), *SMALL, "--samples", "4", "--seed", "5"]
    output(capsys, *same, "-o", "one")
    output(capsys, *same, "-o", "two")
    output(capsys, *same, "-o", "flat", "--texture", "flat.exr")
    one, two, flat = (exr(Path(folder, "light-10.exr")) for folder in ("one", "two", "flat"))
    assert (one == two).all()
    assert flat.std() < 0.2 * one.std()


def test_render_needs_no_llvm(capsys: pytest.CaptureFixture[str]) -> None:
    printed = output(capsys, "render", str(STUDIO), *SMALL, "--samples", "1", "-m", "scalar_rgb")
    assert "scalar_rgb" in printed
    assert Path("renders/studio/light-10.png").is_file()


EXPLAIN = ["render", str(STUDIO), *SMALL, "--explain"]


def test_explain_tells_a_line_for_each_rule_and_writes_nothing(
    waves: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = output(capsys, *EXPLAIN, "-o", "out", "--samples", "7").splitlines()
    sentences = {line.split("   ")[0]: line for line in lines}
    assert len(sentences) == len(lines)
    assert "from waves.exr" in sentences["plate"] and "32 x 32 pixels, 7 samples" in sentences["camera"]
    assert "azimuth 250°, elevation 35°" in sentences["light-250"]
    assert "4 are rendered" in sentences["pictures"]
    assert "optimize can" in sentences["gradients"]
    assert list(waves.parent.iterdir()) == [waves]


@pytest.mark.slow
def test_explain_makes_no_scene_and_renders_no_picture() -> None:
    script = """
import mitsuba
from visual.backend import llvm
llvm.prepare()
mitsuba.set_variant("scalar_rgb")
work = []
for owner, name in ((mitsuba, "render"), (mitsuba, "load_dict"), (mitsuba.parser, "instantiate")):
    real = getattr(owner, name)
    setattr(owner, name, lambda *a, real=real, name=name, **o: [work.append(name), real(*a, **o)][1])
from retouch.commands.main import main
print(main(sys.argv[1:]), len(work))
"""
    assert python(script, *EXPLAIN).stdout.splitlines()[-1] == "0 0"
    assert int(python(script, *EXPLAIN[:-1], "--samples", "1").stdout.split()[-1]) > 4


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["absent.xml"], "absent.xml: no such file"),
        ([str(STUDIO), "-D", "resolutoin=16"], "resolution"),
        ([str(STUDIO), "--texture", "absent.exr"], "absent.exr: no such file"),
        ([str(STUDIO), "--relief-mm", "2"], "--relief-mm"),
        ([str(STUDIO), "-m", "llvm_ad_mno"], "llvm_ad_mono"),
    ],
    ids=["scene", "parameter", "texture", "relief", "variant"],
)
def test_explain_refuses_what_render_refuses(
    argv: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    refusals = []
    for more in ([], ["--explain"]):
        assert main(["render", *argv, *more]) == 2
        printed = capsys.readouterr()
        assert printed.out == ""
        refusals.append(printed.err)
    assert refusals[0] == refusals[1]
    assert named in refusals[0] and len(refusals[0].splitlines()) == 1


# retouch optimize, retouch resume


def options(*argv: str) -> config.Run:
    """The run that these arguments of ``retouch optimize`` ask for."""
    return cli_optimize.load(cli.parse(["optimize", *argv]))


def test_fast_chooses_the_fast_models_and_set_wins_over_it() -> None:
    gravel = str(ROOT / "mitsuba_scenes" / "gravel.toml")
    run = options(gravel, "--fast")
    assert (run.touch.model, run.look.model) == ("quick", "auto")
    mixed = options(gravel, "--fast", "--set", "look.model=exact")
    assert (mixed.touch.model, mixed.look.model) == ("quick", "exact")


def test_fast_is_no_target(waves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["optimize", str(STUDIO), "--texture", str(waves), "--fast"]) == 2
    assert "no target" in capsys.readouterr().err


def test_options_win_over_the_run_file() -> None:
    run_file = str(STUDIO.with_name("gravel.toml"))
    assert options(run_file).touch.numbers()["jnd"] == 2.0
    assert options(run_file, "--jnd", "-1").touch.numbers()["jnd"] == -1.0
    rough = options(run_file, "--roughness", "0.07", "--contact-area-scale", "1.2", "--seed", "3")
    assert rough.touch.numbers() == {"roughness": 0.07, "contact_area_scale": 1.2}
    assert rough.seed == 3
    other = options(run_file, "--texture", "waves.exr", "--height-scale", "0.5", "--set", "look.weight=2")
    assert (other.texture, other.height_scale, other.look.weight) == (Path("waves.exr").absolute(), 0.5, 2.0)


@pytest.mark.parametrize(
    "value", ["1e-3", "true", "a=b", 'a "b"\\c', "x.exr", "007", "", "Öl \N{GRINNING FACE}"]
)
def test_a_scenes_parameter_arrives_as_it_was_typed(value: str) -> None:
    run = options(str(STUDIO), "--texture", "waves.exr", "--jnd", "1", "-D", f"texture={value}")
    assert run.define == {"texture": value}


@pytest.mark.slow
def test_optimize_tells_everything_on_one_screen(waves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["optimize", str(STUDIO), "--texture", "waves.exr", "--jnd", "0.3", *FAST])
    result = json.loads(Path("runs/waves/result.json").read_text())
    assert status == (0 if result["stop"]["reason"] in ("converged", "step_limit") else 3)
    screen = capsys.readouterr().out
    assert len(screen.splitlines()) < 20
    for text in (
        result["stop"]["message"],
        f"target {number(result['touch']['target_roughness'])}",
        f"achieved {number(result['touch']['roughness'])}",
        "JND rougher",
        "of 100 tries",
        "runs/waves/report.html",
        "runs/waves/plate.stl",
    ):
        assert text in screen
    assert main(["resume", "runs/waves", "-q"]) == status
    assert capsys.readouterr().out == ""
    # The run has ended: no need to load what computes.
    again, packages = loaded("resume", "runs/waves")
    assert again == status and packages & HEAVY == set()
    assert main(["resume", "runs/waves", "--json"]) == status
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert result.items() <= document.items()
    assert (document["run_dir"], document["exit_status"]) == ("runs/waves", status)
    assert "runs/waves/plate.stl" in document["files"]
    assert "this run has ended" in printed.err
    settings = Path("runs/waves/run.toml")
    settings.write_text(settings.read_text().replace("samples = 4", "samples = 5"))
    assert finished_run.finished(Path("runs/waves")) is None
    settings.write_text(settings.read_text().replace("samples = 5", "samples = 4"))
    for reason in ("interrupted", "\x1b[2J"):
        damaged = result | {"stop": result["stop"] | {"reason": reason}}
        Path("runs/waves/result.json").write_text(json.dumps(damaged))
        assert finished_run.finished(Path("runs/waves")) is None
    for bad in (float("nan"), float("inf"), 10**400):
        damaged = result | {"look": result["look"] | {"change_percent": bad}}
        Path("runs/waves/result.json").write_text(json.dumps(damaged))
        assert finished_run.finished(Path("runs/waves")) is None


FEW = 3
"""Samples a pixel that nothing else takes."""


@pytest.mark.slow
@pytest.mark.parametrize("method", ["gauss-newton", "adam"])
def test_a_descent_renders_the_look_to_keep_once(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    targets: list[str] = []
    looked_at: list[Any] = []
    evaluate, render = View.evaluate, Scene.render

    def counted_evaluate(view: View, heights: Any, jacobian: bool = True, edges: bool = True) -> Any:
        looked_at.append(heights.copy())
        # The first relief that is looked at is the original; without a Jacobian it is compared, not kept.
        targets.extend(["gauss-newton"] * (jacobian and np.array_equal(heights, looked_at[0])))
        return evaluate(view, heights, jacobian, edges)

    def counted_render(scene: Scene, heights: Any = None, *arguments: Any, **options: Any) -> Any:
        steered = options.get("samples") == FEW
        targets.extend(["adam"] * (steered and not heights.requires_grad))
        return render(scene, heights, *arguments, **options)

    monkeypatch.setattr(View, "evaluate", counted_evaluate)
    monkeypatch.setattr(Scene, "render", counted_render)
    steered = ["--set", f"look.samples={FEW}"] if method == "adam" else []
    steps = ["--set", f"descent.method={method}", "--set", "verify.corrections=0", *steered, *FAST]
    main(["optimize", str(STUDIO), "--texture", "waves.exr", "--jnd", "0.3", "-q", *steps])
    rows = Path("runs/waves/history.jsonl").read_text().splitlines()
    assert len(rows) > 1
    assert targets == [method]


@pytest.mark.slow
def test_an_earlier_run_is_replaced_only_by_force(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["optimize", str(STUDIO), "--texture", "waves.exr", "--jnd", "0.3", "-o", "out", "-q", *FAST]
    status = main(command)
    kept = Path("out/result.json").read_text()
    capsys.readouterr()
    assert main(command) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("retouch: out: ") and "--force replaces it" in line
    with pytest.raises(InputError, match=r"^out: holds an earlier run; force=True replaces it") as caught:
        runs.optimize("gravel", "out")
    assert "--" not in str(caught.value)
    assert Path("out/result.json").read_text() == kept
    assert main([*command, "--force"]) == status
    assert Path("out/result.json").read_text() != kept


@pytest.mark.parametrize(
    ("stop", "status"),
    [
        (StopReason.CONVERGED, 0),
        (StopReason.STEP_LIMIT, 0),
        (StopReason.SHORT_OF_TARGET, 3),
        (StopReason.UNREACHABLE, 3),
        (StopReason.NON_FINITE, 3),
        (StopReason.INTERRUPTED, 130),
    ],
)
@pytest.mark.parametrize("verb", ["optimize", "resume"])
def test_the_status_says_how_a_run_ended(
    verb: str, stop: StopReason, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ended(*_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(
            verification=verified(stop={"reason": stop.name.lower()}), run_dir=Path("runs/gravel")
        )

    monkeypatch.setattr(job, "run", ended)
    monkeypatch.setattr(job, "resume", ended)
    Path("runs/gravel").mkdir(parents=True)
    Path("runs/gravel/run.toml").write_text(config.dump_resolved(config.load_run("gravel")))
    source = STUDIO.with_name("gravel.toml") if verb == "optimize" else "runs/gravel"
    assert main([verb, str(source), "-q"]) == status


def lines(result: Mapping[str, Any], verbose: bool = False) -> str:
    told = summary(Verification.from_json(result), Path("runs/x"), verbose)
    return "".join(f"{word}  {sentence} \n" for word, sentence in told)


CHANGE = {
    **{"estimate": 1.92, "mean": 2.04, "mean_error": 0.01, "mean_at_least": 1.81, "noise_floor": 0.5},
    **{"rms": 3.1, "rms_less_noise": 3.0, "rms_error": 0.12},
}


RESULT: dict[str, Any] = {
    "stop": {"reason": "converged", "message": "Done.", "steps": 4, "best_step": 3},
    "touch": {
        **{"target_roughness": None, "initial_roughness": 0.05, "roughness": 0.04},
        **{"verified_roughness": None, "verified_by": None, "verified_contact_area_mm2": None},
        "jnd_from_original": -1.28,
        **{"target_contact_area_mm2": 45.0, "initial_contact_area_mm2": 40.0, "contact_area_mm2": 45.1},
        "contact_fraction": 0.31,
        "fingers": FINGERS | {"count": 5, "jnd_min": -1.5, "jnd_max": -0.8},
        "measured": {
            **{"skin": "measured", "force_n": 1.0, "count": 8, "initial_roughness": 0.06, "roughness": 0.05},
            **{"jnd_mean": -1.1, "jnd_min": -1.2, "jnd_max": -0.9},
        },
    },
    "look": content()["look"]
    | {
        "change_percent": 1.92,
        "samples": 256,
        "noise": content()["look"]["noise"]
        | {
            "certainty": "coarse",
            "message": "Blurred.",
            "change_percent_of_mean": CHANGE,
            "change_percent_of_white": {name: 0.5 * value for name, value in CHANGE.items()},
        },
    },
    "heights": {"min_mm": 0.0, "max_mm": 1.0, "rms_change_mm": 0.206, "lift_mm": 0.452},
    "time_s": {"total": 100.0, "set_up": 1.0, "descent": 90.0, "verify": 9.0},
}


def test_the_screen_leaves_out_what_there_is_not() -> None:
    screen = lines(RESULT)
    assert "step 3 of 4" in screen
    assert "original 0.0500, achieved 0.0400 " in screen and "verified" not in screen
    assert "1.3 JND smoother" in screen and "told apart in 89 of 100 tries" in screen
    assert "-1.50 to -0.80 JND to 5 fingers" in screen
    assert "-1.10 JND (-1.20 to -0.90 over 8 places) to a measured finger at 1 N" in screen
    assert "original 40.0, target 45.0, achieved 45.1 mm²" in screen
    change = f"{percent(1.92)} of the mean picture"
    assert f"changed by about {change}" in screen
    sharp = RESULT["look"]["noise"] | {"certainty": "known"}
    assert f"changed by {change}" in lines(RESULT | {"look": RESULT["look"] | {"noise": sharp}})
    for more in (
        "31 % of the patch; the contact area also counts skin close by",
        f"bounds {between(1.81, 2.04)}, rms {plus_minus(3.0, 0.12)} %",
        f"of white {percent(0.96)}; bounds {between(0.905, 1.02)}, rms {plus_minus(1.5, 0.06)} %",
        "set-up 1.0 s",
    ):
        assert more not in screen and more in lines(RESULT, verbose=True)
    assert "changed by 206 µm (rms about the mean); lifted by 452 µm, which is not felt" in screen
    assert "Blurred." in screen and "256 samples a pixel; more make it clearer (verify.samples)" in screen
    assert "to print" not in screen


@pytest.mark.parametrize("goals", [[0.04, 0.08], [0.03, 0.12]], ids=["one change", "a change for each place"])
def test_the_screen_tells_no_mean_of_a_feel_that_varies(goals: list[float]) -> None:
    steered = {
        **{"centres_mm": [[5, 5], [5, 9]], "count": 2, "initial_roughness": [0.05, 0.1]},
        **{"target_roughness": goals, "verified_roughness": goals},
    }
    spread = {"count": 4, "jnd_min": -1.7, "jnd_max": 1.9, "farthest_from_target_jnd": 0.19}
    touch = RESULT["touch"] | {"places": spread | {"steered": steered}}
    screen = lines(RESULT | {"touch": touch})
    mean = "smoother than the original on average, told apart"
    ends, off = "-1.70 to +1.90 JND", "over 4 places of the finger, at most 0.19 JND off the target"
    if goals[0] == 0.04:
        assert mean in screen and f"{ends} {off}" in screen
    else:
        assert mean not in screen and f"{ends} from the original {off}" in screen
    assert "to 5 fingers at 1 place in the middle" in screen
    assert "achieved 0.0400 (means over 2 places)" in screen


def test_the_screen_says_if_the_pictures_are_the_same() -> None:
    noise = RESULT["look"]["noise"] | {"certainty": "same", "message": "The pictures are the same."}
    look = RESULT["look"] | {"noise": noise}
    screen = lines(RESULT | {"look": look})
    assert re.search("^pictures +The pictures are the same.", screen, re.MULTILINE)
    assert "of white" not in screen


def test_the_screen_calls_nothing_a_change_that_noise_may_be() -> None:
    noise = RESULT["look"]["noise"] | {"certainty": "within_noise", "message": "Lost in noise."}
    screen = lines(RESULT | {"look": RESULT["look"] | {"samples": 4, "noise": noise}})
    assert (
        "Lost in noise. It is at most" in screen
        and f"{percent(2.04)} of the mean picture" in screen
        and "4 samples a pixel" in screen
    )
    assert "pictures      changed by" not in screen


def test_the_screen_tells_by_which_weight_other_fingers_were_drawn() -> None:
    fingers = FINGERS | {"count": 5, "jnd_min": 1.454, "jnd_max": 2.25, "weight": None}
    assert "drawn" not in lines(RESULT | {"touch": RESULT["touch"] | {"fingers": fingers}})
    screen = lines(RESULT | {"touch": RESULT["touch"] | {"fingers": fingers | {"weight": 20.0}}})
    assert "+1.45 to +2.25 JND to 5 fingers, drawn along with weight 20" in screen


@pytest.mark.parametrize(
    ("design", "change", "told"), [(17.2, 3.3, True), (7.4, 2.1, False), (17.2, 18, False)]
)
def test_a_printer_that_changes_the_look_by_much_is_told_of(design: float, change: float, told: bool) -> None:
    said = lines(of_a_print(design, change).as_json())
    line = "the printer changes the look of the original by 17\N{NARROW NO-BREAK SPACE}% of the mean picture"
    assert (line in said) == told and "filament: both as printed" in said
