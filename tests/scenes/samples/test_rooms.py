from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.mesh import BoxPart, PhysicalRoom
from scenes.pose import Pose
from scenes.prepare.align.codes.anchors import find_anchors
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.samples import SAMPLE_NAMES, sample_room
from scenes.samples.cache import StaticPart, cached, load, save
from scenes.samples.pieces import DESIGNS

IDS = {
    "lab": {
        "chair-1": "chair",
        "chair-2": "chair",
        "stool-1": "stool",
        "stool-2": "stool",
        "book-1": "book",
    },
    "desk": {"book-1": "book", "mug-1": "mug", "box-1": "box"},
    "tangram": {name: name for name in DESIGNS},
}
RIG_ABOVE_TABLE_M = {"desk": 0.4, "tangram": 0.5}


@pytest.fixture(scope="module", params=SAMPLE_NAMES)
def room(request) -> PhysicalRoom:
    return sample_room(request.param)


@pytest.fixture(scope="module")
def lab() -> PhysicalRoom:
    return sample_room("lab")


def test_unknown_name_lists_the_rooms():
    with pytest.raises(ValueError, match=r"kitchen.*lab, desk"):
        sample_room("kitchen")


def test_objects_present(room):
    assert {o.object_id: o.kind for o in room.objects} == IDS[room.name]


def test_same_room_each_time(room):
    again = sample_room(room.name)
    for a, b in zip(room.static, again.static, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.texture, b.texture)
    for a, b in zip(room.objects, again.objects, strict=True):
        assert np.array_equal(a.meshes[0].texture, b.meshes[0].texture)
        assert np.array_equal(a.world_from_object.matrix(), b.world_from_object.matrix())


def test_twins_differ_only_in_place(lab):
    for kind in ("chair", "stool"):
        one, other = (o for o in lab.objects if o.kind == kind)
        for a, b in zip(one.meshes, other.meshes, strict=True):
            assert np.array_equal(a.vertices, b.vertices)
            assert np.array_equal(a.uv, b.uv)
            assert np.array_equal(a.texture, b.texture)
        assert one.mass_kg == other.mass_kg
        assert (
            np.linalg.norm(one.world_from_object.translation - other.world_from_object.translation)
            > 0.5
        )


def test_object_frame_is_under_the_centre_on_the_support(room):
    for thing in room.objects:
        low, high = thing.meshes[0].bounds()
        assert np.allclose((low + high)[:2], 0.0, atol=1e-6)
        assert low[2] == pytest.approx(0.0, abs=1e-9)
        assert np.allclose(high - low, thing.box_m, atol=1e-6)


def test_contact_boxes_fill_the_object_without_leaving_it(room):
    for thing in room.objects:
        low, high = thing.meshes[0].bounds()
        corners = np.concatenate([_corners(part) for part in thing.parts])
        assert (corners >= low - 0.012).all(), thing.object_id
        assert (corners <= high + 0.012).all(), thing.object_id
        assert corners[:, 2].min() == pytest.approx(0.0, abs=0.012), thing.object_id
        assert corners[:, 2].max() == pytest.approx(high[2], abs=0.02), thing.object_id


def test_chair_is_a_chair(lab):
    """Four legs, a seat, and a back on one side only: half a turn looks different."""
    chair = lab.object_by_id("chair-1")
    assert np.allclose(chair.box_m, (0.45, 0.45, 0.9), atol=0.02)
    points = chair.meshes[0].vertices
    feet = points[points[:, 2] < 0.05]
    assert {(x > 0, y > 0) for x, y in feet[:, :2]} == {
        (True, True), (True, False), (False, True), (False, False)
    }  # fmt: skip
    upper = points[points[:, 2] > 0.6]
    assert (upper[:, 1] < 0).all()
    texture = chair.meshes[0].texture.astype(int)
    assert np.ptp(texture, axis=2).max() <= 12, "grey: no colour to tell the sides apart by"


def test_stools_and_book_have_their_sizes(lab):
    assert lab.object_by_id("book-1").box_m == pytest.approx((0.18, 0.25, 0.03))
    assert lab.object_by_id("stool-1").box_m == pytest.approx((0.36, 0.36, 0.45), abs=0.01)


def test_nothing_stands_in_anything_at_start(room):
    for thing in room.objects:
        for part in thing.parts:
            own = _footprint(thing.world_from_object @ part.object_from_box, part.half_size_m)
            for solid in room.solids:
                other = _footprint(solid.object_from_box, solid.half_size_m)
                assert not _overlap(own, other), f"{thing.object_id} stands in a solid"
            for neighbour in room.objects:
                if neighbour is thing:
                    continue
                for piece in neighbour.parts:
                    pose = neighbour.world_from_object @ piece.object_from_box
                    assert not _overlap(own, _footprint(pose, piece.half_size_m)), (
                        f"{thing.object_id} stands in {neighbour.object_id}"
                    )


def test_objects_rest_on_something(room):
    for thing in room.objects:
        height = thing.world_from_object.translation[2]
        if height == 0.0:
            continue
        low, high = (
            s.object_from_box.translation + sign * np.array(s.half_size_m)
            for sign in (-1, 1)
            for s in [_under(room, thing.world_from_object.translation)]
        )
        corners = thing.world_from_object @ np.array(
            [
                [sx * thing.box_m[0] / 2, sy * thing.box_m[1] / 2, 0]
                for sx in (-1, 1)
                for sy in (-1, 1)
            ]
        )
        assert (corners[:, :2] > low[:2]).all(), thing.object_id
        assert (corners[:, :2] < high[:2]).all(), thing.object_id


def test_rig_stands_free_at_a_useful_distance(room):
    rig = room.world_from_rig.translation
    forward = room.world_from_rig.rotation[:, 2]
    assert forward[2] == pytest.approx(0.0, abs=1e-9), "the front lens looks level"
    distances = [
        float(np.linalg.norm((o.world_from_object.translation - rig)[:2])) for o in room.objects
    ]
    if room.name == "lab":
        assert rig[2] == pytest.approx(1.3)
        assert all(1.2 <= d <= 3.5 for d in distances), distances
    else:
        assert all(0.4 <= d <= 1.0 for d in distances), distances
        assert rig[2] - 0.74 == pytest.approx(RIG_ABOVE_TABLE_M[room.name])
    stand = _footprint(Pose.from_yaw(0.0, (rig[0], rig[1], rig[2] / 2)), (0.05, 0.05, rig[2] / 2))
    for solid in room.solids:
        assert not _overlap(stand, _footprint(solid.object_from_box, solid.half_size_m))


def test_lab_has_room_to_push_a_chair(lab):
    """A chair fits at every place of a grid 1 to 2.5 m in front of the camera."""
    blocked = 0
    for x in np.arange(-1.6, 1.3, 0.3):
        for y in np.arange(0.3, 1.75, 0.3):
            chair = _footprint(Pose.from_yaw(0.0, (x, y, 0.45)), (0.25, 0.25, 0.44))
            blocked += any(
                _overlap(chair, _footprint(s.object_from_box, s.half_size_m)) for s in lab.solids
            )
    assert blocked == 0


def test_triangle_budget_and_edge_lengths(room):
    assert sum(len(m.faces) for m in room.static) <= 60_000
    for mesh in room.static:
        assert _longest_edge(mesh) <= 0.121
    for thing in room.objects:
        assert len(thing.meshes[0].faces) <= 8_000
        assert _longest_edge(thing.meshes[0]) <= 0.05


def test_textures_fit_a_graphics_card(room):
    for mesh in room.static:
        assert max(mesh.texture.shape[:2]) <= 8192


def test_qr_codes_can_be_read_off_the_wall(room, raycast, tmp_path):
    """Each code, photographed from a metre away, has the payload, place and size that it claims."""
    assert len(room.codes) == {"lab": 3, "desk": 2, "tangram": 2}[room.name]
    camera = Pinhole.from_fov(800, 800, math.radians(30))
    photo = tmp_path / "photo.png"
    for code in room.codes:
        eye = code.world_from_code @ np.array([0.1, 0.05, 0.9])
        view = look_at(eye, code.world_from_code.translation)
        meshes = [(m, Pose.identity()) for m in room.static]
        rgb, _, _ = raycast(meshes, camera, view, shade=False)
        cv2.imwrite(str(photo), rgb[..., ::-1])
        views = (View("photo.png", photo, camera, view),)
        nothing = np.zeros((0, 3))
        (anchor,) = find_anchors(
            Reconstruction(views, nothing, nothing.astype(np.uint8), np.zeros(0, np.float32))
        )
        assert anchor.payload == code.payload
        half = code.side_m / 2
        truth = code.world_from_code @ np.array(
            [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]]
        )
        expected, _ = camera.project(view.inverse() @ truth)
        assert np.abs(anchor.sightings[0].corners_px - expected).max() < 0.5


def test_light_comes_from_the_window(lab):
    """The bright picture on the wall lies where `light_direction` says, seen from the middle."""
    direction = lab.light_direction
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert direction[0] < -0.5
    assert direction[2] > 0.3


def test_the_room_is_closed_and_well_exposed(room, raycast):
    """Seen from the rig there is no gap, few pixels are black or burnt, and there is contrast."""
    camera = Fisheye.from_fov(300, math.radians(200))
    meshes = [(m, Pose.identity()) for m in room.static]
    rgb, reach, index = raycast(meshes, camera, room.world_from_rig, shade=False)
    yy, xx = np.mgrid[0:300, 0:300] + 0.5
    inside = np.hypot(xx - 150, yy - 150) < 148
    assert (index[inside] >= 0).all()
    assert reach[inside].min() > 0.2
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)[inside]
    assert (grey < 12).mean() < 0.02
    assert (grey > 250).mean() < 0.05
    assert 110 < grey.mean() < 190
    assert grey.std() > 35


def test_outside_of_every_face_is_towards_the_viewer(room, raycast):
    """Faces are counter-clockwise from outside: rays from the rig meet them against the normal."""
    camera = Fisheye.from_fov(200, math.radians(180))
    backs = 0
    for thing in room.objects:
        mesh = thing.meshes[0]
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        volume = float(np.einsum("nd,nd->n", a, np.cross(b, c)).sum()) / 6
        backs += volume <= 0
        _, _, index = raycast(
            [(mesh, thing.world_from_object)], camera, room.world_from_rig, shade=False
        )
        assert (index == 0).sum() > 15, f"{thing.object_id} is not in view"
    assert backs == 0


def test_cache_gives_back_what_was_kept(tmp_path, lab):
    part = StaticPart(lab.static[0], lab.solids, lab.codes)
    path = tmp_path / "room.npz"
    save(part, path)
    again = load(path)
    assert np.array_equal(again.mesh.texture, part.mesh.texture)
    assert np.array_equal(again.mesh.faces, part.mesh.faces)
    assert [c.payload for c in again.codes] == [c.payload for c in part.codes]
    assert np.allclose(
        again.solids[3].object_from_box.matrix(), part.solids[3].object_from_box.matrix()
    )
    assert [p.name for p in tmp_path.iterdir()] == ["room.npz"]


def test_damaged_cache_is_rebuilt_and_old_files_go(tmp_path, lab, caplog):
    part = StaticPart(lab.static[0], lab.solids, lab.codes)
    calls = []

    def build() -> StaticPart:
        calls.append(1)
        return part

    (tmp_path / "lab-0123456789abcdef.npz").write_bytes(b"old")
    cached("lab", build, folder=tmp_path)
    kept = list(tmp_path.iterdir())
    assert len(kept) == 1
    assert cached("lab", build, folder=tmp_path).codes[0].payload == part.codes[0].payload
    assert len(calls) == 1
    kept[0].write_bytes(kept[0].read_bytes()[:5000])
    cached("lab", build, folder=tmp_path)
    assert len(calls) == 2
    assert "damaged" in caplog.text
    assert cached("lab", build, folder=tmp_path).mesh.faces.shape == part.mesh.faces.shape
    assert len(calls) == 2


def _under(room: PhysicalRoom, point: np.ndarray) -> BoxPart:
    """The solid whose top carries a point."""
    for solid in room.solids:
        centre, half = solid.object_from_box.translation, np.array(solid.half_size_m)
        top = centre[2] + half[2]
        if abs(top - point[2]) < 1e-6 and (np.abs(point - centre)[:2] < half[:2]).all():
            return solid
    raise AssertionError(f"nothing carries {point}")


def _corners(part: BoxPart) -> np.ndarray:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return part.object_from_box @ (signs * np.array(part.half_size_m))


def _footprint(pose: Pose, half: tuple[float, float, float]) -> tuple[np.ndarray, float, float]:
    """Plan of an upright box, shrunk by a millimetre, and its heights."""
    signs = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    plan = pose @ (signs * (np.array(half) - 1e-3))
    z = float(pose.translation[2])
    return plan[:, :2], z - half[2] + 1e-3, z + half[2] - 1e-3


def _overlap(a: tuple[np.ndarray, float, float], b: tuple[np.ndarray, float, float]) -> bool:
    """Separating axes of two upright boxes."""
    if a[1] >= b[2] or b[1] >= a[2]:
        return False
    for plan in (a[0], b[0]):
        for k in range(2):
            edge = plan[k + 1] - plan[k]
            axis = np.array([-edge[1], edge[0]])
            first, second = a[0] @ axis, b[0] @ axis
            if first.max() <= second.min() or second.max() <= first.min():
                return False
    return True


def _longest_edge(mesh) -> float:
    corners = mesh.vertices[mesh.faces]
    return float(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max())
