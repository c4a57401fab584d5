import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.state import LiveSurface
from studio.view.surface_drawing import LivePicture, draw_surface

BOARD = np.array([[-0.5, 2.0, 1.6], [0.5, 2.0, 1.6], [0.5, 2.0, 1.0], [-0.5, 2.0, 1.0]])
RED, GREEN, BLUE, WHITE = (200, 0, 0), (0, 200, 0), (0, 0, 200), (200, 200, 200)
QUARTERS = np.repeat(np.repeat(np.array([[RED, GREEN], [BLUE, WHITE]], np.uint8), 30, 0), 50, 1)
CAMERAS = [Pinhole.from_fov(160, 120, np.radians(80)), Fisheye.from_fov(160, np.radians(200))]
EYE = look_at(np.array([0.3, -0.5, 1.4]), np.array([0.0, 2.0, 1.3]))


def drawn(camera, world_from_camera, depth_m, picture=QUARTERS):
    canvas = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
    depth = np.full(canvas.shape[:2], depth_m, np.float32)
    live = LivePicture(LiveSurface("board", BOARD, (100, 60), "camera-360"), picture)
    draw_surface(canvas, depth, camera, world_from_camera, live)
    return canvas


def at(canvas, camera, world_from_camera, point):
    (x, y), seen = (v[0] for v in camera.project(world_from_camera.inverse() @ np.array([point])))
    assert seen
    return tuple(canvas[int(y), int(x)].tolist())


@pytest.mark.parametrize("camera", CAMERAS, ids=["pinhole", "fisheye"])
@pytest.mark.parametrize("times", [1, 8], ids=["native", "finer than the picture"])
def test_every_part_is_where_it_belongs(camera, times):
    picture = np.repeat(np.repeat(QUARTERS, times, 0), times, 1)
    canvas = drawn(camera, EYE, 0.0, picture)
    for x, z, colour in ((-0.25, 1.45, RED), (0.25, 1.45, GREEN), (-0.25, 1.15, BLUE)):
        assert at(canvas, camera, EYE, (x, 2.0, z)) == pytest.approx(colour, abs=3)
    assert at(canvas, camera, EYE, (0.25, 2.0, 1.15)) == pytest.approx(WHITE, abs=3)
    assert at(canvas, camera, EYE, (0.75, 2.0, 1.3)) == (0, 0, 0)


@pytest.mark.parametrize("camera", CAMERAS, ids=["pinhole", "fisheye"])
def test_what_stands_before_it_stays(camera):
    assert drawn(camera, EYE, 1.0).max() < 200
    assert drawn(camera, EYE, 4.0).max() == 200


def test_the_scan_of_the_surface_itself_does_not_hide_it():
    # The wall's splats lie 5 cm before the board here and there.
    camera = CAMERAS[0]
    straight = look_at(np.array([0.0, 0.0, 1.3]), np.array([0.0, 2.0, 1.3]))
    assert at(drawn(camera, straight, 1.95), camera, straight, (-0.25, 2.0, 1.45)) == RED


def test_from_behind_and_beside_nothing_is_drawn():
    camera = CAMERAS[0]
    behind = look_at(np.array([0.0, 4.0, 1.3]), np.array([0.0, 2.0, 1.3]))
    away = look_at(np.array([0.0, 0.0, 1.3]), np.array([0.0, -2.0, 1.3]))
    assert not drawn(camera, behind, 0.0).any()
    assert not drawn(camera, away, 0.0).any()


def test_a_surface_that_goes_on_behind_the_viewer_is_drawn_ahead():
    camera = CAMERAS[0]
    beside = look_at(np.array([0.3, 1.8, 1.3]), np.array([-0.5, 2.05, 1.3]))
    assert at(drawn(camera, beside, 0.0), camera, beside, (-0.3, 2.0, 1.45)) == RED
