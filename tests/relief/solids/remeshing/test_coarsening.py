"""Fewer triangles where a body is flat and carries nothing; its edges and round sides stay."""

import numpy as np
import trimesh

from relief.solids.meshes.intersections import self_intersections
from relief.solids.remeshing.coarsening import coarsened
from relief.solids.remeshing.even_mesh import even_mesh
from relief.solids.remeshing.smooth_surface import units
from tests.relief.solids.remeshing.facets import of


def test_flat_sides_get_few_triangles_and_keep_their_edges_and_what_is_kept():
    box = trimesh.creation.box((24.0, 20.0, 6.0))
    mesh = even_mesh(of(box), 1.0)
    kept = mesh.body.vertices[mesh.body.faces][:, :, 0].max(axis=1) > 8.0
    coarse, left = coarsened(mesh, kept, 1.0)
    assert len(coarse.body.faces) - kept.sum() < 0.35 * (len(kept) - kept.sum())
    assert (mesh.body.vertices[left] == coarse.body.vertices).all()
    solid = trimesh.Trimesh(coarse.body.vertices, coarse.body.faces, process=False)
    assert solid.is_watertight and abs(solid.volume - box.volume) < 1e-3
    assert not self_intersections(coarse.body)
    middles = coarse.body.vertices[coarse.body.faces].mean(axis=1)
    assert np.abs(coarse.normals - units(coarse.body.normals)[:, None]).max() < 1e-3
    assert {tuple(place) for place in mesh.body.vertices[mesh.body.faces[kept]].mean(axis=1)} <= {
        tuple(place) for place in middles
    }


def test_a_round_side_stays():
    rod = of(trimesh.creation.cylinder(6.0, 8.0, sections=48))
    mesh = even_mesh(rod, 1.0)
    coarse, _ = coarsened(mesh, np.zeros(len(mesh.body.faces), bool), 1.0)
    side, same = (np.abs(units(of_.body.normals)[:, 2]) < 0.5 for of_ in (mesh, coarse))
    assert side.sum() == same.sum() and (~same).sum() < 0.7 * (~side).sum()
    nothing, left = coarsened(mesh, np.ones(len(mesh.body.faces), bool), 1.0)
    assert nothing is mesh and len(left) == len(mesh.body.vertices)
