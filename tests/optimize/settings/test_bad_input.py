"""Whatever a user gets wrong ends with status 2, one line that names file and field, and nothing written."""

import resource
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relief.heightmap import save_heights_exr
from retouch.commands.main import main

SCENE = """<scene version="3.9.1">
    <default name="texture" value="plate.exr"/>
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="orthographic">
        <transform name="to_world">
            <scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="16"/><integer name="height" value="16"/>
            <string name="pixel_format" value="luminance"/>
        </film>
    </sensor>
    <emitter type="directional" id="sun"><vector name="direction" x="-1" y="0" z="-1"/></emitter>
    <shape type="heightfield"><string name="filename" value="$texture"/>{}</shape>
</scene>
"""
RUN = 'scene = "scene.xml"\ntexture = "plate.exr"\n{}\n[touch]\n{}\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with inputs that are right and inputs that are wrong."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    wave = 0.2 + 0.2 * np.sin(np.arange(16) * np.pi / 4)
    save_heights_exr("plate.exr", np.tile(wave, (16, 1)))
    save_heights_exr("nan.exr", np.where(np.eye(16) > 0, np.nan, 0.0))
    save_heights_exr("infinite.exr", np.where(np.eye(16) > 0, np.inf, 0.0))
    save_heights_exr("dot.exr", np.zeros((1, 1)))
    save_heights_exr("thin.exr", np.zeros((15, 24)))
    save_heights_exr("tall.exr", np.full((16, 16), 20.5))
    spikes = np.zeros((16, 16))
    spikes[4::8, 4::8] = 3.5
    save_heights_exr("spikes.exr", spikes)
    save_heights_exr("flat.exr", np.zeros((16, 16)))
    save_heights_exr(tmp_path / "secret.exr", np.zeros((16, 16)))
    save_heights_exr("broad.exr", np.tile(wave, (16, 1)), 20.0)
    Image.fromarray(np.tile(np.uint8(128 + 100 * wave), (16, 1))).save("plate.png")
    lie = PngInfo()
    lie.add_text("retouch.relief_mm", "nan")
    Image.open("plate.png").save("lying.png", pnginfo=lie)
    OpenEXR.File({"retouch.size_mm": 1e30}, {"Y": np.zeros((16, 16), np.float32)}).write("lying.exr")
    Path("loop.exr").symlink_to("loop.exr")
    Path("cut.png").write_bytes(Path("plate.png").read_bytes()[:60])
    texts = {
        "scene.xml": SCENE.format(""),
        "foreign.xml": SCENE.format('<bsdf type="diffuze"/>'),
        "outside.xml": SCENE.format("")
        .replace('"plate.exr"', '"../secret.exr"')
        .replace("$texture", "../secret.exr"),
        "torn.xml": SCENE[:200],
        "run.toml": RUN.format("", "jnd = 1"),
        "torn.toml": "scene = ",
        "typo.toml": RUN.format("releif_mm = 1", "jnd = 1"),
        "no_texture.toml": RUN.format("", "jnd = 1").replace("plate.exr", "absent.exr"),
        "deep.toml": RUN.format("", "jnd = 1") + "a." * 20_000 + "b = 1",
        "nested.toml": RUN.format("x = " + "[" * 20_000 + "]" * 20_000, "jnd = 1"),
        "long.toml": RUN.format(f"seed = {'9' * 5000}", "jnd = 1"),
        "weak.toml": RUN.format("", "jnd = 1\nforce_n = -1"),
    }
    Path("full").mkdir()
    texts["full/diary.txt"] = "not a run"
    Image.open("plate.png").save("photo.jpg")
    for name, text in texts.items():
        Path(name).write_text(text)
    return work


BAD: Sequence[tuple[str, Sequence[str]]] = [
    ("", ["VERB"]),
    ("optimise run.toml", ["optimise", "optimize"]),
    ("--nonsense", ["VERB"]),
    ("evaluate plate.exr --nonsense", ["--nonsense"]),
    ("evaluate", ["TEXTURE"]),
    ("evaluate absent.exr", ["absent.exr", "no such file"]),
    ("evaluate plate.exr absent.exr", ["absent.exr", "no such file"]),
    ("evaluate nan.exr", ["nan.exr", "not measured"]),
    ("evaluate infinite.exr", ["infinite.exr", "not measured"]),
    ("evaluate dot.exr", ["dot.exr", "1 x 1"]),
    ("evaluate tall.exr", ["tall.exr", "20.5 mm"]),
    ("evaluate spikes.exr", ["spikes.exr", "finger reaches"]),
    ("evaluate cut.png --relief-mm 1", ["cut.png"]),
    ("evaluate scene.xml", ["scene.xml", "not a height map"]),
    ("evaluate .", [".", "a folder without heights.exr"]),
    ("evaluate plate.png", ["plate.png", "--relief-mm: missing"]),
    ("evaluate plate.png --relief-mm -1", ["plate.png", "--relief-mm"]),
    ("evaluate plate.png --relief-mm 1e300", ["plate.png", "--relief-mm", "1e+300"]),
    ("evaluate plate.exr --relief-mm 1", ["--relief-mm", "pictures", "--height-scale"]),
    ("evaluate plate.png --height-scale 2", ["--height-scale", "mm", "--relief-mm"]),
    ("evaluate plate.exr --height-scale 0", ["plate.exr", "--height-scale"]),
    ("evaluate plate.exr --height-scale 1e5", ["plate.exr", "mm", "20"]),
    ("evaluate plate.exr --size-mm 1e300", ["plate.exr", "--size-mm"]),
    ("evaluate loop.exr", ["loop.exr", "no such file"]),
    ("evaluate lying.exr", ["lying.exr", "header", "size_mm", "1e+30"]),
    ("evaluate lying.png", ["lying.png", "header", "relief_mm", "nan"]),
    ("export plate.exr -o plate.stl --relief-mm 1", ["--relief-mm", "--height-scale"]),
    ("export plate.exr -o plate.stl --size-mm 1e300", ["--size-mm", "1e+300"]),
    ("export plate.exr -o plate.stl --base-mm 1e300", ["--base-mm", "1e+300"]),
    ("export lying.exr -o plate.stl", ["lying.exr", "size_mm"]),
    ("render scene.xml --texture plate.exr --relief-mm 1", ["--relief-mm", "--height-scale"]),
    ("render scene.xml --texture loop.exr", ["loop.exr", "no such file"]),
    ("render scene.xml --height-scale 2", ["--height-scale", "--texture"]),
    ("render scene.xml --texture broad.exr", ["scene.xml", "size_mm", "10", "20"]),
    ("optimize run.toml --relief-mm 1", ["--relief-mm", "height_scale"]),
    ("optimize run.toml --height-scale 1e300", ["--height-scale"]),
    ("optimize run.toml --texture broad.exr", ["scene.xml", "size_mm", "10", "20"]),
    ("optimize run.toml --texture loop.exr", ["loop.exr", "no such file"]),
    ("evaluate plate.exr --size-mm nonsense", ["--size-mm", "nonsense"]),
    ("evaluate plate.exr --size-mm -3", ["plate.exr", "--size-mm"]),
    ("evaluate plate.exr --size-mm nan", ["plate.exr", "--size-mm"]),
    ("evaluate plate.exr --force-n -1", ["--force-n"]),
    ("evaluate plate.exr --young-modulus-mpa inf", ["--young-modulus-mpa"]),
    ("evaluate plate.exr --poisson-ratio 0.5", ["--poisson-ratio"]),
    ("evaluate plate.exr --model net", ["--model", "net"]),
    ("optimize run.toml --set verify.resolution=33", ["verify.resolution", "33"]),
    ("optimize run.toml --set verify.resolution=1000", ["verify.resolution", "160"]),
    ("optimize", ["TEXTURE|RUN.toml"]),
    ("optimize absent.toml", ["absent.toml", "no such file"]),
    ("optimize torn.toml", ["torn.toml", "not TOML"]),
    ("optimize typo.toml", ["typo.toml", "releif_mm", "nearest is relief_mm"]),
    ("optimize no_texture.toml", ["no_texture.toml", "texture", "absent.exr"]),
    ("optimize weak.toml", ["weak.toml", "touch.force_n"]),
    (
        "optimize run.toml --set touch.rougness=0.07",
        ["--set touch.rougness=0.07", "nearest is touch.roughness"],
    ),
    ("optimize run.toml --set seed", ["--set", "seed", "key=value"]),
    ("optimize run.toml --size-mm -10", ["--size-mm"]),
    ("optimize run.toml --jnd 1 --roughness 0.1", ["--roughness", "--jnd"]),
    ("optimize run.toml --seed -1", ["--seed"]),
    ("optimize run.toml -D resolution", ["-D", "resolution", "key=value"]),
    ("optimize run.toml -D resolutoin=32", ["scene.xml", "-D resolutoin"]),
    ("optimize run.toml -m llvm_ad_grey", ["variant", "llvm_ad_grey", "llvm_ad_"]),
    ("optimize run.toml --texture nan.exr", ["nan.exr", "not measured"]),
    ("evaluate thin.exr", ["thin.exr", "24 x 15"]),
    ("optimize run.toml --texture thin.exr", ["thin.exr", "24 x 15"]),
    ("optimize run.toml --texture plate.png", ["plate.png", "--relief-mm: missing"]),
    ("optimize run.toml --texture flat.exr", ["touch.jnd", "flat"]),
    ("optimize run.toml --set touch.model=net", ["touch.model", "net"]),
    ("optimize run.toml -o torn.toml", ["torn.toml", "is a file"]),
    ("optimize run.toml -o full", ["full", "--force"]),
    ("optimize run.toml -o full --force", ["full", "not replaced"]),
    ("optimize run.toml -o . --force", ["-o", "run.toml", "reads"]),
    ("optimize run.toml -o plate.exr --force", ["-o", "plate.exr", "reads"]),
    ("optimize scene.xml --jnd 1", ["scene.xml", "--texture"]),
    ("optimize scene.xml --texture plate.exr", ["scene.xml", "target"]),
    ("optimize plate.exr", ["plate.exr", "target"]),
    ("optimize plate.png --jnd 1", ["plate.png", "--relief-mm: missing"]),
    ("optimize plate.exr --texture plate.png --jnd 1", ["--texture", "plate.png", "plate.exr"]),
    ("optimize scene.xml --scene studio --texture plate.exr --jnd 1", ["--scene", "studio", "scene.xml"]),
    ("optimize plate.exr --scene absent --jnd 1", ["absent", "no such file", "studio.xml"]),
    ("optimize photo.jpg --relief-mm 1 --jnd 1", ["photo.jpg", "not a height map"]),
    ("optimize plate.exr --jnd 1 -o .", ["-o", "plate.exr", "reads"]),
    ("optimize foreign.xml --texture plate.exr --jnd 1", ["foreign.xml", "diffuze"]),
    ("resume .", ["checkpoint", "no such file"]),
    ("resume absent", ["absent", "no such file"]),
    ("render", ["SCENE"]),
    ("render absent.xml", ["absent.xml", "no such file"]),
    ("render torn.xml", ["torn.xml", "XML"]),
    ("render foreign.xml", ["foreign.xml", "diffuze", "diffuse"]),
    ("render outside.xml", ["outside.xml", "../secret.exr", "folder"]),
    ("render scene.xml -D texture", ["-D", "texture", "key=value"]),
    ("render scene.xml -D texture=absent.exr", ["scene.xml", "absent.exr"]),
    ("render scene.xml --texture plate.png", ["plate.png", "--relief-mm: missing"]),
    ("render scene.xml --relief-mm 1", ["--relief-mm", "--texture"]),
    ("render scene.xml --samples 0", ["--samples", "0"]),
    (f"render scene.xml --samples {'9' * 5000}", ["--samples"]),
    (f"optimize run.toml --set seed={'9' * 5000}", ["seed"]),
    (f"optimize run.toml --set {'a.' * 20000}b=1", ["--set"]),
    ("optimize deep.toml", ["deep.toml"]),
    ("optimize nested.toml", ["nested.toml"]),
    ("optimize long.toml", ["long.toml"]),
    ("optimize run.toml --size-mm 1e300", ["--size-mm"]),
    ("evaluate plate.exr --size-mm 1e300", ["--size-mm"]),
    ("export plate.exr -o plate.stl --size-mm 1e300", ["--size-mm"]),
    ("export plate.exr -o plate.stl --base-mm 1e300", ["--base-mm"]),
    ("evaluate plate.exr --force-n 1e300", ["force_n"]),
    ("evaluate plate.exr --young-modulus-mpa 1e300", ["skin", "young_modulus_mpa"]),
    ("evaluate plate.png --relief-mm 1e300", ["--relief-mm"]),
    ("render scene.xml -m gpu", ["variant", "gpu"]),
    ("render scene.xml -o plate.exr", ["plate.exr", "-o"]),
    ("export plate.exr", ["-o"]),
    ("export plate.exr -o plate.step", ["plate.step", "'.step'"]),
    ("export plate.exr -o absent/plate.stl", ["absent/plate.stl", "-o"]),
    ("export nan.exr -o plate.stl", ["nan.exr", "not measured"]),
    ("export plate.exr -o plate.stl --base-mm 0", ["--base-mm"]),
    ("export plate.exr -o plate.stl --size-mm 0", ["--size-mm"]),
]


@pytest.mark.parametrize(("command", "named"), BAD, ids=[command or "nothing" for command, _ in BAD])
def test_one_line_says_what_is_wrong(
    folder: Path, capfd: pytest.CaptureFixture[str], command: str, named: Sequence[str]
) -> None:
    before = sorted(folder.rglob("*"))
    assert main(command.split()) == 2
    printed = capfd.readouterr()
    assert printed.out == ""
    (line,) = printed.err.splitlines()
    assert line.startswith("retouch: ")
    assert [word for word in named if word not in line] == []
    assert sorted(folder.rglob("*")) == before


@pytest.mark.usefixtures("folder")
def test_a_name_of_two_lines_is_told_in_one(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "two\nlines.exr"]) == 2
    assert capfd.readouterr().err == "retouch: two lines.exr: no such file\n"


@pytest.mark.usefixtures("folder")
def test_a_name_that_no_file_system_takes_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    name = "n" * 300 + ".exr"
    assert main(["evaluate", name]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert name in line


def test_a_folder_that_cannot_be_written_is_named(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "runs").write_text("a file where the folder of all runs belongs")
    assert main(["optimize", "run.toml"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "runs" in line


def test_a_limit_on_the_size_of_files_is_told(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before, limits = sorted(folder.iterdir()), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        status = main(["export", "plate.exr", "-o", "plate.stl"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (status, capfd.readouterr().err) == (2, "retouch: plate.stl: File too large\n")
    assert sorted(folder.iterdir()) == before


def test_an_error_of_the_program_is_one_line_and_a_traceback_in_a_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def exhausted(*_: object, **__: object) -> None:
        raise MemoryError("all of it\nis used")

    monkeypatch.setattr("relief.relief.load_height_map", exhausted)
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    assert main(["evaluate", "plate.exr"]) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("retouch: internal error: MemoryError: all of it is used")
    (log,) = folder.glob("retouch-error-*.txt")
    assert str(log) in line and "in exhausted" in log.read_text()

    def refuse(**_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(tempfile, "mkstemp", refuse)
    assert main(["evaluate", "plate.exr"]) == 1
    assert "could not be written" in capfd.readouterr().err


@pytest.mark.usefixtures("folder")
def test_links_that_lead_nowhere_are_named(capfd: pytest.CaptureFixture[str]) -> None:
    for name in ("loop.xml", "ring.exr", "loop.toml", "renders", "runs"):
        Path(name).symlink_to(name)
    Path("looped.xml").write_text(SCENE.format("").replace('value="plate.exr"', 'value="ring.exr"'))
    for command in (
        "render loop.xml",
        "render looped.xml",
        "evaluate ring.exr",
        "optimize loop.toml",
        "render scene.xml",
        "render scene.xml -o renders",
        "optimize run.toml",
        "resume loop.toml",
    ):
        assert main(command.split()) == 2, command
        assert capfd.readouterr().err.splitlines()[-1].startswith("retouch: ")


@pytest.mark.usefixtures("folder")
def test_a_black_picture_is_said(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "scene.xml"]) == 0
    assert "Black" not in capfd.readouterr().out
    Path("dark.xml").write_text(SCENE.format("").replace('z="-1"', 'z="1"'))
    assert main(["render", "dark.xml"]) == 0
    assert "Black: sun" in capfd.readouterr().out
