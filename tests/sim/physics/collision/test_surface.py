"""Walls are planes, and a part that is scanned anew is exchanged and nothing else."""

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from sim.physics.collision.surface import rescanned, surface_of

ROOM = block((0, 0, 0), (4, 3, 2.5), is_room=True)
TABLE = block((1, 1, 0.7), (2, 2, 0.74))


def by_normal(surface):
    return {tuple(np.round(plane.normal).astype(int).tolist()): plane for plane in surface.planes}


def test_floor_walls_and_ceiling_are_planes_even_of_a_noisy_scan():
    surface = surface_of(scan_like(ROOM, edge_m=0.08, noise_m=0.004, seed=1))
    planes = by_normal(surface)
    assert len(planes) == 6
    assert all(plane.is_surface for plane in surface.planes)
    wanted = {(0, 0, 1): 0.0, (0, 0, -1): -2.5, (1, 0, 0): 0.0, (-1, 0, 0): -4.0,
              (0, 1, 0): 0.0, (0, -1, 0): -3.0}  # fmt: skip
    for normal, offset in wanted.items():
        assert planes[normal].offset_m == pytest.approx(offset, abs=0.002)
    # What lies in a plane needs no boxes.
    assert len(surface.patches) < 20


def test_a_missing_ceiling_is_closed_where_the_scan_ends():
    open_room = ROOM[ROOM[:, :, 2].min(axis=1) < 2.4]
    ceiling = by_normal(surface_of(open_room))[0, 0, -1]
    assert not ceiling.is_surface
    assert ceiling.offset_m == pytest.approx(-2.5, abs=0.2)


def test_a_niche_is_no_wall():
    # A wall with a niche of 30 cm behind it: the plane is the niche's end.
    room = np.concatenate([ROOM, block((-0.3, 0.5, 0.0), (0.0, 2.5, 2.0), is_room=True)])
    assert by_normal(surface_of(room))[1, 0, 0].offset_m == pytest.approx(-0.3, abs=0.01)


def test_nothing_to_collide_with_is_refused():
    with pytest.raises(ValueError, match="none covers"):
        surface_of(np.zeros((1, 3, 3)))
    with pytest.raises(ValueError, match="finite"):
        surface_of(np.full((1, 3, 3), np.nan))


def test_taking_a_table_away_leaves_the_rest_as_it_was():
    surface = surface_of(np.concatenate([ROOM, TABLE, block((3, 0.2, 0.3), (3.6, 0.8, 0.9))]))
    change = rescanned(surface, np.array([[0.9, 0.9, 0.6], [2.1, 2.1, 0.8]]), np.zeros((0, 3, 3)))
    left = change.surface.patches
    assert len(change.fresh) == 0
    assert 0 < len(left) < len(surface.patches)
    assert left.centre[:, 0].min() > 2.5
    assert (left.centre == surface.patches.centre[change.kept]).all()
    assert not change.rethought.any()


def test_what_is_scanned_anew_is_as_if_it_had_been_there_from_the_start():
    at_once = surface_of(np.concatenate([ROOM, TABLE])).patches
    change = rescanned(surface_of(ROOM), np.array([[0.9, 0.9, 0.6], [2.1, 2.1, 0.8]]), TABLE)
    later = change.surface.patches
    assert later.area_m2.sum() == pytest.approx(at_once.area_m2.sum(), rel=0.1)
    top = later.normal[:, 2] > 0.9
    assert later.centre[top, 2] == pytest.approx(np.full(top.sum(), 0.74), abs=1e-4)


def test_a_back_that_appears_makes_the_front_thinner():
    sheet = TABLE[np.abs(TABLE[:, :, 2] - 0.74).max(axis=1) < 1e-6]
    under = TABLE[np.abs(TABLE[:, :, 2] - 0.7).max(axis=1) < 1e-6]
    surface = surface_of(np.concatenate([ROOM, sheet]))
    assert surface.patches.depth_m.min() == pytest.approx(0.1)
    change = rescanned(surface, np.array([[1.0, 1.0, 0.69], [2.0, 2.0, 0.71]]), under)
    depth = change.surface.patches.depth_m
    assert depth.max() < 0.04


def test_a_region_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="region"):
        rescanned(surface_of(ROOM), np.full((2, 3), np.inf), TABLE)
