"""Twenty public scenes of Mitsuba 3, and what gives each a plate and makes Retouch take it."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

COMMITS = {
    "mitsuba-renderer/mitsuba-data": "01100fa9b0b154492061a92404f26dcd7b784dbb",
    "mitsuba-renderer/mitsuba-tutorials": "a8dbee7e81b1039a983770ce1042f2d78688d0ae",
    "NVlabs/sionna-rt": "d0429340b2ee3848e48ed648db9a014dfba22cc8",
    "roblesch/roulette": "5f36e23c9151132177e2580c8ac1674367234c41",
    "tizian/specular-manifold-sampling": "1f0e40342a8760450d5aa6202ea096feaa70256a",
}
"""Commits of the repositories on GitHub."""
RELIEF = "relief.npy"
"""File of the plate's heights, beside each scene."""

Edit = tuple[str, Callable[[ElementTree.Element], None]]
"""What is changed, in words, and the change of a scene's tree."""


@dataclass(frozen=True)
class Example:
    """A public scene.

    Attributes:
        repository, path: where it is.
        size_mm: width of the plate, in units of the scene.
        edits: the first puts the plate into the scene.
        samples: (rows, cols) of the relief.
        defines: values of `$parameters` that the file leaves open.
    """

    repository: str
    path: str
    size_mm: float
    edits: tuple[Edit, ...]
    samples: tuple[int, int] = (64, 64)
    defines: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"{self.repository.split('/')[1]}: {self.path}"


def plate(shape: str, size_mm: float, *moves: str) -> Edit:
    """The plate in place of a shape, with the material of this one.

    Args:
        shape: path of the shape in the tree.
        size_mm: width of the plate.
        moves: transforms of all but the plate, which lies around the origin.
    """
    return f"{_named(shape)} is a plate", partial(_put_plate, shape, size_mm, moves)


def without(*paths: str) -> Edit:
    """The scene without elements, each given by its path in the tree."""
    return f"without {', '.join(map(_named, paths))}", partial(_remove, paths)


def replaced(path: str, text: str, words: str) -> Edit:
    """An element, given by its path, replaced by another one."""
    return words, partial(_replace, path, text)


def above(size_mm: float, distance: float, film: str = "") -> Edit:
    """A camera straight above that sees the whole plate and nothing else."""
    half = 0.5 * size_mm
    text = f"""<sensor type="orthographic"><transform name="to_world"><scale x="{half}" y="{half}"/>
        <lookat origin="0, 0, {distance}" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"/>
        <film type="hdrfilm">{film or SQUARE}<rfilter type="box"/></film></sensor>"""
    return "camera straight above", partial(_replace, "sensor", text)


SQUARE = '<integer name="width" value="96"/><integer name="height" value="96"/>'


def _named(path: str) -> str:
    """The words for a path in the tree."""
    words = path.removeprefix(".//").replace("[@id='", " ").replace("[@type='", " ").replace("']", "")
    return words.replace("[", " ").replace("]", "").replace("/", " of ")


def _find(root: ElementTree.Element, path: str) -> tuple[ElementTree.Element, ElementTree.Element]:
    """An element and its parent."""
    element = root.find(path)
    if element is None:
        raise ValueError(f"no {path}")
    return element, next(parent for parent in root.iter() if element in list(parent))


def _remove(paths: tuple[str, ...], root: ElementTree.Element) -> None:
    for element, parent in [_find(root, path) for path in paths]:
        parent.remove(element)


def _replace(path: str, text: str, root: ElementTree.Element) -> None:
    element, parent = _find(root, path)
    place = list(parent).index(element)
    parent.remove(element)
    for number, new in enumerate(ElementTree.fromstring(f"<all>{text}</all>")):
        parent.insert(place + number, new)


def unwrap(path: str, words: str) -> Edit:
    """The one nested plugin of an element in its place, under its name."""
    return words, partial(_unwrap, path)


def _unwrap(path: str, root: ElementTree.Element) -> None:
    element, parent = _find(root, path)
    inner = next(child for child in element if child.tag == element.tag)
    inner.attrib |= {key: element.attrib[key] for key in ("id", "name") if key in element.attrib}
    parent[list(parent).index(element)] = inner


def _put_plate(shape: str, size_mm: float, moves: tuple[str, ...], root: ElementTree.Element) -> None:
    element, _ = _find(root, shape)
    for child in [child for child in element if child.tag not in ("bsdf", "ref")]:
        element.remove(child)
    element.set("type", "heightfield")
    ElementTree.SubElement(element, "string", name="filename", value=RELIEF)
    ElementTree.SubElement(element, "float", name="size_mm", value=f"{size_mm:g}")
    for moved in root:
        if moves and moved is not element and moved.tag in ("shape", "emitter", "sensor"):
            _move(moved, moves)


def _move(element: ElementTree.Element, moves: tuple[str, ...]) -> None:
    """Add transforms after those of an object; a constant light has none, and an area light its shape's."""
    position = element.find("point[@name='position']")
    if element.get("type") in ("constant", "area"):
        return
    transform = element.find("transform[@name='to_world']")
    if transform is None:
        transform = ElementTree.SubElement(element, "transform", name="to_world")
    if position is not None:
        element.remove(position)
        ElementTree.SubElement(transform, "translate", {key: position.attrib[key] for key in "xyz"})
    transform.extend(ElementTree.fromstring(f"<all>{''.join(moves)}</all>"))


def _drop_paths(root: ElementTree.Element) -> None:
    for path in root.findall("path"):
        root.remove(path)


PATH = "without search paths", _drop_paths
INNER = unwrap("integrator", "without the integrator of moments around another")
OTHERS = without("shape[@id='Interior-mesh_0']", "shape[@id='Plane-mesh_0']")
UPWARD = '<rotate y="1" angle="90"/>'
"""A turn by which what faced -x faces +z."""
Y_UP = '<rotate x="1" angle="90"/>'
"""A turn by which what faced +y faces +z."""
DATA, DOCS, TESTS = "mitsuba-renderer/mitsuba-data", "docs/scenes/", "tests/scenes/"
BALL = "shape[@type='serialized']"
SIX = '<integrator type="path"><integer name="max_depth" value="6"/></integrator>'


ONE = (
    "one emitter sample for four",
    lambda root: _find(root, "integrator/integer[@name='emitter_samples']")[0].set("value", "1"),
)


def _on_the_ball(file: str, *edits: Edit) -> Example:
    """A material of Mitsuba's documentation, whose preview scene has the plate in place of the ball."""
    return Example(DATA, DOCS + file, 2.0, (plate(BALL, 2.0), PATH, OTHERS, *edits, above(2.0, 10.0)))


def lamp(shape: str, moves: str) -> Edit:
    """A rectangle with the light of a shape in place of this shape."""
    return "the lamp a rectangle", partial(_put_lamp, shape, moves)


def _put_lamp(shape: str, moves: str, root: ElementTree.Element) -> None:
    element, _ = _find(root, shape)
    for child in [child for child in element if child.tag in ("string", "transform")]:
        element.remove(child)
    element.set("type", "rectangle")
    element.append(ElementTree.fromstring(f'<transform name="to_world">{moves}</transform>'))


def _nest_lamp(root: ElementTree.Element) -> None:
    """An area emitter of the scene in the first shape, which refers to it."""
    emitter, _ = _find(root, "emitter")
    shape, _ = _find(root, "shape[1]")
    root.remove(emitter)
    shape.remove(_find(root, "shape[1]/ref[@id='area-emitter']")[0])
    shape.append(emitter)


EXAMPLES: tuple[Example, ...] = (
    Example(
        DATA,
        "scenes/hello.xml",
        6.0,
        (plate("shape", 6.0), PATH, without("emitter[2]"), above(6.0, 20.0), ONE),
    ),
    Example(
        DATA,
        "scenes/matpreview/matpreview.xml",
        2.0,
        (
            plate("shape[@id='shape-matpreview-exterior']", 2.0),
            without("shape[@id='shape-plane']", "shape[@id='shape-matpreview-interior']"),
            above(2.0, 10.0),
        ),
    ),
    Example(
        DATA,
        "scenes/cbox/cbox-rgb.xml",
        550.0,
        (
            plate("shape[2]", 550.0, '<translate x="-278" z="-279.6"/>', Y_UP),
            ("the area emitter inside its shape", _nest_lamp),
            above(550.0, 500.0),
            without("shape[8]", "shape[7]"),
            lamp("shape[1]", '<scale x="65" y="52.5"/><rotate x="1" angle="180"/><translate z="548.3"/>'),
        ),
    ),
    _on_the_ball("bsdf_blendbsdf.xml"),
    _on_the_ball("bsdf_bumpmap_with.xml", unwrap("bsdf[@id='object_bsdf']", "without the bump map")),
    _on_the_ball("bsdf_roughconductor_textured_carbon.xml"),
    _on_the_ball("bsdf_dielectric_glass.xml"),
    _on_the_ball("bsdf_conductor_gold.xml"),
    Example(
        DATA,
        DOCS + "integrator_direct_both.xml",
        8.0,
        (
            plate("shape[8]", 8.0, '<translate y="3.58237" z="-2.22305"/>', '<rotate x="1" angle="72.72"/>'),
            PATH,
            without("shape[10]", "shape[9]", "shape[7]", "shape[6]"),
            without("shape[5]"),
            above(8.0, 4.0, '<integer name="width" value="96"/><integer name="height" value="12"/>'),
        ),
        samples=(16, 128),
    ),
    Example(
        DATA,
        DOCS + "emitter_spot_texture.xml",
        10.58,
        (
            plate(
                "shape[@id='shape-plane']",
                10.58,
                '<translate x="1.74958" y="-1.43683" z="0.0120714"/>',
                '<rotate z="1" angle="-45.9"/>',
            ),
            PATH,
            without("emitter[2]/texture"),
            above(10.58, 10.0),
            without("shape[@type='sphere']"),
        ),
    ),
    Example(
        DATA,
        DOCS + "principled_blend_creation/scene.xml",
        2.6,
        (
            plate("shape[2]", 2.6, UPWARD),
            ("rectangle for Rectangle", lambda root: _find(root, "shape[1]")[0].set("type", "rectangle")),
            above(2.6, 10.0),
        ),
    ),
    Example(
        DATA,
        TESTS + "orthographic_sensor/test_orthographic_path.xml",
        2.0,
        (plate("shape", 2.0, '<translate z="-1"/>'), INNER, above(2.0, 10.0)),
    ),
    Example(
        DATA,
        TESTS + "floating_sphere/test_directional_direct.xml",
        2.0,
        (plate("shape[1]", 2.0), PATH, INNER, above(2.0, 0.5)),
    ),
    Example(
        DATA,
        TESTS + "texture_interp/test_texture_interp_direct.xml",
        2.0,
        (plate("shape[1]", 2.0, '<translate x="2.2" y="1.1"/>'), PATH, INNER, above(2.0, 5.0)),
    ),
    Example(
        DATA,
        TESTS + "bsdf_spheres/test_texturedprincipled1_path.xml",
        2.0,
        (
            plate("shape[1]", 2.0, UPWARD),
            PATH,
            INNER,
            above(2.0, 3.0),
            lamp(
                "shape[2]",
                '<rotate y="1" angle="120"/><scale x="2" y="2" z="2"/><translate x="-4" y="0" z="6"/>'
                + UPWARD,
            ),
            replaced(
                "shape[2]/emitter/spectrum", '<rgb name="radiance" value="18, 11, 3"/>', "its radiance in RGB"
            ),
        ),
    ),
    Example(
        "mitsuba-renderer/mitsuba-tutorials",
        "scenes/cbox.xml",
        2.0,
        (
            plate("shape[@id='back']", 2.0, '<translate z="1"/>'),
            above(2.0, 3.0),
            without("shape[@id='mirrorsphere']", "shape[@id='glasssphere']"),
            lamp(
                "shape[@id='light']",
                '<scale value="0.25"/><rotate x="1" angle="90"/><translate y="0.99" z="1"/>',
            ),
        ),
    ),
    Example(
        "mitsuba-renderer/mitsuba-tutorials",
        "scenes/shadow_art.xml",
        16.0,
        (
            plate("shape[@id='wall1']", 16.0, '<translate z="5"/>'),
            replaced("integrator", '<integrator type="direct"/>', "direct for direct_projective"),
            without("shape[@id='curve']"),
            above(16.0, 8.0, '<integer name="width" value="96"/><integer name="height" value="24"/>'),
        ),
        samples=(32, 128),
    ),
    Example(
        "NVlabs/sionna-rt",
        "src/sionna/rt/scenes/floor_wall/floor_wall.xml",
        4.0,
        (plate("shape[@id='mesh-floor']", 4.0), above(4.0, 5.0)),
    ),
    Example(
        "roblesch/roulette",
        "renderer/scene_v3.xml",
        2.0,
        (
            plate("shape[@id='Floor']", 2.0, Y_UP),
            above(2.0, 1.9),
            without("shape[@id='ShortBox']", "shape[@id='TallBox']"),
        ),
    ),
    Example(
        "tizian/specular-manifold-sampling",
        "results/Figure_17_Roughness/plane_pt.xml",
        16.0,
        (
            plate("shape[2]", 16.0, '<translate y="-8"/>', '<rotate y="1" angle="30"/>'),
            replaced("integrator", SIX, "path for path_filtered_ss"),
            unwrap("shape[2]/bsdf", "without the normal map"),
            without("shape[1]/emitter/boolean"),
            without("shape[3]/boolean"),
            without("shape[3]"),
            above(16.0, 30.0),
        ),
        defines={"alpha": "0.1"},
    ),
)
"""In the order of the table."""
