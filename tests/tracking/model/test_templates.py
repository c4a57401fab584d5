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
from tracking.model.object_model import make_model
from tracking.model.templates import ELEVATIONS_RAD, YAWS, Cuts, Templates, compare, cut_out

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


def test_overlap_and_correlation_are_those_of_the_weighted_pixels():
    rng = np.random.default_rng(3)
    count, pixels = 5, 32 * 32
    colours = rng.uniform(size=(count, pixels, 3)).astype(np.float32)
    own, free = rng.uniform(size=(2, count, pixels)).astype(np.float32)
    alpha = (rng.uniform(size=(1, YAWS, pixels)) > 0.3).astype(np.float32)
    drawn = rng.uniform(size=(1, YAWS, pixels, 3)).astype(np.float32)
    cuts = Cuts(colours, own, free, np.zeros(count), np.full(count, ELEVATIONS_RAD[0]))
    overlap, correlation = compare(cuts, Templates(alpha, drawn))
    for place in range(count):
        for turn in range(0, YAWS, 7):
            shown = own[place] * free[place]
            shared = (shown * alpha[0, turn]).sum()
            either = (free[place] * alpha[0, turn]).sum() + shown.sum() - shared
            assert overlap[place, turn] == pytest.approx(shared / either, abs=1e-4)
            weight = shown * alpha[0, turn] / shared
            deviations = [
                values - (weight[:, None] * values).sum(axis=0)
                for values in (colours[place], drawn[0, turn])
            ]
            live, known = deviations
            power = [(weight[:, None] * product).sum() for product in (live**2, known**2)]
            wanted = (weight[:, None] * live * known).sum() / np.sqrt(power[0] * power[1])
            assert correlation[place, turn] == pytest.approx(wanted, abs=1e-3)
