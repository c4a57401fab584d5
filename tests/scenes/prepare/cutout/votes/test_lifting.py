import numpy as np

from scenes.prepare.cutout.votes.lifting import Vote, inside_share

NO_DEPTH = np.zeros((1, 1), dtype=np.float32)


def vote(inside, seen):
    return Vote(np.array(inside, dtype=np.float32), np.array(seen, dtype=np.float32), NO_DEPTH)


def test_a_near_view_has_one_voice_of_three():
    """Of three splats, on the thing, in the near mask only, and seen by none."""
    near = vote([300, 300, 0], [300, 300, 0])
    far = vote([20, 0, 0], [20, 20, 0])
    share = inside_share([near, far, far])
    assert share[0] > 0.95
    assert 0.3 < share[1] < 0.4
    assert share[2] == 0


def test_who_hardly_sees_a_splat_hardly_counts():
    sees, glimpses = vote([50], [50]), vote([0], [0.02])
    assert inside_share([sees, glimpses])[0] > 0.9
    assert inside_share([glimpses, glimpses])[0] == 0
