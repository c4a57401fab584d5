"""The camera against geometry that is known without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from sim.bodies import Body, BodyPart, Placement, body_of_object
from sim.camera.camera360 import LENS_BASELINE_M, Camera360, CameraOptions, default_rig
from sim.camera.lens_picture import fine_lens

LENS_PX = 720
PLAIN = CameraOptions(blur_px=0.0, stand=False)
MARKER_HALF_M = 0.012
MARKERS = np.array(
    [
        [0.3, 1.4, 1.3], [-1.2, 1.0, 0.4], [1.5, -0.3, 2.0], [-1.7, -0.6, 1.1], [0.2, 0.6, 0.2],
        [0.4, -1.8, 1.3], [-1.0, -1.5, 0.3], [1.2, -1.6, 2.1], [0.1, -1.2, 0.5], [-1.6, -0.4, 0.9],
    ]
)  # fmt: skip


def _marker(point, eye):
    """A white square that faces the camera, centred on `point`."""
    ray = (point - eye) / np.linalg.norm(point - eye)
    side = np.cross(ray, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, ray)
    corners = [
        point + MARKER_HALF_M * (a * side + b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return TexturedMesh(
        np.array(corners),
        np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        np.full((4, 2), 0.5, np.float32),
        np.full((2, 2, 3), 255, np.uint8),
    )


@pytest.fixture(scope="module")
def dark_room(small_room, box_mesh):
    walls = box_mesh((-2, -2, 0), (2, 2, 2.5), (10, 10, 10), inward=True)
    return replace(small_room, static=(walls,))


def _placed(item, pose=None, support_z_m=0.0):
    return Placement((item.world_from_object if pose is None else pose,), support_z_m)


@pytest.fixture(scope="module")
def rig():
    return default_rig(LENS_PX)


@pytest.fixture(scope="module")
def plain_camera(small_room, rig):
    bodies = [body_of_object(small_room.objects[0])]
    return Camera360(small_room, rig, small_room.world_from_rig, bodies, options=PLAIN)


def test_rig_has_two_lenses_back_to_back(rig):
    front, back = rig.rig_from_lens
    assert np.allclose(front.matrix(), np.eye(4))
    assert np.allclose(back.rotation, FRONT_FROM_BACK_LENS.rotation)
    assert np.allclose(back.translation, [0, 0, -LENS_BASELINE_M])
    assert np.rad2deg(rig.lenses[0].max_angle) == pytest.approx(100.0)


def test_known_points_appear_where_the_lens_model_puts_them(dark_room, rig):
    eye = dark_room.world_from_rig.translation
    markers = [_marker(point, eye) for point in MARKERS]
    room = replace(dark_room, static=(*dark_room.static, *markers))
    camera = Camera360(room, rig, room.world_from_rig, [], options=PLAIN)
    found = 0
    for lens, rig_from_lens, view in zip(
        rig.lenses, rig.rig_from_lens, camera.view({}).lenses, strict=True
    ):
        lens_from_world = (room.world_from_rig @ rig_from_lens).inverse()
        pixels, valid = lens.project(lens_from_world @ MARKERS)
        for pixel, is_seen in zip(pixels, valid, strict=True):
            if not is_seen or np.linalg.norm(pixel - LENS_PX / 2) > 0.47 * LENS_PX:
                continue
            column, row = (pixel - 12).astype(int)
            patch = view.rgb[row : row + 24, column : column + 24, 0].astype(float) - 10.0
            y, x = np.mgrid[0 : patch.shape[0], 0 : patch.shape[1]] + 0.5
            centre = np.array([(patch * x).sum(), (patch * y).sum()]) / patch.sum()
            assert np.abs(centre + np.array([column, row]) - pixel).max() < 0.1
            found += 1
    assert found >= len(MARKERS)


def test_a_moving_body_is_drawn_where_its_pose_puts_it(dark_room, rig):
    eye = dark_room.world_from_rig.translation
    point = MARKERS[1]
    body = Body("marker", (BodyPart((_marker(point, eye),), (np.zeros((1, 3)),)),))
    camera = Camera360(dark_room, rig, dark_room.world_from_rig, [body], options=PLAIN)
    lens, lens_from_world = rig.lenses[0], dark_room.world_from_rig.inverse()
    for shift in ([0.0, 0.0, 0.0], [0.31, 0.12, 0.2], [0.62, 0.24, 0.4], [0.63, 0.241, 0.4]):
        pose = Pose(np.eye(3), np.array(shift))
        view = camera.view({"marker": Placement((pose,), 0.0)}).lenses[0]
        (pixel,), _ = lens.project(lens_from_world @ (pose @ point[None, :]))
        light = view.rgb[..., 0].astype(float)
        light[light <= 12.0] = 0.0
        rows, columns = np.nonzero(light)
        centre = np.array([columns, rows]) @ light[rows, columns] / light.sum() + 0.5
        assert np.abs(centre - pixel).max() < 0.15
        assert view.ids[int(pixel[1]), int(pixel[0])] == 1


def test_range_agrees_with_ray_casting(small_room, rig, plain_camera):
    o3d = pytest.importorskip("open3d")
    room = small_room
    scene = o3d.t.geometry.RaycastingScene()
    for mesh in room.static:
        scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    rng = np.random.default_rng(5)
    for index, (lens, rig_from_lens) in enumerate(zip(rig.lenses, rig.rig_from_lens, strict=True)):
        fine = fine_lens(lens, PLAIN.supersampling)
        rows, columns = rng.integers(0, fine.height_px, (2, 4000))
        centre = np.array([fine.cx, fine.cy])
        inside = np.hypot(columns + 0.5 - centre[0], rows + 0.5 - centre[1]) < 0.495 * fine.width_px
        rows, columns = rows[inside], columns[inside]
        world_from_lens = room.world_from_rig @ rig_from_lens
        rays = fine.unproject(np.stack([columns, rows], axis=1) + 0.5) @ world_from_lens.rotation.T
        origins = np.broadcast_to(world_from_lens.translation, rays.shape)
        cast = scene.cast_rays(np.hstack([origins, rays]).astype(np.float32))["t_hit"].numpy()
        drawn = plain_camera.room_range(index)[rows, columns]
        error = np.abs(drawn - cast)
        assert np.isfinite(drawn).all()
        # At the table's edges one of two surfaces may win; everywhere else they agree.
        assert np.percentile(error, 98) < 0.002
        assert np.median(error) < 3e-4


def test_picture_has_no_holes(rig, plain_camera):
    for index, lens in enumerate(rig.lenses):
        fine = fine_lens(lens, PLAIN.supersampling)
        y, x = np.mgrid[0 : fine.height_px, 0 : fine.width_px] + 0.5
        inside = np.hypot(x - fine.cx, y - fine.cy) < fine.f_px * fine.max_angle - 1.0
        assert np.isfinite(plain_camera.room_range(index)[inside]).all()


def test_visible_fraction_behind_a_known_screen(dark_room, rig, box_mesh):
    """A wide screen that reaches half way up a plate hides half of it."""
    eye = dark_room.world_from_rig.translation
    plate = BodyPart(
        (box_mesh((-0.2, 0.0, -0.2), (0.2, 0.001, 0.2), (200, 0, 0)),), (np.zeros((1, 3)),)
    )
    screen = BodyPart(
        (box_mesh((-0.5, 0.0, -0.5), (0.5, 0.001, 0.0), (0, 200, 0)),), (np.zeros((1, 3)),)
    )
    bodies = [Body("plate", (plate,)), Body("screen", (screen,))]
    camera = Camera360(dark_room, rig, dark_room.world_from_rig, bodies, options=PLAIN)
    at = {
        "plate": Placement((Pose(np.eye(3), eye + np.array([0.0, 1.6, 0.0])),), 0.0),
        "screen": Placement((Pose(np.eye(3), eye + np.array([0.0, 0.8, 0.0])),), 0.0),
    }
    alone = camera.view({"plate": at["plate"]})
    assert alone.visible_fraction["plate"] == 1.0
    assert alone.visible_fraction["screen"] == 0.0
    both = camera.view(at)
    assert both.visible_fraction["plate"] == pytest.approx(0.5, abs=0.02)
    assert both.visible_fraction["screen"] == 1.0
    swapped = camera.view({"plate": at["screen"], "screen": at["plate"]})
    assert swapped.visible_fraction["plate"] == 1.0
    red = np.count_nonzero(both.lenses[0].ids == 1)
    assert red == pytest.approx(0.5 * np.count_nonzero(alone.lenses[0].ids == 1), rel=0.05)


def test_a_moving_frame_equals_the_same_frame_at_rest(small_room, rig):
    """Cached and freshly drawn objects give the same picture, and nothing is left behind."""
    chair, book = small_room.objects
    bodies = [body_of_object(chair), body_of_object(book)]
    options = CameraOptions()
    moved_pose = Pose.from_yaw(1.0, (-0.2, 0.6, 0.0))
    moved = {"chair-1": _placed(chair, moved_pose), "book-1": _placed(book, None, 0.72)}
    camera = Camera360(small_room, rig, small_room.world_from_rig, bodies, options=options)
    camera.view({"chair-1": _placed(chair), "book-1": _placed(book, None, 0.72)})
    while_moving = camera.view(moved)
    at_rest = [camera.view(moved) for _ in range(5)][-1]
    fresh = Camera360(small_room, rig, small_room.world_from_rig, bodies, options=options).view(
        moved
    )
    for other in (at_rest, fresh):
        for a, b in zip(while_moving.lenses, other.lenses, strict=True):
            assert np.array_equal(a.ids, b.ids)
            assert np.abs(a.rgb.astype(int) - b.rgb).max() <= 1
        assert while_moving.visible_fraction == other.visible_fraction


def test_an_object_darkens_the_floor_it_stands_on(small_room, rig, plain_camera):
    chair = small_room.objects[0]
    empty = plain_camera.view({}).lenses[0]
    with_chair = plain_camera.view({"chair-1": _placed(chair)}).lenses[0]
    lens = rig.lenses[0]
    lens_from_world = small_room.world_from_rig.inverse()
    below = chair.world_from_object @ np.array([[0.0, 0.0, 0.0], [1.2, -1.2, 0.0]])
    (near, far), valid = lens.project(lens_from_world @ below)
    assert valid.all()
    near, far = near.astype(int), far.astype(int)
    assert with_chair.ids[near[1], near[0]] == 0
    assert with_chair.rgb[near[1], near[0], 0] < 0.75 * empty.rgb[near[1], near[0], 0]
    assert abs(int(with_chair.rgb[far[1], far[0], 0]) - int(empty.rgb[far[1], far[0], 0])) <= 2


def test_two_bodies_of_one_name_are_refused(small_room, rig):
    body = body_of_object(small_room.objects[0])
    with pytest.raises(ValueError, match="chair-1"):
        Camera360(small_room, rig, small_room.world_from_rig, [body, body])
