import numpy as np
import pytest

from benchmarks.evaluate.filmed.filming import standing
from benchmarks.evaluate.protocols.screen import SCREEN_ID, hiding, screen_body, surface_points
from scenes.samples import sample_room
from sim.bodies import body_of_object
from sim.camera.camera360 import Camera360, CameraOptions, default_rig


@pytest.fixture(scope="module")
def lab():
    return sample_room("lab")


def test_surface_points_lie_on_the_surface_and_leave_no_gap(lab):
    item = lab.object_by_id("stool-1")
    points = surface_points(item)
    half = np.array([0.5 * item.box_m[0], 0.5 * item.box_m[1]])
    assert (np.abs(points[:, :2]) <= half + 1e-6).all()
    assert points[:, 2].min() >= -1e-6
    assert points[:, 2].max() <= item.box_m[2] + 1e-6
    sides = np.unique((points // 0.02).astype(int), axis=0)
    assert len(sides) > 800


def test_nothing_to_hide_needs_no_board(lab):
    item = lab.object_by_id("chair-1")
    eye = lab.world_from_rig.translation
    assert hiding(eye, item, item.world_from_object, 0.0) is None


def test_the_board_hides_what_it_is_asked_to(lab):
    """Judged by the camera, which draws and counts pixels; the board is placed by points alone."""
    item = lab.object_by_id("chair-1")
    bodies = [body_of_object(item), screen_body()]
    camera = Camera360(
        lab,
        default_rig(320),
        lab.world_from_rig,
        bodies,
        options=CameraOptions(supersampling=1, stand=False),
    )
    try:
        for share in (0.2, 0.5, 0.8, 1.0):
            screen = hiding(lab.world_from_rig.translation, item, item.world_from_object, share)
            view = camera.view({**standing({"chair-1": item.world_from_object}), SCREEN_ID: screen})
            assert 1.0 - view.visible_fraction["chair-1"] == pytest.approx(share, abs=0.08)
    finally:
        camera.close()
