"""Surfaces are the room's meshes, in pieces, as fine as is asked for."""

from __future__ import annotations

import numpy as np

from sim.hololens.meshing import Meshing, gathered, numbers_at


def test_pieces_are_small_and_cover_the_room(small_room):
    surfaces = Meshing(small_room, 10**17).surfaces()
    assert len({each.guid for each in surfaces}) == len(surfaces)
    assert len({each.update_time for each in surfaces}) == len(surfaces)
    assert max(each.radius_m for each in surfaces) < 2.2
    corners = np.concatenate([s.room_from_surface @ s.vertices_m for s in surfaces])
    bounds = np.stack([mesh.bounds() for mesh in small_room.static])
    assert np.allclose(corners.min(axis=0), bounds[:, 0].min(axis=0), atol=0.05)
    assert np.allclose(corners.max(axis=0), bounds[:, 1].max(axis=0), atol=0.05)


def test_fewer_triangles_where_fewer_are_asked_for(small_room):
    surface = max(Meshing(small_room, 10**17).surfaces(), key=lambda each: len(each.triangles))
    fine, coarse = numbers_at(surface, 1e9), numbers_at(surface, 20.0)
    assert len(fine.triangles) == len(surface.triangles)
    assert 0 < len(coarse.triangles) < len(fine.triangles)


def test_triangles_are_wound_as_the_headset_does(small_room):
    surface = Meshing(small_room, 10**17).surfaces()[0]
    numbers = numbers_at(surface, 1e9)
    assert np.array_equal(numbers.triangles[:, ::-1], surface.triangles)


def test_gathering_keeps_the_plane():
    grid = np.stack(np.meshgrid(np.arange(11) / 10, np.arange(11) / 10), -1).reshape(-1, 2)
    vertices = np.column_stack([grid, np.zeros(len(grid))])
    a = np.arange(121).reshape(11, 11)
    faces = np.concatenate(
        [
            np.stack([a[:-1, :-1], a[:-1, 1:], a[1:, 1:]], -1).reshape(-1, 3),
            np.stack([a[:-1, :-1], a[1:, 1:], a[1:, :-1]], -1).reshape(-1, 3),
        ]
    )
    middle, kept = gathered(vertices, faces, grid_m=0.25)
    assert len(middle) == 25
    assert 20 <= len(kept) <= 40
    assert np.allclose(middle[:, 2], 0)


def test_versions_grow_and_surfaces_go(small_room):
    meshing = Meshing(small_room, 10**17)
    name = meshing.names()[0]
    before = {each.guid: each.update_time for each in meshing.surfaces()}
    meshing.touch(name)
    changed = [s for s in meshing.surfaces() if s.update_time != before[s.guid]]
    assert len(changed) == 1
    assert changed[0].update_time > max(before.values())
    meshing.remove(name)
    meshing.remove(name)
    assert name not in meshing.names()


def test_boxes_are_closed_and_face_outwards(small_room):
    meshing = Meshing(small_room, 10**17)
    meshing.put_box("box", np.array([0.5, 0.0, 0.25]), size_m=np.full(3, 0.5))
    box = next(each for each in meshing.surfaces() if len(each.triangles) == 12)
    a, b, c = (box.vertices_m[box.triangles[:, k]] for k in range(3))
    volume = float(np.sum(a * np.cross(b, c))) / 6
    assert np.isclose(volume, 0.125)
