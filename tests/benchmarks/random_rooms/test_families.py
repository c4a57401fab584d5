"""`benchmarks.random_rooms.room`: each member stands, is closed, as symmetric as said."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from benchmarks.random_rooms.movable import ROUND, TOP
from benchmarks.random_rooms.room import FAMILIES
from scenes.rays import RayScene

MEMBERS = [(family, k) for family in FAMILIES for k in range(2)]


def member(family, k):
    return FAMILIES[family](np.random.default_rng([7, list(FAMILIES).index(family), k]))


def test_there_are_at_least_fourteen_families():
    assert len(FAMILIES) >= 14


@pytest.mark.parametrize(("family", "k"), MEMBERS)
def test_a_member_stands_on_the_plane_and_fills_its_box(family, k):
    item = member(family, k)
    low, high = item.mesh().bounds()
    assert low[2] == pytest.approx(0.0, abs=1e-9)
    assert high[2] == pytest.approx(item.box_m[2])
    assert min(item.box_m) >= 0.015
    assert max(item.box_m) <= 1.7
    half = np.array(item.box_m[:2]) / 2
    assert (np.maximum(high[:2], -low[:2]) == pytest.approx(half, abs=1e-9)) or item.symmetry != 1
    assert (high[:2] <= half + 1e-9).all()
    assert (low[:2] >= -half - 1e-9).all()
    if TOP in item.on:
        assert item.box_m[2] < 0.7


@pytest.mark.parametrize(("family", "k"), MEMBERS)
def test_parts_are_within_the_box(family, k):
    item = member(family, k)
    limit = np.array([*(np.array(item.box_m[:2]) / 2), item.box_m[2]]) * 1.25 + 0.03
    for part in item.parts:
        assert min(part.half_size_m) > 0
        assert (np.abs(part.object_from_box.translation) <= limit).all()


def leaves(family, k, triangles):
    """(T,) whether a triangle belongs to a surface that is there from both sides."""
    surfaces = [s.points for s in member(family, k).surfaces]
    both = [
        points.reshape(-1, 3)
        for points in surfaces
        if any(np.array_equal(points, other[:, ::-1]) for other in surfaces if other is not points)
    ]
    if not both:
        return np.zeros(len(triangles), bool)
    apart, _ = KDTree(np.concatenate(both)).query(triangles.reshape(-1, 3))
    return (apart < 1e-6).reshape(-1, 3).all(axis=1)


@pytest.mark.parametrize(("family", "k"), MEMBERS)
def test_most_rays_from_outside_meet_the_front_of_a_surface(family, k):
    """Watertight enough: what is seen from outside is the outer side of some face."""
    mesh = member(family, k).mesh()
    triangles = mesh.vertices[mesh.faces]
    rng = np.random.default_rng(3)
    points = triangles.mean(axis=1)[rng.integers(0, len(triangles), 200)]
    towards = rng.standard_normal((200, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    hits = RayScene(triangles).cast(points + 3.0 * towards, -towards)
    met = hits.triangle >= 0
    facing = (hits.normals[met] * towards[met]).sum(axis=1)
    assert met.mean() > 0.9
    # A leaf is two sides in one place: a ray meets either.
    is_leaf = leaves(family, k, triangles)[hits.triangle[met]]
    assert ((facing > -1e-6) | is_leaf).mean() > 0.95


@pytest.mark.parametrize("family", list(FAMILIES))
def test_symmetric_members_look_the_same_after_a_turn(family):
    for k in range(6):
        item = member(family, k)
        if item.symmetry == 1:
            continue
        angle = 0.7 if item.symmetry == ROUND else 2 * np.pi / item.symmetry
        points = np.concatenate([s.points.reshape(-1, 3) for s in item.surfaces])
        c, s = np.cos(angle), np.sin(angle)
        turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
        apart, _ = KDTree(points).query(turned)
        # Rings of a lathe have their points every 13° to 18°.
        assert np.percentile(apart, 95) < 0.04 * max(item.box_m)


def test_members_differ_and_the_same_seed_gives_the_same():
    for family in FAMILIES:
        one, same, other = member(family, 0), member(family, 0), member(family, 1)
        assert one.box_m == same.box_m
        assert np.array_equal(one.mesh().texture, same.mesh().texture)
        assert one.box_m != other.box_m
