import numpy as np

from scenes.prepare.cutout.proposals import propose
from scenes.prepare.cutout.remainder.floaters import find_floaters
from scenes.splats import SplatCloud


def splats(points, scale=0.012, opacity=0.9):
    n = len(points)
    scales = np.tile([scale, scale, 0.002], (n, 1))
    return SplatCloud(
        points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, opacity), np.zeros((n, 1, 3))
    )


def shell(centre, size, n, rng):
    """Points on the faces of a box that stands at the centre's height."""
    inner = rng.uniform(-0.5, 0.5, (n, 3))
    side = rng.integers(0, 3, n)
    inner[np.arange(n), side] = rng.choice([-0.5, 0.5], n)
    return inner * size + centre + np.array([0, 0, size[2] / 2])


def test_things_on_the_floor_and_on_a_table_are_proposed_and_the_table_is_not():
    rng = np.random.default_rng(4)
    parts = [
        rng.uniform((-2, -2, 0), (2, 2, 0.001), (30000, 3)),
        shell((0.8, 0, 0), (1.6, 0.8, 0.7), 12000, rng),
        shell((0.8, 0.1, 0.7), (0.2, 0.15, 0.1), 1500, rng),
        shell((-1, 0.5, 0), (0.3, 0.4, 0.5), 4000, rng),
    ]
    truth = np.concatenate([np.full(len(part), k) for k, part in enumerate(parts)])
    found = propose(splats(np.concatenate(parts)))
    assert len(found) == 2
    for item in found:
        labels = item.found.labels
        thing = np.bincount(truth[labels]).argmax()
        assert thing in (2, 3)
        wanted = truth == thing
        assert (labels & wanted).sum() / (labels | wanted).sum() > 0.8
        size = {2: (0.2, 0.15, 0.1), 3: (0.3, 0.4, 0.5)}[int(thing)]
        np.testing.assert_allclose(sorted(item.box.size_m), sorted(size), atol=0.02)
        assert item.score > 0.9
    assert propose(splats(parts[0])) == ()


def test_strays_float_and_surfaces_do_not():
    rng = np.random.default_rng(6)
    floor = splats(rng.uniform((-1, -1, 0), (1, 1, 0.001), (3000, 3)), scale=0.02)
    assert not find_floaters(floor).any()
    strays = splats(np.array([[0, 0, 1.0], [0.01, 0, 1.0], [0.5, 0.5, 0.7]]), scale=0.01)
    room = SplatCloud(
        *(
            np.concatenate([getattr(floor, field), getattr(strays, field)])
            for field in ("means", "scales", "rotations", "opacities", "sh")
        )
    )
    np.testing.assert_array_equal(np.flatnonzero(find_floaters(room)), [3000, 3001, 3002])
    assert find_floaters(room.select(np.zeros(0, dtype=int))).shape == (0,)


def test_a_wide_sparse_wall_is_one_body():
    places = np.stack(np.meshgrid(np.arange(8) * 0.4, [0.0], np.arange(6) * 0.4), axis=-1)
    wall = splats(places.reshape(-1, 3), scale=0.12)
    assert not find_floaters(wall).any()
