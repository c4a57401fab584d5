import numpy as np
import pytest

from benchmarks.evaluate.tables.distance import bound_in_words, pose_bound
from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.samples import sample_room


@pytest.fixture(scope="module")
def chair():
    return sample_room("lab").object_by_id("chair-1")


@pytest.fixture(scope="module")
def eye():
    """A lens 1.3 m up that looks along world y."""
    room = sample_room("lab")
    return Pose(room.world_from_rig.rotation, np.array([0.0, 0.0, 1.3]))


def lens(f_px):
    return Fisheye.from_fov(round(f_px * np.radians(200)), np.radians(200))


def rms_over_yaws(f_px, eye, chair, distance_m, *, on_floor):
    words = [
        bound_in_words(
            pose_bound(
                lens(f_px), eye, chair, Pose.from_yaw(yaw, (0, distance_m, 0)), on_floor=on_floor
            )
        )
        for yaw in np.arange(4) * np.pi / 4
    ]
    return np.sqrt(np.mean(np.square(words), axis=0))


@pytest.mark.parametrize(
    ("distance_m", "on_floor", "world_cm", "yaw_deg"),
    [(3, True, 0.28, 0.17), (4, True, 0.58, 0.25), (4, False, 1.24, 0.25), (6, True, 1.55, 0.45)],
)
def test_it_agrees_with_what_was_computed_for_a_chair_of_that_size(
    eye, chair, distance_m, on_floor, world_cm, yaw_deg
):
    """Another chair, a pinhole and eight yaws there: the same to within its shape."""
    found = rms_over_yaws(184.75, eye, chair, distance_m, on_floor=on_floor)
    assert found[0] == pytest.approx(world_cm, rel=0.4)
    assert found[1] == pytest.approx(yaw_deg, rel=0.45)


def test_twice_the_focal_length_leaves_a_third_of_the_error(eye, chair):
    """The bound goes with f to the power of -1.5."""
    coarse = rms_over_yaws(200.0, eye, chair, 3, on_floor=True)[0]
    fine = rms_over_yaws(400.0, eye, chair, 3, on_floor=True)[0]
    assert coarse / fine == pytest.approx(2**1.5, rel=0.12)


def test_not_knowing_the_floor_costs_accuracy(eye, chair):
    known = pose_bound(lens(300), eye, chair, Pose.from_yaw(0.3, (0, 3, 0)), on_floor=True)
    free = pose_bound(lens(300), eye, chair, Pose.from_yaw(0.3, (0, 3, 0)), on_floor=False)
    assert known[2, 2] == 0.0
    assert np.trace(free[:3, :3]) > 2 * np.trace(known[:3, :3])
    assert np.linalg.eigvalsh(free).min() > 0


def test_an_object_behind_the_lens_has_no_outline(eye, chair):
    with pytest.raises(ValueError, match="outside the lens"):
        pose_bound(lens(300), eye, chair, Pose.from_yaw(0.0, (0, -3, 0)), on_floor=True)
