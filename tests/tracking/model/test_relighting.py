"""Objects in another room's light: what of it a picture tells, and what it does not forgive."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from scenes.splats import SH_C0, SplatCloud
from tracking.evidence.surroundings import upright_of
from tracking.kernels.native import Setting
from tracking.kernels.native import Shell as DrawnRelightable
from tracking.kernels.photometry import RELIGHTING, ROUGHLY
from tracking.model.object_model import RENDER_OPTIONS
from tracking.model.relighting import FOOT, RELIGHTER, Light, LitView, relightable_of
from tracking.window.filters import resized

SIDE_M, STEP_M = 0.2, 0.01
SIDE_PX, WALL = 56, 0.5
CAMERA = Fisheye(SIDE_PX, SIDE_PX, 200.0, 28.0, 28.0, max_angle=0.5)
TRUE = Pose.from_yaw(0.6, (0.1, 0.2, 0.0))
WORLD_FROM_CAMERA = look_at(np.array([0.7, -0.7, 0.8]), np.array([0.1, 0.2, 0.1]))


def a_box():
    """A cube of flat splats, speckled, on the floor."""
    rng = np.random.default_rng(4)
    steps = np.arange(STEP_M / 2, SIDE_M, STEP_M) - SIDE_M / 2
    across, along = (axis.ravel() for axis in np.meshgrid(steps, steps))
    count, half = len(across), np.full(len(across), SIDE_M / 2)
    means, scales = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            points = np.insert(np.stack([across, along], axis=1), axis, side * half, axis=1)
            means.append(points + np.array([0.0, 0.0, SIDE_M / 2]))
            scales.append(np.insert(np.full((count, 2), 0.7 * STEP_M), axis, 0.001, axis=1))
    total = 6 * count
    colours = rng.uniform(0.2, 0.5, (total, 1, 3))
    cloud = SplatCloud(
        np.concatenate(means).astype(np.float32),
        np.concatenate(scales).astype(np.float32),
        np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (total, 1)),
        np.full(total, 0.95, np.float32),
        ((colours - 0.5) / SH_C0).astype(np.float32),
    )
    return SimpleNamespace(splats=cloud, box_m=(SIDE_M, SIDE_M, SIDE_M))


@pytest.fixture(scope="module")
def seen():
    """A box, its shell, and a renderer."""
    source = a_box()
    return source, relightable_of(source), NativeRenderer()


def test_sides_face_outwards_and_the_foot_is_left_out(seen):
    source, relightable, _ = seen
    assert relightable.splats.means[:, 2].min() > FOOT * SIDE_M
    # Its underside is a sixth of a cube.
    assert len(relightable.splats) > 0.75 * len(source.splats)
    from_centre = relightable.splats.means - np.array([0.0, 0.0, SIDE_M / 2])
    axis = np.abs(from_centre).argmax(axis=1)
    rows = np.arange(len(axis))
    is_inner = np.sort(np.abs(from_centre), axis=1)[:, 1] < SIDE_M / 2 - 2 * STEP_M
    outwards = relightable.facing[rows, axis] * np.sign(from_centre[rows, axis])
    assert outwards[is_inner].min() > 0.99
    np.testing.assert_allclose(
        relightable.compass.colours(), 0.5 + 0.5 * relightable.facing, atol=1e-5, rtol=0.0
    )


@pytest.fixture(scope="module")
def lit_from(raycast):
    """How the physical box looks lit from a direction, and what of the picture shows it."""
    physical = sample_room("desk").object_by_id("box-1")
    meshes = [(mesh, TRUE) for mesh in physical.meshes]
    fine = CAMERA.resized(4 * SIDE_PX, 4 * SIDE_PX)

    def picture(direction):
        rgb, _, index = raycast(
            meshes, fine, WORLD_FROM_CAMERA, shade=True, light_direction=direction
        )
        full = np.where((index >= 0)[..., None], rgb / 255, WALL).astype(np.float32)
        shown = (index >= 0).astype(np.float32)
        size = (SIDE_PX, SIDE_PX)
        return resized(full, size), resized(shown, size) > 0.99

    return picture


def left_over(live, inside):
    """Mean difference of the scanned box, in the light told, from a picture of it."""
    source = next(m for m in open_scene("desk").objects if m.object_id == "box-1")
    empty = np.full((SIDE_PX, SIDE_PX, 3), WALL, np.float32)
    free = np.ones((SIDE_PX, SIDE_PX), np.float32)
    view = LitView(live, empty, free, CAMERA, WORLD_FROM_CAMERA, NativeRenderer())
    lit, _ = view.lit(relightable_of(source), TRUE)
    return float(np.abs(lit - live)[inside].mean())


def test_light_from_any_side_is_told_and_prints_nothing(lit_from):
    left = []
    for direction in ((1.0, 0.2, 0.5), (-0.3, -1.0, 0.6), (0.0, 0.0, 1.0)):
        live, inside = lit_from(direction)
        assert inside.sum() > 300
        left.append(left_over(live, inside))
        stripes = np.where(np.arange(SIDE_PX) // 4 % 2, 1.5, 0.6).astype(np.float32)[:, None]
        assert left_over(stripes * live, inside) > 2.0 * left[-1]
    assert max(left) < 0.08


def test_what_is_not_in_the_picture_keeps_a_light_that_can_be(seen):
    _, relightable, renderer = seen
    black = np.zeros((SIDE_PX, SIDE_PX, 3), np.float32)
    view = LitView(black, black, black[..., 0], CAMERA, TRUE, renderer)
    assert np.isfinite(view.relit(relightable, TRUE).sh).all()


@pytest.mark.parametrize("turn_rad", [0.0, 0.9, 2.5])
@pytest.mark.parametrize("name", ["book-1", "mug-1"])
def test_the_native_relighter_says_what_its_twin_says(name, turn_rad):
    source = next(m for m in open_scene("desk").objects if m.object_id == name)
    relightable, renderer = relightable_of(source), NativeRenderer()
    rng = np.random.default_rng(7)
    empty = rng.uniform(0.2, 0.8, (SIDE_PX, SIDE_PX, 3)).astype(np.float32)
    free = np.ones((SIDE_PX, SIDE_PX), np.float32)
    free[:, : SIDE_PX // 2] = 0.4
    live = np.clip(empty + rng.normal(0.0, 0.2, empty.shape), 0.0, 1.0).astype(np.float32)
    view = LitView(live, empty, free, CAMERA, WORLD_FROM_CAMERA, renderer)
    setting = Setting(live, empty, free, size=(SIDE_PX, SIDE_PX), constants=ROUGHLY.for_native())
    scanned, compass = (
        renderer.alone(splats, CAMERA, WORLD_FROM_CAMERA, RENDER_OPTIONS)
        for splats in (relightable.splats, relightable.compass)
    )
    drawn = DrawnRelightable(scanned, compass, relightable.facing)
    pose = Pose.from_yaw(turn_rad, TRUE.translation)
    upright = upright_of(pose)
    wanted, found_light = view.light(relightable, pose), RELIGHTER.light(setting, drawn, upright)
    np.testing.assert_allclose(found_light[0], wanted.by_side, rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(found_light[1], wanted.tint, rtol=0.0, atol=1e-4)
    similarity = setting.resemblance(*view.lit(relightable, pose))
    assert RELIGHTER.resemblance(setting, drawn, upright) == pytest.approx(similarity, abs=1e-4)
    relit = renderer.alone(view.relit(relightable, pose), CAMERA, WORLD_FROM_CAMERA, RENDER_OPTIONS)
    found = RELIGHTER.relit(setting, drawn, scanned, upright)
    beside = (upright[0] + 0.01, *upright[1:])
    assert setting.resemblance_at(found, [beside]) == pytest.approx(
        setting.resemblance_at(relit, [beside]), abs=1e-4
    )


def test_a_relightable_model_drawn_at_another_size_is_refused(seen):
    _, relightable, renderer = seen
    grey = np.full((SIDE_PX, SIDE_PX, 3), 0.5, np.float32)
    free = np.ones((SIDE_PX, SIDE_PX), np.float32)
    setting = Setting(grey, grey, free, size=(SIDE_PX, SIDE_PX), constants=ROUGHLY.for_native())
    fine = renderer.alone(
        relightable.splats, CAMERA.resized(2 * SIDE_PX, 2 * SIDE_PX), TRUE, RENDER_OPTIONS
    )
    with pytest.raises(ValueError, match=r"alone: drawn with .* px, wanted"):
        RELIGHTER.light(
            setting, DrawnRelightable(fine, fine, relightable.facing), (0.0, 0.0, 0.0, 0.0)
        )


@given(st.lists(st.floats(-9, 9), min_size=7, max_size=7), st.floats(0, 6.28))
def test_gains_are_within_what_light_can_do(light, turn):
    facing = np.array([[np.cos(turn), np.sin(turn), 0.0]])
    gains = Light(np.array(light[:4]), np.array(light[4:])).gains(facing)
    assert gains.shape == (1, 3)
    low, high = RELIGHTING.light_range
    assert (gains >= np.float32(low)).all()
    assert (gains <= np.float32(high)).all()
