"""Places in the whole picture that are proposed for a thing that was put elsewhere."""

import math

import numpy as np
import pytest

from scenes.pose import wrap_angle
from tracking.hypotheses.positions import (
    LEAST_STEP_M,
    PLACES,
    overview,
    pixel_evidence,
    proposed,
    scored,
    spread_out,
)


@pytest.fixture(scope="module")
def seen(table, mug_elsewhere):
    """The overview, and the mug's pictures with its neighbours pixel_evidence."""
    scene, now = mug_elsewhere
    look, mug = overview(scene), table.models["mug-1"]
    pictures = [pixel_evidence(scene, look, 0, mug, table.neighbours("mug-1"))]
    return scene, look, mug, pictures, now


def at(look, world_from_rig, place):
    """Row and column of a place in the shrunk picture."""
    pixel, valid = look.cameras[0].project((world_from_rig.inverse() @ place)[None])
    assert valid[0]
    return int(pixel[0, 1]), int(pixel[0, 0])


def test_the_overview_differs_from_the_empty_room_where_things_are(table, seen):
    scene, look, mug, _pictures, now = seen
    (foreground,), (image,) = look.foreground, look.images
    assert foreground.shape == image.shape[:2]
    assert foreground[at(look, scene.world_from_rig, mug.centre_at(now))] > 0.7
    left = mug.centre_at(table.poses["mug-1"])
    assert foreground[at(look, scene.world_from_rig, left)] < 0.2
    assert 0.001 < foreground.mean() < 0.1


def test_a_neighbour_s_pixels_are_nobody_s(table, seen):
    scene, look, mug, pictures, now = seen
    own = pictures[0][..., 3]
    book = table.models["book-1"]
    there = at(look, scene.world_from_rig, book.centre_at(table.poses["book-1"]))
    assert own[there] == 0.0
    assert pictures[0][..., 4][there] == 1.0
    alone = pixel_evidence(scene, look, 0, table.models["book-1"], ())
    assert alone[..., 3][there] > 0.5
    assert own[at(look, scene.world_from_rig, mug.centre_at(now))] > 0.5


def test_the_true_place_is_among_those_proposed(seen):
    scene, look, mug, pictures, now = seen
    places = proposed(
        scene, look, mug, pictures, support_heights_m=scene.support_planes.heights_m, reach_m=4.5
    )
    assert 0 < len(places) <= PLACES
    apart = np.linalg.norm(places - now.translation, axis=1)
    assert apart.min() < 1.5 * LEAST_STEP_M
    assert scene.support_planes.can_hold(places).all()


def test_the_templates_tell_the_place_and_about_the_yaw(seen):
    scene, look, mug, pictures, now = seen
    beside = now.translation + np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [-0.3, 0.1, 0.0]])
    yaws, scores = scored(scene, look, mug, pictures, beside)
    assert scores.max(axis=1).argmax() == 0
    told = yaws[0, scores[0].argmax()]
    assert abs(wrap_angle(float(told - now.yaw()))) < math.radians(45)


def test_an_empty_room_proposes_nothing(table, no_mug):
    look, mug = overview(no_mug), table.models["mug-1"]
    pictures = [pixel_evidence(no_mug, look, 0, mug, table.neighbours("mug-1"))]
    heights = no_mug.support_planes.heights_m
    places = proposed(no_mug, look, mug, pictures, support_heights_m=heights, reach_m=4.5)
    _, scores = scored(no_mug, look, mug, pictures, places)
    assert len(places) == 0 or scores.max() < 0.6


def test_the_best_of_each_neighbourhood_is_kept():
    places = np.array([[x, 0.0, 0.0] for x in (0.0, 0.05, 0.2, 0.22, 1.0)])
    scores = np.array([0.5, 0.9, 0.4, 0.6, -np.inf])
    kept = spread_out(places, scores, apart=0.1, limit=10)
    np.testing.assert_array_equal(kept[:, 0], [0.05, 0.22])
    assert len(spread_out(places, scores, apart=0.1, limit=1)) == 1
    assert spread_out(places, np.zeros(5), apart=0.1, limit=3).shape == (0, 3)
