"""A patterned thing that was swung away is found by its pattern, whatever way it went."""

from __future__ import annotations

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import tracking.follow.feature_relocalisation
from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from tracking.evidence.appearance_memory import AppearanceMemory
from tracking.follow.feature_relocalisation import relocalise

LENS = Fisheye(1400, 1400, 560.0, 700.0, 700.0, max_angle=math.radians(100))
SIDE_M, TEXELS = 0.26, 260
RADIUS_M = 0.19
BEFORE = Pose.from_yaw(0.2, (0.1, 1.0, 0.8))
WORLD_FROM_RIG = Pose(
    np.array([[1.0, 0.0, 0.0], [0.0, -0.6, 0.8], [0.0, -0.8, -0.6]]), np.array([0.1, 0.3, 1.6])
)


@pytest.fixture(scope="module")
def pattern():
    """(TEXELS, TEXELS) a cover with shapes of all sizes."""
    rng = np.random.default_rng(4)
    cover = np.full((TEXELS, TEXELS), 90, np.uint8)
    for _ in range(60):
        corner = rng.integers(0, TEXELS - 20, 2)
        end = corner + rng.integers(8, 60, 2)
        cv2.rectangle(cover, corner.tolist(), end.tolist(), int(rng.integers(20, 235)), -1)
    return cv2.GaussianBlur(cover.astype(np.float32), (0, 0), 1.5)


def filmed(pattern, world_from_object):
    """The level cover as the lens sees it: (H, W, 3) bytes, where it is, and how far away."""
    rows, columns = np.mgrid[0 : LENS.height_px, 0 : LENS.width_px]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5
    rays = LENS.unproject(pixels) @ WORLD_FROM_RIG.rotation.T
    eye = WORLD_FROM_RIG.translation
    with np.errstate(divide="ignore"):
        away = (world_from_object.translation[2] - eye[2]) / rays[:, 2]
    away = np.where((away > 0.0) & (away < 10.0), away, 0.0)
    places = world_from_object.inverse() @ (eye + rays * away[:, None])
    inside = (np.abs(places[:, :2]).max(axis=1) < SIDE_M / 2) & (away > 0.0)
    texels = np.where(inside[:, None], (places[:, :2] / SIDE_M + 0.5) * (TEXELS - 1), 0.0)
    texels = texels.astype(np.float32).reshape(LENS.height_px, LENS.width_px, 2)
    shape = LENS.height_px, LENS.width_px
    grey = cv2.remap(pattern, texels[..., 0], texels[..., 1], cv2.INTER_LINEAR)
    grey = np.where(inside.reshape(shape), grey, 120.0)
    picture = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return picture, inside.reshape(shape), away.reshape(shape)


@pytest.fixture(scope="module")
def appearance(pattern):
    picture, inside, away = filmed(pattern, BEFORE)
    shown = np.dstack([picture / 255.0, inside]).astype(np.float32)
    return AppearanceMemory(
        camera=LENS,
        camera_from_object=WORLD_FROM_RIG.inverse() @ BEFORE,
        world_from_object=BEFORE,
        shown=shown,
        depth=away.astype(np.float32),
        slack_m=0.04,
    )


@pytest.fixture
def found(monkeypatch, appearance):
    """Pose found in a picture that differs from the empty room all over."""

    def changed(_scene, _model, window, _neighbours):
        return SimpleNamespace(
            foreground=np.ones((window.camera.height_px, window.camera.width_px), np.float32)
        )

    monkeypatch.setattr(tracking.follow.feature_relocalisation, "gather", changed)

    def find(picture):
        frame = SimpleNamespace(images=(picture,), rig=Rig((LENS,), (Pose.identity(),)))
        scene = SimpleNamespace(frame=frame, world_from_rig=WORLD_FROM_RIG)
        model = SimpleNamespace(radius_m=RADIUS_M)
        task = SimpleNamespace(scene=scene, model=model, neighbours=())
        return relocalise(task, appearance, BEFORE.translation)

    return find


@pytest.mark.parametrize(
    ("moved_m", "turned_deg"),
    [
        ((0.0, 0.0, 0.0), 0),
        ((0.12, 0.0, 0.0), 30),
        ((-0.1, 0.12, 0.05), -45),
        ((0.05, -0.08, 0.1), 90),
    ],
)
def test_a_swung_object_is_found_by_its_pattern(found, pattern, moved_m, turned_deg):
    turned = BEFORE.yaw() + math.radians(turned_deg)
    now = Pose.from_yaw(turned, BEFORE.translation + np.array(moved_m))
    pose = found(filmed(pattern, now)[0])
    assert pose is not None
    assert np.linalg.norm(pose.translation - now.translation) < 0.01
    assert abs(math.remainder(pose.yaw() - now.yaw(), 2 * math.pi)) < math.radians(1.5)


def test_where_the_pattern_is_not_shown_nothing_is_found(found):
    plain = np.full((LENS.height_px, LENS.width_px, 3), 120, np.uint8)
    assert found(plain) is None
    noise = np.random.default_rng(7).integers(0, 255, plain.shape).astype(np.uint8)
    assert found(noise) is None


def test_what_leans_is_none_of_an_upright_object(found, pattern):
    picture, inside, _ = filmed(pattern, BEFORE)
    rows, columns = np.nonzero(inside)
    middle = columns.mean(), rows.mean()
    squeezed = np.float32([[1.0, 0.0, 0.0], [0.0, 0.35, 0.65 * middle[1]]])
    leaning = cv2.warpAffine(picture, squeezed, picture.shape[1::-1], borderValue=(120, 120, 120))
    assert found(leaning) is None
