import numpy as np

from scenes.prepare.cutout.connected_bodies import bodies, bodies_of_splats
from scenes.splats import SplatCloud

HEAPS = np.random.default_rng(0).uniform(-0.02, 0.02, (40, 3)) + np.repeat(
    [[0.0, 0, 0], [0.5, 0, 0]], 20, axis=0
)


def with_a_rod(opacity):
    """Two heaps of small splats, and one long thin one between them."""
    means = np.concatenate([HEAPS, [[0.25, 0, 0]]])
    scales = np.full((41, 3), 0.005)
    scales[40, 0] = 0.12
    turns = np.tile([1.0, 0, 0, 0], (41, 1))
    opacities = np.append(np.full(40, 0.9), opacity)
    return SplatCloud(means, scales, turns, opacities, np.zeros((41, 1, 3), np.float32))


def test_points_apart_are_two_bodies():
    count, body = bodies(HEAPS, 0.1)
    assert count == 2
    assert len(set(body[:20])) == len(set(body[20:])) == 1


def test_a_long_splat_holds_together_what_it_reaches_and_a_faint_one_does_not():
    count, body = bodies_of_splats(with_a_rod(0.8), 0.1)
    assert (count, set(body)) == (1, {0})
    count, body = bodies_of_splats(with_a_rod(0.03), 0.1)
    assert count == 3
    assert body[0] != body[20] != body[40]
