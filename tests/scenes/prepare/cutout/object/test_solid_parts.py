import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.opening import open_scene
from scenes.prepare.cutout.object.solid_parts import (
    guessed_mass_kg,
    solid_parts,
    solid_parts_of_surface,
)
from scenes.samples import sample_room
from scenes.splats import SplatCloud


def shell(size, rng, n=9000, bottom=True):
    """Flat splats on the faces of a box that stands on the origin, the bottom's left out or not."""
    points = rng.uniform(-0.5, 0.5, (n, 3))
    side = rng.integers(0, 3, n)
    end = rng.choice([-0.5, 0.5], n)
    points[np.arange(n), side] = end
    kept = bottom | (side != 2) | (end > 0)
    points = (points * size + (0, 0, 0.5 * size[2]))[kept]
    scales = np.full((len(points), 3), 0.012)
    scales[np.arange(len(points)), side[kept]] = 0.001
    return SplatCloud(
        points,
        scales,
        np.tile([1.0, 0, 0, 0], (len(points), 1)),
        np.full(len(points), 0.9),
        np.zeros((len(points), 1, 3), np.float32),
    )


def volume(parts):
    return sum(8 * np.prod(part.half_size_m) for part in parts)


def corners(part):
    unit = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    return part.object_from_box @ (unit * part.half_size_m)


@settings(max_examples=12, deadline=None)
@given(size=st.tuples(*[st.floats(0.12, 0.7)] * 3), bottom=st.booleans())
def test_a_hollow_shell_is_one_solid_box_even_without_its_underside(size, bottom):
    rng = np.random.default_rng(3)
    parts = solid_parts(shell(np.array(size), rng, bottom=bottom), size)
    assert volume(parts) == pytest.approx(np.prod(size), rel=0.02)
    assert len(parts) == 1


@pytest.mark.parametrize("name", ["lab", "desk"])
def test_parts_stay_in_the_box_apart_from_each_other_and_masses_are_near(name):
    true = {item.object_id: item for item in sample_room(name).objects}
    for item in open_scene(name).objects:
        parts = solid_parts(item.splats, item.box_m)
        assert 1 <= len(parts) <= 16
        low, high = np.array(
            [(corners(p).min(axis=0), corners(p).max(axis=0)) for p in parts]
        ).swapaxes(0, 1)
        half = 0.5 * np.array([*item.box_m[:2], 0.0])
        assert (low > -half - 1e-9).all()
        assert (high < np.array([*half[:2], item.box_m[2]]) + 1e-9).all()
        for k in range(len(parts)):
            shared = np.minimum(high, high[k]) - np.maximum(low, low[k])
            assert (shared > 1e-9).all(axis=1).sum() == 1
        mass = true[item.object_id].mass_kg
        assert mass / 3 < guessed_mass_kg(parts, item.box_m) < 3 * mass


def test_a_chair_is_open_below_its_seat():
    chair = open_scene("lab").object_by_id("chair-1")
    parts = solid_parts(chair.splats, chair.box_m)
    between_legs = np.array([0.0, 0.05, 0.2])
    for part in parts:
        inside = np.abs(part.object_from_box.inverse() @ between_legs[None])[0]
        assert (inside > part.half_size_m).any()
    assert min(corners(part)[:, 2].min() for part in parts) == pytest.approx(0.0, abs=0.03)


def test_too_few_splats_leave_one_box():
    nothing = shell(np.ones(3), np.random.default_rng(0), n=0)
    (part,) = solid_parts(nothing, (0.2, 0.3, 0.4))
    assert part.half_size_m == pytest.approx((0.1, 0.15, 0.2))
    np.testing.assert_allclose(part.object_from_box.translation, (0, 0, 0.2))


@settings(max_examples=12, deadline=None)
@given(size=st.tuples(*[st.floats(0.12, 0.7)] * 3))
def test_a_known_surface_is_covered_like_a_scanned_one(size):
    rng = np.random.default_rng(4)
    parts = solid_parts_of_surface(shell(np.array(size), rng, n=60_000).means, size)
    assert volume(parts) == pytest.approx(np.prod(size), rel=1e-6)
    assert len(parts) == 1


def test_the_space_under_a_table_stays_free():
    rng = np.random.default_rng(5)
    top = rng.uniform((-0.4, -0.3, 0.56), (0.4, 0.3, 0.6), (40_000, 3))
    legs = [
        rng.uniform((x - 0.02, y - 0.02, 0.0), (x + 0.02, y + 0.02, 0.56), (5000, 3))
        for x in (-0.38, 0.38)
        for y in (-0.28, 0.28)
    ]
    parts = solid_parts_of_surface(np.concatenate([top, *legs]), (0.8, 0.6, 0.6))
    assert len(parts) == 5
    for part in parts:
        low, high = corners(part).min(axis=0), corners(part).max(axis=0)
        assert not ((low < (0, 0, 0.3)) & (high > (0, 0, 0.3))).all()
