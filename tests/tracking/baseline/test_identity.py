import numpy as np
import pytest

from scenes.pose import Pose
from tracking.baseline.detect import Detection
from tracking.baseline.identity import (
    GATE_PX,
    MOTION_PX,
    SIZE_CHANGE,
    Visibility,
    begin_track,
    ray_hits_box,
    settle,
    update_tracks,
)


def detection(x, y, width=40.0, height=60.0):
    box = np.array([x - width / 2, y - height / 2, x + width / 2, y + height / 2])
    return Detection("physical", 1.0, box, np.ones((4, 4), bool))


def test_constants_are_the_papers():
    assert GATE_PX == 100.0
    assert SIZE_CHANGE == 0.20


@pytest.mark.parametrize(("distance", "found"), [(99.0, True), (101.0, False)])
def test_gate(distance, found):
    tracks = {"a": begin_track("a", detection(200, 200))}
    track = update_tracks(tracks, [detection(200 + distance, 200)])["a"]
    assert (track.visibility is not Visibility.HIDDEN) is found
    assert track.centre_px[0] == pytest.approx(200 + distance if found else 200)


@pytest.mark.parametrize(
    ("width", "visibility"),
    [
        (40 * 1.19, Visibility.VISIBLE),
        (40 * 1.21, Visibility.PARTIAL),
        (40 * 0.79, Visibility.PARTIAL),
    ],
)
def test_size_change_means_partly_hidden(width, visibility):
    tracks = {"a": begin_track("a", detection(200, 200))}
    assert update_tracks(tracks, [detection(200, 200, width)])["a"].visibility is visibility


def test_two_objects_keep_their_identity_whatever_the_order_of_the_detections():
    tracks = {
        "a": begin_track("a", detection(100, 100)),
        "b": begin_track("b", detection(160, 100)),
    }
    updated = update_tracks(tracks, [detection(150, 100), detection(115, 100)])
    assert updated["a"].centre_px[0] == 115
    assert updated["b"].centre_px[0] == 150


def test_one_detection_serves_one_object_only():
    tracks = {
        "a": begin_track("a", detection(100, 100)),
        "b": begin_track("b", detection(130, 100)),
    }
    updated = update_tracks(tracks, [detection(105, 100)])
    assert updated["a"].visibility is Visibility.VISIBLE
    assert updated["b"].visibility is Visibility.HIDDEN


def test_motion_adds_up_until_the_pose_is_settled():
    tracks = {"a": begin_track("a", detection(100, 100))}
    step = 0.6 * MOTION_PX
    tracks = update_tracks(tracks, [detection(100 + step, 100)])
    assert not tracks["a"].moved
    tracks = update_tracks(tracks, [detection(100 + 2 * step, 100)])
    assert tracks["a"].moved
    assert not settle(tracks["a"]).moved
    tracks = update_tracks({"a": settle(tracks["a"])}, [detection(100 + 2.5 * step, 100)])
    assert not tracks["a"].moved


def test_a_hidden_object_is_found_again_where_it_was():
    tracks = update_tracks({"a": begin_track("a", detection(100, 100))}, [])
    assert tracks["a"].visibility is Visibility.HIDDEN
    tracks = update_tracks(tracks, [detection(110, 100)])
    assert tracks["a"].visibility is Visibility.VISIBLE


BOX = (0.4, 0.6, 1.0)


def hit(origin, direction, pose=None):
    way = np.asarray(direction, dtype=np.float64)
    return ray_hits_box(
        np.asarray(origin, dtype=np.float64),
        way / np.linalg.norm(way),
        world_from_object=pose or Pose.identity(),
        box_m=BOX,
    )


def test_a_ray_hits_the_box_that_stands_on_the_origin():
    assert hit((2.0, 0.0, 0.5), (-1, 0, 0)) == pytest.approx(1.8)
    assert hit((0.0, 0.0, 3.0), (0, 0, -1)) == pytest.approx(2.0)


def test_a_ray_misses_above_beside_and_behind():
    assert hit((2.0, 0.0, 1.1), (-1, 0, 0)) is None
    assert hit((2.0, 0.31, 0.5), (-1, 0, 0)) is None
    assert hit((2.0, 0.0, 0.5), (1, 0, 0)) is None


def test_the_box_turns_with_the_object():
    turned = Pose.from_yaw(np.pi / 2, (1.0, 0.0, 0.0))
    assert hit((3.0, 0.0, 0.5), (-1, 0, 0), turned) == pytest.approx(1.7)


def test_from_inside_the_distance_is_zero():
    assert hit((0.0, 0.0, 0.5), (0.3, 0.2, 0.9)) == 0.0
