import numpy as np

from scenes.prepare.cutout.object.side_views import (
    MIN_VIEWS,
    far_ends,
    middle_of_top,
    reach_across,
    widest_reach,
)
from scenes.prepare.cutout.votes.seen_from import SeenFrom

X = np.array([1.0, 0.0])


def shown(turn, rng, *, rough_m=0.03):
    """The faces of a box that a view from far away sees, with depths that are rough by that."""
    eye = np.array([5 * np.cos(turn), 5 * np.sin(turn), 1.0])
    points = rng.uniform((-0.3, -0.2, 0.0), (0.3, 0.2, 0.4), (20_000, 3))
    rays = points - eye
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    return SeenFrom(eye, points + rays * rng.normal(0.0, rough_m, len(points))[:, None])


def test_rough_depths_do_not_matter_to_views_that_look_across():
    rng = np.random.default_rng(1)
    turns = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    low, high = reach_across([shown(turn, rng) for turn in turns], X, 0.0) or (0.0, 0.0)
    np.testing.assert_allclose((low, high), (-0.3, 0.3), atol=0.02)
    along = [shown(turn, rng) for turn in (0.0, 0.2, -0.2, np.pi)]
    assert reach_across(along, X, 0.0) is None
    assert max(view.points[:, 0].max() for view in along) > 0.35


def test_of_views_that_look_across_those_that_do_most_are_heard():
    rng = np.random.default_rng(4)
    across = [shown(turn, rng) for turn in np.linspace(1.4, 1.75, 5)]
    # Rays that miss the near rim, taken to be as far away as what they should have hit.
    oblique = [shown(turn, rng) for turn in np.linspace(0.85, 1.15, 5)]
    cut = [SeenFrom(view.eye, view.points[view.points[:, 0] < 0.26]) for view in oblique]
    ends = reach_across(across + cut, X, 0.0)
    assert ends is not None
    np.testing.assert_allclose(ends, (-0.3, 0.3), atol=0.02)


def test_a_stray_beside_the_thing_and_what_lies_below_do_not_count():
    rng = np.random.default_rng(2)
    views = []
    for turn in np.linspace(1.2, 1.9, MIN_VIEWS):
        view = shown(turn, rng)
        stray = rng.uniform((0.35, 0.0, 0.2), (0.36, 0.01, 0.21), (8, 3))
        below = rng.uniform((-0.9, -0.9, -0.1), (0.9, 0.9, -0.01), (2000, 3))
        views.append(SeenFrom(view.eye, np.concatenate([view.points, stray, below])))
    ends = reach_across(views, X, 0.0)
    assert ends is not None
    np.testing.assert_allclose(ends, (-0.3, 0.3), atol=0.02)
    assert reach_across(views[1:], X, 0.0) is None


def test_the_far_rim_of_a_level_top_is_told_by_rays_alone():
    rng = np.random.default_rng(3)
    turn, apart = rng.uniform(0, 2 * np.pi, 5000), 0.18 * np.sqrt(rng.uniform(0, 1, 5000))
    seat = np.stack([apart * np.cos(turn), apart * np.sin(turn), np.full(5000, 0.45)], axis=1)
    views = []
    for angle in (-0.4, 0.0, 0.4):
        eye = np.array([-2.0 * np.cos(angle), 2.0 * np.sin(angle), 1.4])
        # The far side is drawn too near, and so too high.
        nearer = 1.0 - 0.015 * (seat[:, :1] + 0.18) / 0.36
        views.append(SeenFrom(eye, eye + (seat - eye) * nearer))
    assert max(view.points[:, 0].max() for view in views) < 0.16
    low, high = far_ends(views, X, 0.45)
    assert low is None
    assert high is not None
    assert abs(high - 0.18) < 0.01
    assert far_ends(views[1:], X, 0.45) == (None, None)
    level_with_it = [SeenFrom(view.eye - (0, 0, 0.8), view.points) for view in views]
    assert far_ends(level_with_it, X, 0.45) == (None, None)


def test_the_middle_of_a_level_top_is_told_though_its_depths_are_wrong():
    rng = np.random.default_rng(5)
    turn, apart = rng.uniform(0, 2 * np.pi, 20_000), 0.18 * np.sqrt(rng.uniform(0, 1, 20_000))
    seat = np.stack([apart * np.cos(turn), apart * np.sin(turn), np.full(20_000, 0.45)], axis=1)
    legs = rng.uniform((-0.4, -0.4, 0.0), (0.1, 0.1, 0.38), (3000, 3))
    views = []
    for angle in (-0.4, 0.0, 0.4):
        eye = np.array([-2.0 * np.cos(angle), 2.0 * np.sin(angle), 1.4])
        nearer = eye + (seat - eye) * rng.uniform(0.97, 1.0, (20_000, 1))
        views.append(SeenFrom(eye, np.concatenate([nearer, legs])))
    middle = middle_of_top(views, 0.45)
    assert middle is not None
    np.testing.assert_allclose(middle, (0.0, 0.0), atol=0.01)
    assert middle_of_top(views[1:], 0.45) is None
    assert middle_of_top([views[1]] * 3, 0.45) is None


def test_a_far_rim_lies_half_a_pixel_beyond_the_last_one():
    seat = np.stack(np.meshgrid(np.linspace(-0.18, 0.18, 80), np.linspace(-0.18, 0.18, 80), [0.45]))
    eye = np.array([-2.0, 0.0, 1.45])
    _, fine = far_ends([SeenFrom(eye, seat.reshape(3, -1).T)] * 3, X, 0.45)
    _, coarse = far_ends([SeenFrom(eye, seat.reshape(3, -1).T, 0.002)] * 3, X, 0.45)
    assert fine is not None
    assert coarse is not None
    # Half a pixel is 0.001 rad, over 2.2 m, on a top that is met at a slope of one in two.
    assert abs((coarse - fine) - 0.001 * (2.0**2 + 1.0)) < 1e-4


def test_no_thing_reaches_beyond_what_two_views_see():
    rng = np.random.default_rng(6)
    along = [shown(turn, rng, rough_m=0.001) for turn in (0.0, 0.1, -0.1)]
    cloud = rng.uniform((0.4, -0.2, 0.0), (0.5, 0.2, 0.4), (2000, 3))
    one_is_wrong = [SeenFrom(along[0].eye, np.concatenate([along[0].points, cloud])), *along[1:]]
    reach = widest_reach(one_is_wrong, X, 0.0)
    assert reach is not None
    np.testing.assert_allclose(reach, (-0.3, 0.3), atol=0.02)
    assert widest_reach(along[1:], X, 0.0) is None
    assert widest_reach(along, X, 0.5) is None
