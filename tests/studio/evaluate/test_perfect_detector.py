"""The detector that makes no mistakes shows what the masks show, where the view shows it."""

import math

import numpy as np
import pytest

from devices.messages import Frame
from devices.recording_codec import RecordedTruth
from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from sim.truth import GroundTruth
from studio.evaluate.perfect_detector import PerfectDetector
from tracking.baseline.detect import Expected
from tracking.baseline.rectify import front, rectify

LENS = Fisheye.from_fov(400, math.radians(200))
RIG = Rig((LENS,), (Pose.identity(),))
CENTRE_PX, RADIUS_PX = np.array([230.0, 190.0]), 7.0


def frame():
    image = np.zeros((400, 400, 3), np.uint8)
    return Frame("camera", 0, 0, 0, (image,), RIG, Pose.identity())


def view():
    return rectify(frame(), front(RIG, Pose.identity(), fov_deg=120))


def disc():
    y, x = np.mgrid[0:400, 0:400] + 0.5
    return np.hypot(x - CENTRE_PX[0], y - CENTRE_PX[1]) < RADIUS_PX


def truth(masks):
    recorded = RecordedTruth(0, 0, {}, {}, frozenset(), Pose.identity())
    return GroundTruth(recorded, masks)


def expected(object_id):
    return Expected(object_id, "chair", np.zeros(4), None)


def test_a_disc_in_the_lens_is_where_the_cameras_say_it_is_in_the_view():
    detector, seen_through = PerfectDetector(), view()
    detector.see(frame(), truth({"chair-1": (disc(),)}))

    (found,) = detector.detect(seen_through, [expected("chair-1"), expected("absent")])

    ray = LENS.unproject(CENTRE_PX[None])
    pixel, _ = seen_through.camera.project(ray)
    rows, columns = np.nonzero(found.mask)
    centroid = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
    np.testing.assert_allclose(centroid, pixel[0], atol=0.6)
    assert found.label == "chair-1"
    left, top, right, bottom = found.box_px
    assert (left, right) == (columns.min(), columns.max() + 1)
    assert (top, bottom) == (rows.min(), rows.max() + 1)


def test_what_the_view_does_not_show_is_not_found():
    detector = PerfectDetector()
    behind = np.zeros((400, 400), np.bool_)
    behind[195:205, 2:10] = True
    detector.see(frame(), truth({"chair-1": (behind,)}))
    assert detector.detect(view(), [expected("chair-1")]) == ()


def test_a_truth_without_masks_is_refused():
    detector = PerfectDetector()
    detector.see(frame(), truth(None))
    with pytest.raises(ValueError, match="no masks"):
        detector.detect(view(), [expected("chair-1")])


def test_it_has_to_be_shown_a_frame_first():
    with pytest.raises(ValueError, match="call see"):
        PerfectDetector().detect(view(), [expected("chair-1")])
