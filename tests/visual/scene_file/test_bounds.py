"""Every number of a scene is bounded: nonsense is refused in one line that names object and parameter."""

import itertools
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from visual.scene_file.bounds import PARAMETERS, Kind, plugins
from visual.scene_file.check import check_scene
from visual.scene_file.describe import describe

SCENE = """<scene version="3.9.1">{more}
    <integrator type="path"/>
    <sensor type="orthographic"><film type="hdrfilm">{film}</film>{sensor}</sensor>
    <emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/></emitter>
    <shape type="heightfield"><string name="filename" value="plate.exr"/>{plate}</shape>
</scene>"""
STUDIO = FOLDER / "studio.xml"
NONSENSE = ("nan", "inf", "-inf", "-1e300", "1e300")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_heights_exr(tmp_path / "plate.exr", np.zeros((16, 16)))
    return tmp_path


def check(folder: Path, plate: str = "", film: str = "", sensor: str = "", more: str = "") -> None:
    path = folder / "scene.xml"
    path.write_text(SCENE.format(plate=plate, film=film, sensor=sensor, more=more))
    check_scene(path)


def refused(folder: Path, *named: str, **parts: str) -> None:
    with pytest.raises(InputError) as caught:
        check(folder, **parts)
    line = str(caught.value)
    assert line.startswith(str(folder)) and "\n" not in line and len(line) < 500
    assert [word for word in named if word not in line] == []


def matte(reflectance: str) -> str:
    return f'<bsdf type="diffuse">{reflectance}</bsdf>'


def every_parameter() -> Iterator[tuple[str, str, str, Kind]]:
    for kind in (*PARAMETERS, "Emitter"):
        for plugin, parameters in plugins(kind).items():
            yield from ((kind, plugin, key, bound) for key, bound in parameters.items())


def test_the_docs_list_the_plugins_that_a_scene_may_use() -> None:
    kinds = {
        **{"shape": "Shape", "bsdf": "BSDF", "texture": "Texture", "emitter": "Emitter", "sensor": "Sensor"},
        **{
            "film": "Film",
            "rfilter": "ReconstructionFilter",
            "sampler": "Sampler",
            "integrator": "Integrator",
        },
    }
    page = (FOLDER.parent / "docs" / "howto" / "scenes.md").read_text(encoding="utf-8")
    table = page.split("The plugins that a scene may use:\n\n")[1].split("\n\n")[0]
    listed = {}
    for line in table.splitlines()[2:]:
        tag, *names = re.findall(r"`([\w]+)`", line.replace("`texture`, `spectrum`", "`texture`"))
        listed[kinds.pop(tag)] = set(names)
    assert not kinds
    assert listed == {kind: set(plugins(kind)) for kind in listed}
    assert {*PARAMETERS, "Emitter"} == {*listed, "Scene"}


def test_a_map_of_half_precision_is_read_without_a_warning(folder: Path) -> None:
    radiance = np.full((4, 8, 3), 2.0, dtype=np.float16)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": radiance}).write(str(folder / "sky.exr"))
    check(folder, more='<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>')


def test_no_parameter_of_any_plugin_takes_nonsense() -> None:
    for (kind, plugin, key, bound), value in itertools.product(every_parameter(), map(float, NONSENSE)):
        if bound.words != "true or false":
            assert not bound.holds(value), (kind, plugin, key, value)


@pytest.mark.parametrize("value", [*NONSENSE, "-0.1", "1.1"])
@pytest.mark.parametrize(
    "written",
    [
        '<float name="reflectance" value="{}"/>',
        '<rgb name="reflectance" value="0.5, {}, 0.5"/>',
        '<spectrum name="reflectance" value="{}"/>',
        '<spectrum name="reflectance" value="400:0.5, 700:{}"/>',
        '<texture type="checkerboard" name="reflectance"><rgb name="color0" value="{}"/></texture>',
        '<texture type="uniform" name="reflectance"><float name="value" value="{}"/></texture>',
    ],
)
def test_a_reflectance_is_from_0_to_1(folder: Path, written: str, value: str) -> None:
    refused(folder, plate=matte(written.format(value)))
    check(folder, plate=matte(written.format("0.7")))


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ('<emitter type="directional"><rgb name="irradiance" value="-1"/></emitter>', "irradiance"),
        ('<emitter type="directional"><vector name="direction" value="0, 0, 0"/></emitter>', "direction"),
        ('<emitter type="directional"><vector name="direction" value="0, 0, nan"/></emitter>', "direction"),
        ('<emitter type="point"><point name="position" value="0, inf, 0"/></emitter>', "position"),
        ('<emitter type="constant"><rgb name="radiance" value="1e7"/></emitter>', "radiance"),
        ('<emitter type="constant"><float name="sampling_weight" value="0"/></emitter>', "sampling_weight"),
        ('<emitter type="constant"><rgb name="radience" value="1"/></emitter>', "the nearest is radiance"),
        ('<emitter type="constant"><rgb name="to_world" value="1"/></emitter>', "to_world"),
        ('<emitter type="constant"><float name="to_world" value="1"/></emitter>', "to_world"),
        ('<shape type="disk"><emitter type="point"/></shape>', "does not belong in a shape"),
        ('<shape type="disk"><shape type="disk"/></shape>', "does not belong in a shape"),
        ('<shape type="sphere"><float name="radius" value="0"/></shape>', "radius"),
        (
            '<shape type="disk"><transform name="to_world"><scale x="0"/></transform></shape>',
            "invertible",
        ),
        (
            '<shape type="disk"><transform name="to_world"><translate x="nan"/></transform></shape>',
            "invertible",
        ),
        (
            '<shape type="disk"><transform name="to_world"><lookat origin="0,0,1" target="0,0,1" up="0,1,0"/>'
            "</transform></shape>",
            "scene.xml",
        ),
        ('<texture type="bitmap"/>', "bitmap: filename: missing"),
        ('<shape type="ply"/>', "ply: filename: missing"),
        ('<bsdf type="dielectric"><float name="int_ior" value="0"/></bsdf>', "int_ior"),
        ('<integrator type="path"><integer name="max_depth" value="1000000"/></integrator>', "max_depth"),
        ('<emitter type="constant"/>' * 65, "66 objects of kind emitter"),
        ('<shape type="disk"/>' * 300, "301 objects of kind shape"),
        ('<default name="x" value="1"/>' * 10_000, "elements"),
        (
            '<default name="a0" value="0123456789"/>'
            + "".join(f'<default name="a{i + 1}" value="$a{i}$a{i}"/>' for i in range(40)),
            "characters",
        ),
        ('<default name="a" value="\\$b"/>', "not allowed"),
    ],
)
def test_nonsense_is_refused(folder: Path, more: str, named: str) -> None:
    refused(folder, named, more=more)


@pytest.mark.parametrize(
    ("film", "named"),
    [
        ('<rfilter type="gaussian"><float name="stddev" value="1e9"/></rfilter>', "stddev"),
        ('<rfilter type="lanczos"><integer name="lobes" value="1000000"/></rfilter>', "lobes"),
        ('<rfilter type="tent"><float name="radius" value="nan"/></rfilter>', "radius"),
        ('<rfilter type="tent"><float name="radius" value="0.1"/></rfilter>', "radius"),
        ('<rgb name="file_format" value="0.5"/>', "file_format"),
        ('<vector name="pixel_format" value="1, 2, 3"/>', "pixel_format"),
        ('<integer name="crop_width" value="8"/>', "crop_width"),
        ('<string name="pixel_format" value="xyzzy"/>', "pixel_format"),
        ('<string name="pixel_format" value="xyz"/>', "pixel_format"),
        ('<integer name="width" value="0"/>', "width"),
        (f'<integer name="width" value="{"9" * 5000}"/>', "integer"),
        ('<float name="width" value="1e300"/>', "width"),
    ],
)
def test_a_film_is_bounded(folder: Path, film: str, named: str) -> None:
    refused(folder, named, film=film)


def test_an_integrator_that_hides_lights_is_refused(folder: Path) -> None:
    hiding = '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>'
    scene = SCENE.format(plate="", film="", sensor="", more="").replace('<integrator type="path"/>', hiding)
    (folder / "scene.xml").write_text(scene)
    with pytest.raises(InputError, match="hide_emitters: True is not false; light behind the plate"):
        check_scene(folder / "scene.xml")


@pytest.mark.parametrize("samples", ["0", "1000000000", "-4"])
def test_the_number_of_samples_is_bounded(folder: Path, samples: str) -> None:
    sampler = f'<sampler type="independent"><integer name="sample_count" value="{samples}"/></sampler>'
    refused(folder, "sample_count", sensor=sampler)


def test_the_pixels_of_all_pictures_are_bounded(folder: Path) -> None:
    film = '<integer name="width" value="8192"/><integer name="height" value="8192"/>'
    check(folder, film=film)
    refused(folder, "pixels in all", film=film, more='<emitter type="point"/>')


@pytest.mark.parametrize("value", [*NONSENSE, "0", "-3"])
def test_a_plate_has_a_size(folder: Path, value: str) -> None:
    for key in ("size_mm", "relief_mm"):
        refused(folder, key, plate=f'<float name="{key}" value="{value}"/>')


def test_materials_are_nested_a_few_times_only(folder: Path) -> None:
    """The time to compile doubles with each level: twenty take minutes."""
    wrapped, blended = matte(""), '<bsdf type="diffuse" id="b0"/>'
    for level in range(20):
        wrapped = f'<bsdf type="twosided">{wrapped}</bsdf>'
        blended += (
            f'<bsdf type="blendbsdf" id="b{level + 1}"><float name="weight" value="0.5"/>'
            f'<ref id="b{level}"/><ref id="b{level}"/></bsdf>'
        )
    refused(folder, "nested", plate=wrapped)
    refused(folder, "nested", more=blended)
    check(folder, plate=f'<bsdf type="twosided">{matte("")}</bsdf>')


@pytest.mark.parametrize("content", [math.nan, math.inf, -1.0, 2.0])
def test_a_bitmap_holds_what_its_parameter_may_be(folder: Path, content: float) -> None:
    picture = np.full((8, 8, 3), 0.5, dtype=np.float32)
    picture[3, 3] = content
    OpenEXR.File({}, {"RGB": picture}).write(str(folder / "bad.exr"))
    named = '<texture type="bitmap" name="{}"><string name="filename" value="bad.exr"/></texture>'
    refused(folder, "bad.exr", plate=matte(named.format("reflectance")))
    if not content >= 0.0:
        light = '<emitter type="envmap"><string name="filename" value="bad.exr"/></emitter>'
        refused(folder, "bad.exr", more=light)


def test_a_damaged_bitmap_is_refused_by_its_name(folder: Path) -> None:
    Image.fromarray(np.zeros((64, 64, 3), np.uint8)).save(folder / "cut.png")
    whole = (folder / "cut.png").read_bytes()
    texture = '<texture type="bitmap" name="reflectance"><string name="filename" value="cut.png"/></texture>'
    for length in (0, 10, 40, len(whole) - 20):
        (folder / "cut.png").write_bytes(whole[:length])
        refused(folder, "cut.png", plate=matte(texture))
    (folder / "cut.png").unlink()
    (folder / "cut.png").symlink_to("cut.png")
    refused(folder, "cut.png", plate=matte(texture))


def test_a_spectrum_of_bytes_is_refused(folder: Path) -> None:
    (folder / "light.spd").write_bytes(bytes(range(256)))
    refused(folder, "light.spd", plate=matte('<spectrum name="reflectance" filename="light.spd"/>'))


@pytest.mark.parametrize("content", ["0 1 2000000000", "0 1 3", "0 1 -2"])
def test_a_mesh_has_the_vertices_of_its_faces(folder: Path, content: str) -> None:
    """Mitsuba follows any number of a vertex, out of memory that is its own."""
    header = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {k}\n" for k in "xyz")
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    for corners, vertex in ((content, "1 0 0"), ("0 1 2", "inf 0 0"), ("0 1 2", "1e300 0 0")):
        (folder / "mesh.ply").write_text(f"{header}0 0 0\n{vertex}\n0 1 0\n3 {corners}\n")
        refused(
            folder,
            "mesh.ply",
            more='<shape type="ply"><string name="filename" value="mesh.ply"/></shape>',
        )


@pytest.mark.slow
def test_a_mutated_scene_is_sound_or_refused_in_one_line(folder: Path) -> None:
    """Numbers, words and bytes of a whole scene are replaced; what remains of it passes or is refused."""
    rng = np.random.default_rng(0)
    whole = STUDIO.read_text().replace("textures/gravel.png", "plate.png")
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(folder / "plate.png")
    words = sorted(
        set(re.findall(r'"([\w-]+)"', whole)) | {*NONSENSE, "0", "-1", "$spp", "9" * 5000, "", "é"}
    )
    passed = 0
    for _ in range(1000):
        text = whole
        for _ in range(rng.integers(1, 4)):
            spots = list(re.finditer(r'"[^"]*"', text)) if rng.random() < 0.8 else []
            if spots:
                spot = spots[rng.integers(len(spots))]
                text = f'{text[: spot.start()]}"{rng.choice(words)}"{text[spot.end() :]}'
            else:
                start, end = np.sort(rng.integers(len(text), size=2))
                text = text[:start] + text[min(end, start + 40) :]
        (folder / "scene.xml").write_text(text, encoding="utf-8")
        try:
            description = describe(check_scene(folder / "scene.xml"))
        except InputError as error:
            line = str(error)
            assert line.startswith(str(folder)) and "\n" not in line and len(line) < 1000
        else:
            passed += 1
            assert all(np.isfinite(camera.to_world).all() for camera in description.cameras)
            assert all(math.isfinite(value) for light in description.lights for value in light.strength or ())
    assert 20 < passed < 980
