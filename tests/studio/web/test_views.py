import numpy as np

from studio.web.views import views_of


def test_the_corner_s_eye_is_inside_the_room_and_looks_at_what_moves(lab):
    moved = np.array([1.0, -0.5, 0.0])

    corner = views_of(lab, [moved])["corner"]

    low, high = lab.footprint_m
    eye, target = np.array(corner["eye"]), np.array(corner["target"])
    assert (low < eye[:2]).all()
    assert (eye[:2] < high).all()
    assert np.linalg.norm(eye[:2] - moved[:2]) > 1.5
    assert np.linalg.norm(target[:2] - moved[:2]) < 1.0


def test_the_view_from_above_sees_the_whole_floor_without_the_ceiling(lab):
    above = views_of(lab, [])["above"]

    height, near = above["eye"][2], above["near"]
    half = 0.5 * (lab.footprint_m[1] - lab.footprint_m[0]).max()
    assert height - near < 2.2
    assert np.arctan2(half, height) < np.radians(31)
