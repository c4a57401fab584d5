"""Sight of one view: crops, and the share of a splat's light that gets through."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.cutout.coverage.visibility import (
    crop_around,
    grey_scene,
    in_view,
    shown_splats,
    zoom_of,
)
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel

EYE = look_at(np.array([2.0, 0.0, 0.5]), np.array([0.0, 0.0, 0.5]))
LENSES = (Pinhole(1200, 900, 900.0, 900.0, 600.0, 450.0), Fisheye.from_fov(1200, 3.2))


def single(opacity, scale, x=0.0):
    turns = np.array([[1.0, 0, 0, 0]])
    means, scales = np.array([[x, 0.02, 0.5]]), np.full((1, 3), scale)
    return SplatCloud(means, scales, turns, np.array([opacity]), np.zeros((1, 1, 3)))


def item_of(splats):
    return ObjectModel("a", "A", "", splats, (0.2, 0.2, 1.0), 0.0, Pose.identity())


def shown(item, others, camera):
    return shown_splats(
        item, others, camera=camera, world_from_camera=EYE, renderer=NativeRenderer()
    )


@pytest.mark.parametrize("camera", LENSES)
@pytest.mark.parametrize(("opacity", "scale"), [(0.9, 0.02), (0.3, 0.05), (0.05, 0.03)])
def test_a_splat_alone_lets_all_its_light_through(camera, opacity, scale):
    item = item_of(single(opacity, scale))
    light = shown(item, [], camera)
    assert light.transmittance[0] == pytest.approx(1.0, abs=0.04)


@pytest.mark.parametrize("camera", LENSES)
def test_what_is_before_it_takes_its_light(camera):
    item = item_of(single(0.9, 0.02))
    veil = grey_scene(single(0.5, 0.3, x=0.5), ())
    light = shown(item, veil, camera)
    assert light.transmittance[0] == pytest.approx(0.5, abs=0.03)
    behind = grey_scene(single(0.9, 0.3, x=-0.5), ())
    light = shown(item, behind, camera)
    assert light.transmittance[0] == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("camera", LENSES)
def test_a_crop_shows_the_same_at_fewer_pixels(camera):
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.4, 0.4) for z in (0.1, 0.9)])
    crop = crop_around(corners, camera, world_from_camera=EYE)
    assert crop is not None
    assert 200 < max(crop.width_px, crop.height_px) <= 260
    whole, _ = camera.project(EYE.inverse() @ corners)
    small, valid = crop.project(EYE.inverse() @ corners)
    assert valid.all()
    apart = (small[1:] - small[0]) / (whole[1:] - whole[0] + 1e-9)
    np.testing.assert_allclose(
        apart[np.abs(whole[1:] - whole[0]) > 1], zoom_of(crop, camera), rtol=0.02
    )


def test_nothing_is_cropped_beside_the_picture_or_behind_the_camera():
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.1, 0.9)])
    for shift in ((0.0, 5.0, 0.0), (4.0, 0.0, 0.0), (1.95, 0.0, 0.0)):
        assert crop_around(corners + shift, LENSES[0], world_from_camera=EYE) is None


def test_splats_beside_the_picture_are_left_out():
    posed = grey_scene(single(0.9, 0.02), (item_of(single(0.9, 0.02, x=50.0)),))
    assert [len(part.cloud) for part in in_view(posed, LENSES[0], world_from_camera=EYE)] == [1, 0]
    assert [len(part.cloud) for part in in_view(posed, LENSES[1], world_from_camera=EYE)] == [1, 1]
