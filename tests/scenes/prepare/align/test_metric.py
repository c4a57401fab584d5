import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import rotation_from_vector
from scenes.prepare.align.metric import guessed_alignment
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.reconstruction import Reconstruction, View

CAMERA = Pinhole(640, 480, 500.0, 500.0, 320.0, 240.0)


def room(height_m, seed=0):
    """Views carried around at a height over a floor of 4 × 4 m with walls, and its points."""
    rng = np.random.default_rng(seed)
    floor = np.column_stack([rng.uniform(-2, 2, (900, 2)), rng.normal(0, 0.002, 900)])
    wall = np.column_stack([np.full(400, 2.0), rng.uniform(-2, 2, 400), rng.uniform(0, 2.4, 400)])
    points = np.concatenate([floor, wall])
    views = []
    for k in range(12):
        turn = 2 * np.pi * k / 12
        eye = np.array([np.cos(turn), np.sin(turn), height_m])
        views.append(View(f"{k}.jpg", None, CAMERA, look_at(eye, eye * 0.2 + [0, 0, 0.4])))
    n = len(points)
    return Reconstruction(tuple(views), points, np.zeros((n, 3), np.uint8), np.zeros(n, np.float32))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_room_of_any_scale_comes_out_upright_with_its_floor_at_zero(seed):
    rng = np.random.default_rng(seed)
    true = room(1.5, seed)
    turn = rotation_from_vector(rng.normal(size=3))
    hidden = Similarity(float(rng.uniform(0.1, 10)), turn, rng.normal(size=3))
    alignment = guessed_alignment(hidden.moved_reconstruction(true), rng=rng)
    # Up to yaw and a shift on the floor, the true room is back.
    back = alignment.world_from_reconstruction @ hidden
    assert back.scale == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(back.rotation[2], [0, 0, 1], atol=0.01)
    assert (back @ true.points[:900])[:, 2] == pytest.approx(0.0, abs=0.03)


def test_it_says_that_the_scale_is_a_guess():
    alignment = guessed_alignment(room(1.5), rng=np.random.default_rng(0))
    assert "estimated" in alignment.warnings[0]
    assert alignment.anchors == ()
    error = alignment.predicted_error_m([[3.0, 0.0, 0.0]])
    assert error[0] > 0.5


def test_without_a_floor_it_says_so():
    full = room(1.5)
    few = Reconstruction(full.views, full.points[:3], full.colours[:3], full.errors_px[:3])
    alignment = guessed_alignment(few, rng=np.random.default_rng(0))
    assert "No floor" in alignment.warnings[1]
    up = alignment.world_from_reconstruction.rotation[2]
    assert up @ [0, 0, 1] > 0.99
