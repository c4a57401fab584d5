"""Small pictures of an object, compared with places of a lens picture."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.opening import open_scene
from scenes.pose import Pose, wrap_angle
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from tracking.kernels import native
from tracking.model.object_model import make_model
from tracking.model.templates import ELEVATIONS_RAD, YAWS, Cuts, compare, compared, cut_out

LENS = Fisheye.from_fov(720, math.radians(200))
EYE = np.array([0.0, 0.0, 1.3])


@pytest.fixture(scope="module")
def chair():
    source = next(m for m in open_scene("lab").objects if m.object_id == "chair-1")
    return make_model(source, NativeRenderer())


@pytest.fixture(scope="module")
def picture_of(raycast):
    """Pictures of the physical chair before grey: colours, own and foreground."""
    physical = sample_room("lab").object_by_id("chair-1")

    def take(world_from_object, world_from_lens):
        meshes = [(mesh, world_from_object) for mesh in physical.meshes]
        rgb, _, index = raycast(meshes, LENS, world_from_lens, shade=True)
        alpha = (index >= 0)[..., None].astype(np.float32)
        colours = alpha * rgb / 255 + 0.5 * (1 - alpha)
        return np.concatenate([colours, alpha, alpha], axis=2).astype(np.float32)

    return take


@pytest.mark.parametrize(("x", "y", "yaw_deg"), [(1.5, 2.0, 20), (-2.0, 1.2, 140), (0.2, 1.4, -75)])
def test_the_best_tembackground_image_at_a_place_has_the_yaw_of_what_stands_there(
    chair, picture_of, x, y, yaw_deg
):
    world_from_lens = look_at(EYE, np.array([0.0, 1.5, 0.8]))
    true = Pose.from_yaw(math.radians(yaw_deg), (x, y, 0.0))
    model = chair
    centres = model.centre_at(true) + np.array([[0.0, 0.0, 0.0], [0.7, 0.0, 0.0]])
    picture = picture_of(true, world_from_lens)
    cuts = cut_out(picture, LENS, world_from_lens, centres, model.radius_m)
    overlap, _ = compare(cuts, model.templates)
    best = int(overlap[0].argmax())
    found = best * 2 * math.pi / YAWS + float(cuts.azimuth_rad[0])
    assert abs(math.degrees(wrap_angle(found - true.yaw()))) < 12
    assert overlap[0, best] > 0.45
    assert overlap[1].max() < 0.5 * overlap[0, best]


def test_what_is_covered_does_not_count_against_a_tembackground_image(chair, picture_of):
    world_from_lens = look_at(EYE, np.array([0.0, 1.5, 0.8]))
    true = Pose.from_yaw(0.4, (0.5, 1.8, 0.0))
    model = chair
    centre = model.centre_at(true)[None]
    picture = picture_of(true, world_from_lens)
    pixel = LENS.project(world_from_lens.inverse() @ centre)[0][0]
    covered = picture.copy()
    covered[:, int(pixel[0]) :, 3], covered[:, int(pixel[0]) :, 4] = 0.0, 1.0
    empty = picture.copy()
    empty[:, int(pixel[0]) :, 3:] = 0.0
    scores = [
        compare(cut_out(p, LENS, world_from_lens, centre, model.radius_m), model.templates)[0].max()
        for p in (picture, covered, empty)
    ]
    assert scores[1] > 0.7 * scores[0]
    assert scores[2] < 0.9 * scores[1]


def test_a_chair_is_not_alike_when_turned(chair):
    assert chair.are_same(np.zeros(1)).all()
    assert not chair.are_same(np.radians([45.0, 90.0, 180.0, -120.0])).any()


def test_a_place_that_shows_a_tembackground_image_is_wholly_like_it(chair):
    alpha, colours = chair.templates.alpha[1, 5], chair.templates.colours[1, 5]
    free, level = np.ones((1, len(alpha)), np.float32), np.array([ELEVATIONS_RAD[1]])
    cuts = Cuts(colours[None], alpha[None], free, np.zeros(1), level)
    overlap, correlation = compare(cuts, chair.templates)
    assert overlap[0].argmax() == 5
    assert correlation[0, 5] > 0.99


@pytest.mark.parametrize("pixels", [64, 61, 5])
def test_the_native_kernel_says_what_its_twin_says(pixels):
    rng = np.random.default_rng(pixels)
    places, turns = 7, 4
    colours = rng.uniform(size=(places, pixels, 3)).astype(np.float32)
    own, free = rng.uniform(size=(2, places, pixels)).astype(np.float32)
    own[0] = 0.0
    alpha = (rng.uniform(size=(turns, pixels)) > 0.3).astype(np.float32)
    drawn = rng.uniform(size=(turns, pixels, 3)).astype(np.float32)
    drawn[1] = colours[1]
    cuts = Cuts(colours, own, free, np.zeros(places), np.zeros(places))
    found = native.compare_templates(colours, own, free, alpha=alpha, drawn=drawn, pixels=pixels)
    for wanted, told in zip(compared(cuts, alpha, drawn), found, strict=True):
        np.testing.assert_allclose(told.reshape(places, turns), wanted, atol=1e-4, rtol=0.0)


def test_pictures_of_another_size_are_refused():
    pixels = np.zeros((2, 16), np.float32)
    colours = np.zeros((2, 16, 3), np.float32)
    with pytest.raises(ValueError, match=r"free: .* values, wanted"):
        native.compare_templates(
            colours, pixels, pixels[:1], alpha=pixels, drawn=colours, pixels=16
        )
