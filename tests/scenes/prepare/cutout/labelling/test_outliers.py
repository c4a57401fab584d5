import numpy as np

from scenes.prepare.cutout.labelling.outliers import outliers
from scenes.prepare.cutout.votes.lifting import Vote
from scenes.splats import SH_C0, SplatCloud

DARK, BRIGHT = (0.2, 0.2, 0.22), (0.8, 0.75, 0.65)


def splats(points, colour, rng):
    colours = np.asarray(colour) + rng.normal(scale=0.01, size=(len(points), 3))
    sh = ((colours - 0.5) / SH_C0)[:, None, :].astype(np.float32)
    n = len(points)
    return points, np.tile([0.012, 0.012, 0.002], (n, 1)), np.tile([1.0, 0, 0, 0], (n, 1)), sh


def room_with(beside_colour, beside=10):
    """A bright floor, a dark block on it, and splats that hang beside it; (cloud, what is what)."""
    rng = np.random.default_rng(3)
    floor = np.column_stack([rng.uniform(-0.8, 0.8, (6000, 2)), rng.normal(0, 0.003, 6000)])
    block = rng.uniform((-0.1, -0.1, 0.03), (0.1, 0.1, 0.5), (400, 3))
    hanging = rng.uniform((0.2, -0.05, 0.04), (0.25, 0.05, 0.06), (beside, 3))
    parts = [
        splats(floor, BRIGHT, rng),
        splats(block, DARK, rng),
        splats(hanging, beside_colour, rng),
    ]
    means, scales, rotations, sh = (np.concatenate(part) for part in zip(*parts, strict=True))
    kind = np.repeat(np.arange(3), [len(part[0]) for part in parts])
    return SplatCloud(means, scales, rotations, np.full(len(means), 0.8), sh), kind


def seen_astray(beside_colour, *, views=3, beside=10, share=0.0):
    """Which of the splats beside the block are told, by masks that hold the block."""
    cloud, kind = room_with(beside_colour, beside)
    seen = np.full(len(cloud), 5.0, dtype=np.float32)
    inside = seen * np.select([kind == 1, kind == 2], [1.0, share], 0.0).astype(np.float32)
    vote = Vote(inside, seen, np.zeros((1, 1), dtype=np.float32))
    in_boxes = (np.abs(cloud.means[:, :2]) < 0.3).all(axis=1)
    told = outliers(cloud, kind > 0, [vote] * views, in_boxes=in_boxes)
    assert not told[kind < 2].any()
    return told[kind == 2]


def test_what_hangs_beside_a_thing_in_the_colours_of_the_ground_is_astray():
    assert seen_astray(BRIGHT).all()


def test_a_leg_that_masks_lost_is_not():
    assert not seen_astray(DARK).any()


def test_one_view_does_not_tell():
    assert not seen_astray(BRIGHT, views=1).any()


def test_what_lies_on_the_outline_is_not():
    assert not seen_astray(BRIGHT, share=0.3).any()


def test_masks_that_lost_much_of_a_thing_are_not_believed():
    assert not seen_astray(BRIGHT, beside=80).any()
