"""Projects of slicers for tests, written as the slicers write them."""

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from relief.ground.arrays import Index
from relief.solids.body import Body
from relief.solids.export.project_meshes import Textured
from relief.solids.files.mesh import Mesh

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
CONSORTIUM = "http://schemas.microsoft.com/3dmanufacturing"
SPACES = (
    f'xmlns="{CORE}" xmlns:p="{CONSORTIUM}/production/2015/06" xmlns:m="{CONSORTIUM}/material/2015/02" '
    f'xmlns:b="{CONSORTIUM}/beamlattice/2017/02" xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06" '
    'xmlns:cura="http://software.ultimaker.com/xml/cura/3mf/2015/10"'
)
TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="png" ContentType="image/png"/></Types>'
)
RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/{}" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
MAIN, RELS = "3D/3dmodel.model", "_rels/.rels"
PICTURE = b"\x89PNG\r\n\x1a\n" + bytes(range(256))


def mesh_xml(*bodies: Body, marks: dict[int, str] | None = None, more: str = "") -> str:
    """The mesh of bodies one after the other, with further attributes of some triangles."""
    starts = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    faces = np.concatenate([body.faces + start for body, start in zip(bodies, starts, strict=False)])
    vertices = np.concatenate([body.vertices for body in bodies]).tolist()
    v = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in vertices)
    t = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"{(marks or {}).get(k, "")}/>'
        for k, (a, b, c) in enumerate(faces.tolist())
    )
    return f"<mesh><vertices>{v}</vertices><triangles>{t}</triangles>{more}</mesh>"


def model(resources: str, build: str, attributes: str = "") -> str:
    """A model."""
    text = f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" {SPACES} {attributes}>'
    return f"{text}<resources>{resources}</resources><build>{build}</build></model>"


def write(path: Path, files: Mapping[str, str | bytes]) -> Path:
    """An archive with a picture."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        whole = {"[Content_Types].xml": TYPES, RELS: RELATIONS.format(MAIN), **files}
        for name, text in {**whole, "Metadata/thumbnail.png": PICTURE}.items():
            archive.writestr(name, text)
    return path


def prusa(path: Path, bodies: list[tuple[Body, str]], marks: dict[int, str] | None = None) -> Path:
    """A project of PrusaSlicer: an object of volumes, "lid", beside an object "tub", by two filaments."""
    volumes, first = "", 0
    for number, (body, kind) in enumerate(bodies):
        notes = {"name": f"volume {number}", "volume_type": kind, "extruder": str(number % 2 + 1)}
        rows = "".join(f'<metadata type="volume" key="{k}" value="{v}"/>\n' for k, v in notes.items())
        last = first + len(body.faces) - 1
        volumes += f'<volume firstid="{first}" lastid="{last}">\n{rows}</volume>\n'
        first = last + 1
    name = (
        '<metadata type="object" key="name" value="{}"/>\n<metadata type="object" key="extruder" value="1"/>'
    )
    tub = box((20.0, 20.0, 10.0), (0.0, 60.0, 5.0))
    config = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<config>\n'
        f'<object id="1" instances_count="1">{name.format("lid")}{volumes}</object>\n'
        f'<object id="2" instances_count="1">{name.format("tub")}<volume firstid="0" lastid="11">'
        '<metadata type="volume" key="name" value="tub"/></volume></object>\n</config>'
    )
    objects = f'<object id="1" type="model">{mesh_xml(*(body for body, _ in bodies), marks=marks)}</object>'
    objects += f'<object id="2" type="model">{mesh_xml(tub)}</object>'
    build = '<item objectid="1" transform="1 0 0 0 1 0 0 0 1 90 90 0" printable="1"/>'
    build += '<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 210 90 0" printable="1"/>'
    return write(
        path,
        {
            MAIN: model(objects, build),
            "Metadata/Slic3r_PE_model.config": config,
            "Metadata/Slic3r_PE.config": '; extruder_colour = "";""\n; filament_colour = #FF0000;#0000FF\n',
        },
    )


def bambu(path: Path, kinds: tuple[str, ...] = ("normal_part", "negative_part", "modifier_part")) -> Path:
    """A project of Bambu Studio: an object of parts, placed twice, with a mesh that parts share."""
    box_of = box((30.0, 30.0, 10.0), (0.0, 0.0, 5.0))
    tool = box((8.0, 8.0, 30.0), (0.0, 0.0, 5.0))
    inner = model(
        "".join(
            f'<object id="{k}" p:UUID="0001000{k}-81cb-4c03-9d28-80fed5dfa1dc" type="model">{mesh_xml(body)}'
            "</object>"
            for k, body in ((1, box_of), (2, tool))
        ),
        "",
        'requiredextensions="p"',
    )
    numbers = [1, *(2 for _ in kinds[1:])]
    components = "".join(
        f'<component p:path="/3D/Objects/object_1.model" objectid="{number}" '
        f'p:UUID="0001000{k}-b206-40ff-9872-83e8017abed1" transform="1 0 0 0 1 0 0 0 1 {8 * k} 0 0"/>'
        for k, number in enumerate(numbers)
    )
    main = model(
        f'<object id="3" p:UUID="00000001-61cb-4c03-9d28-80fed5dfa1dc" type="model">'
        f"<components>{components}</components></object>",
        "".join(
            f'<item objectid="3" p:UUID="0000000{x}-b1ec-4553-aec9-835e5b724bb4" '
            f'transform="1 0 0 0 1 0 0 0 1 {60 * x} 80 0" printable="1"/>'
            for x in (1, 2)
        ),
        'requiredextensions="p"',
    )
    parts = "".join(
        f'<part id="{number}" subtype="{kind}"><metadata key="name" value="part {k}"/>'
        f'<metadata key="extruder" value="{k % 2 + 1}"/><mesh_stat face_count="12" edges_fixed="0"/></part>'
        for k, (number, kind) in enumerate(zip(numbers, kinds, strict=True))
    )
    instances = "".join(
        f'<model_instance><metadata key="object_id" value="3"/><metadata key="instance_id" value="{k}"/>'
        "</model_instance>"
        for k in (0, 1)
    )
    notes = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<config><object id="3"><metadata key="name" value="plate"/>'
        f'<metadata key="extruder" value="1"/><metadata face_count="{12 * len(kinds)}"/>{parts}</object>'
        f'<plate><metadata key="plater_id" value="1"/>{instances}</plate></config>'
    )
    settings = '{"filament_colour": ["#00FF00", "#FF00FFFF"]}'
    return write(
        path,
        {
            MAIN: main,
            "3D/Objects/object_1.model": inner,
            "3D/_rels/3dmodel.model.rels": RELATIONS.format("3D/Objects/object_1.model"),
            "Metadata/model_settings.config": notes,
            "Metadata/project_settings.config": settings,
        },
    )


def box(size: tuple[float, float, float], middle: tuple[float, float, float]) -> Body:
    """A box."""
    corners = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    faces += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    return Body(corners * size + middle, np.array(faces))


def textured(mesh: Mesh, chosen: Index) -> Textured:
    """A mesh whose chosen faces are divided at their middles, in place of a texture."""
    body = mesh.body
    middle = len(body.vertices) + np.arange(len(chosen))
    corners = body.faces[chosen]
    fine = np.stack(
        [np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)[:, k] for k in range(3)], axis=1
    )
    fine = np.concatenate([fine, np.broadcast_to(middle[:, None, None], (len(chosen), 3, 1))], axis=2)
    vertices = np.concatenate([body.vertices, body.vertices[corners].mean(axis=1)])
    rest = np.delete(np.arange(len(body.faces)), chosen)
    faces = np.concatenate([fine.reshape(-1, 3), body.faces[rest]])
    source = mesh.origin[np.concatenate([np.repeat(chosen, 3), rest])]
    return Textured(mesh.pieces, mesh.unit_mm, Body(vertices, faces), source, 3 * len(chosen))
