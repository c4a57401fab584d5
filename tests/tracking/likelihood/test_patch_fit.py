"""Small objects placed by their colours, in pictures of the physical object in other light."""

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig
from scenes.frames import look_at
from scenes.opening import open_scene
from scenes.pose import Pose, wrap_angle
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from tracking.background.images import Exposure
from tracking.evidence.observation import observe
from tracking.evidence.surroundings import Place, surroundings_in
from tracking.likelihood.patch_fit import fit_patch_closely, fit_patch_roughly
from tracking.model.object_model import make_model
from tracking.window.window import window_around

LENS = Fisheye.from_fov(1440, math.radians(200))
WORLD_FROM_RIG = look_at(np.array([0.0, 0.0, 1.3]), np.array([0.0, 1.5, 0.7]))
TRUE = Pose.from_yaw(0.7, (0.3, 1.9, 0.7))
WALL = 0.6


@pytest.fixture(scope="module")
def seen(raycast):
    """A darker book before a grey wall: scene, model and evidence."""
    source = next(m for m in open_scene("desk").objects if m.object_id == "book-1")
    renderer = NativeRenderer()
    model = make_model(source, renderer)
    rig = Rig((LENS,), (Pose.identity(),))
    view = window_around(rig, WORLD_FROM_RIG, model.centre_at(TRUE), radius_m=model.radius_m)
    fine = view.camera.resized(4 * view.camera.width_px, 4 * view.camera.height_px)
    physical = sample_room("desk").object_by_id("book-1")
    meshes = [(mesh, TRUE) for mesh in physical.meshes]
    rgb, _, index = raycast(meshes, fine, view.world_from_camera, shade=True)
    full = np.where((index >= 0)[..., None], 0.8 * rgb / 255 + 0.05, WALL).astype(np.float32)
    size = (view.camera.width_px, view.camera.height_px)
    live = cv2.GaussianBlur(cv2.resize(full, size, interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    live = live + np.random.default_rng(3).normal(0.0, 0.02, live.shape)
    shape = (LENS.height_px, LENS.width_px, 3)
    scene = SimpleNamespace(
        frame=SimpleNamespace(rig=rig),
        background=SimpleNamespace(
            images=(np.full(shape, WALL, np.float32),),
            ranges_m=(np.zeros(shape[:2], np.float32),),
        ),
        exposures=(Exposure(np.ones(3), np.zeros(3), np.zeros(3)),),
        renderer=renderer,
        is_first=False,
    )
    evidence = SimpleNamespace(
        view=view,
        camera=view.camera,
        world_from_camera=view.world_from_camera,
        live=live.astype(np.float32),
        hidden=np.zeros(live.shape[:2], np.float32),
        foreground=np.zeros(live.shape[:2], np.float32),
        layers=(),
    )
    return scene, model, evidence


def around_of(scene, model, evidence):
    """The evidence with and without the object."""
    return surroundings_in(observe(scene, evidence), model, scene.renderer)


@pytest.mark.parametrize(("x_m", "y_m", "turn_deg"), [(0.02, -0.02, 8), (-0.03, 0.01, -10)])
def test_a_book_two_metres_away_is_put_right_by_its_colours(seen, x_m, y_m, turn_deg):
    scene, model, evidence = seen
    shift = np.array([x_m, y_m, 0.0])
    start = Pose.from_yaw(TRUE.yaw() + math.radians(turn_deg), TRUE.translation + shift)
    around = around_of(scene, model, evidence)
    rough = fit_patch_roughly(around, start)
    found, share = fit_patch_closely(around, rough)
    assert np.linalg.norm(found.translation - TRUE.translation) < 0.015
    assert abs(math.degrees(wrap_angle(found.yaw() - TRUE.yaw()))) < 3.0
    assert share > 0.4


def test_what_falls_far_behind_a_rival_is_given_up(seen, monkeypatch):
    scene, model, evidence = seen
    around = around_of(scene, model, evidence)
    compared = []
    compare = Place.close_similarity

    def counted(place, lit, upright):
        compared.append(upright)
        return compare(place, lit, upright)

    monkeypatch.setattr(Place, "close_similarity", counted)

    def refined_from(turn_rad, rival):
        compared.clear()
        rough = Pose.from_yaw(TRUE.yaw() + turn_rad, TRUE.translation + np.array([0.01, 0.0, 0.0]))
        pose, similarity = fit_patch_closely(around, rough, rival=rival)
        return pose, similarity, len(compared)

    right, similarity, count = refined_from(0.0, 0.0)
    same, same_similarity, same_count = refined_from(0.0, similarity)
    assert (same.translation == right.translation).all()
    assert (same_similarity, same_count) == (similarity, count)
    _, wrong_similarity, few = refined_from(math.pi / 2, similarity)
    assert wrong_similarity < similarity - 0.2
    assert few < count / 2
