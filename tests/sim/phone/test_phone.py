from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise

import av
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.random_rooms.room import random_room
from scenes.cameras import Pinhole
from scenes.frames import OPENGL_FROM_OPENCV, look_at
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from sim.camera.sensor import SensorOptions
from sim.phone.capture import Distortion, read_truth
from sim.phone.light import still_scene
from sim.phone.path import HandShake, walk_around, walk_by_objects, walk_looking_up
from sim.phone.phone import FINE, PhoneOptions, drawn_camera, film
from sim.phone.raster import LitMesh, PinholeRasteriser

CLEAN = SensorOptions(0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
STEADY = HandShake(0.0, 0.0)
SMALL = PhoneOptions(
    frames=4, width_px=160, height_px=120, duration_s=20.0, samples=2, sensor=CLEAN
)


@pytest.fixture(scope="module")
def papered_room(small_room):
    """The small room with a floor that has a texture of its own and wallpaper."""
    floor = TexturedMesh(
        np.array([[-2, -2, 0.0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
        np.full((200, 200, 3), 200, np.uint8),
    )
    walls = small_room.static[0]
    blobs = np.random.default_rng(0).uniform(0, 255, (24, 48, 3)).astype(np.uint8)
    x, y, z = walls.vertices.T
    uv = np.stack([(x + 0.7 * y + 3.4) / 6.8, z / 2.5], axis=1).astype(np.float32)
    lowered = walls.vertices - np.array([0, 0, 0.01])
    patterned = TexturedMesh(lowered, walls.faces, uv, cv2.resize(blobs, (480, 240)))
    return replace(small_room, static=(patterned, floor, *small_room.static[1:]))


def _heights_near(room, xy):
    """Tops of the solids that contain a plan point."""
    tops = []
    for solid in room.solids:
        at = solid.object_from_box.inverse() @ np.array([*xy, 0.0])
        if (np.abs(at[:2]) < np.array(solid.half_size_m)[:2]).all():
            tops.append(solid.object_from_box.translation[2] + solid.half_size_m[2])
    return tops


@pytest.mark.parametrize("path", [walk_around, walk_looking_up, walk_by_objects])
@pytest.mark.parametrize("seed", range(4))
def test_the_phone_stays_in_the_room_and_out_of_furniture(small_room, path, seed):
    walk = path(small_room, 30.0, np.random.default_rng(seed), shake=HandShake())
    for t in np.linspace(0, 30, 121):
        eye = walk.world_from_camera(t).translation
        assert (np.abs(eye[:2]) < 1.95).all()
        assert all(top < eye[2] for top in _heights_near(small_room, eye[:2]))


@pytest.mark.parametrize("seed", range(4))
def test_a_walk_sees_every_wall_from_two_places(small_room, seed):
    """Each spot of the walls comes into the picture at times that lie apart in place."""
    walk = walk_around(small_room, 60.0, np.random.default_rng(seed), shake=HandShake())
    camera = Pinhole.from_fov(96, 72, math.radians(68))
    views = [walk.world_from_camera(t) for t in np.linspace(0.5, 59.5, 60)]
    for angle in np.arange(0, 2 * math.pi, 0.3):
        out = np.array([math.cos(angle), math.sin(angle)])
        spot = np.array([*(2.0 * out / np.abs(out).max()), 1.3])
        eyes = np.array([v.translation for v in views if camera.project(v.inverse() @ spot)[1][0]])
        assert len(eyes) >= 4
        assert np.linalg.norm(eyes - eyes[0], axis=1).max() > 0.4


@pytest.mark.parametrize("seed", range(4))
def test_looking_up_sees_all_of_the_ceiling_and_the_tops_of_walls(small_room, seed):
    walk = walk_looking_up(small_room, 40.0, np.random.default_rng(seed), shake=HandShake())
    camera = Pinhole.from_fov(96, 72, math.radians(68))
    views = [walk.world_from_camera(t) for t in np.linspace(0.5, 39.5, 28)]
    along = np.linspace(-1.9, 1.9, 7)
    spots = np.array([[x, y, 2.6] for x in along for y in along])
    tops = np.array([[2.0 * x, 2.0 * y, 2.2] for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))])
    for spot in (*spots, *tops):
        seen = sum(bool(camera.project(v.inverse() @ spot)[1][0]) for v in views)
        assert seen >= 3, spot


def test_close_ups_look_at_every_object_from_around(small_room):
    walk = walk_by_objects(small_room, 60.0, np.random.default_rng(0), shake=STEADY)
    views = [walk.world_from_camera(t) for t in np.linspace(0, 60, 400)]
    for item in small_room.objects:
        middle = item.world_from_object @ np.array([0, 0, item.box_m[2] / 2])
        looking = [
            v.translation - middle
            for v in views
            if (v.inverse() @ middle)[2] > 0 and np.linalg.norm((v.inverse() @ middle)[:2]) < 0.02
        ]
        assert len(looking) > 60
        around = np.unwrap([math.atan2(d[1], d[0]) for d in looking])
        assert np.ptp(around) > math.radians(60), item.object_id


def test_a_walk_is_smooth_and_as_long_as_asked(small_room):
    walk = walk_around(small_room, 40.0, np.random.default_rng(3), shake=STEADY)
    views = [walk.world_from_camera(t) for t in np.linspace(0, 40, 801)]
    steps = [np.linalg.norm(b.translation - a.translation) for a, b in pairwise(views)]
    turns = [
        np.linalg.norm(cv2.Rodrigues(a.rotation.T @ b.rotation)[0]) for a, b in pairwise(views)
    ]
    assert max(steps) < 0.05 * 1.2, "metres in a twentieth of a second"
    assert max(turns) < math.radians(3.0)
    assert walk.duration_s == 40.0


def test_shake_has_the_deviation_asked_for(small_room):
    steady, shaken = (
        walk_around(small_room, 40.0, np.random.default_rng(3), shake=shake)
        for shake in (STEADY, HandShake(0.01, 0.02))
    )
    apart = [
        steady.world_from_camera(t).inverse() @ shaken.world_from_camera(t)
        for t in np.linspace(0, 40, 2000)
    ]
    place = np.array([p.translation for p in apart])
    turn = np.array([cv2.Rodrigues(p.rotation)[0].ravel() for p in apart])
    assert place.std(axis=0) == pytest.approx([0.01] * 3, rel=0.15)
    assert turn.std(axis=0) == pytest.approx([0.02] * 3, rel=0.15)


def test_a_room_without_floor_or_things_is_refused(small_room):
    full = replace(small_room, footprint_m=np.array([[-0.2, -0.2], [0.2, 0.2]]))
    with pytest.raises(ValueError, match=r"'small'.*no free floor"):
        walk_around(full, 10.0, np.random.default_rng(0), shake=STEADY)
    with pytest.raises(ValueError, match="no movable object"):
        walk_by_objects(
            replace(small_room, objects=()), 10.0, np.random.default_rng(0), shake=STEADY
        )


def test_an_edge_lies_where_the_camera_projects_it():
    """Summed over samples, a quad covers what the camera's model says it does."""
    camera = Pinhole(64, 48, 60.0, 70.0, 30.3, 25.9)
    world_from_camera = look_at(np.array([0.4, -2.0, 1.1]), np.array([0.5, 0.0, 1.0]))
    flat = np.array([[-0.21, -0.13, 2.0], [0.24, -0.13, 2.0], [0.24, 0.17, 2.0], [-0.21, 0.17, 2]])
    corners = world_from_camera @ flat
    quad = LitMesh(
        corners,
        np.full((4, 2), 0.5),
        np.array([[0, 3, 2], [0, 2, 1]]),
        np.full((2, 2, 3), 255, np.uint8),
        np.ones((4, 3)),
    )
    rasteriser = PinholeRasteriser([quad], 64, 48)
    grid = (np.arange(32) + 0.5) / 32 - 0.5
    across, down = (
        sum(
            rasteriser.draw(camera, world_from_camera, shift_px=shift)[..., 0] / (255 * len(grid))
            for shift in shifts
        )
        for shifts in ([(a, 0.0) for a in grid], [(0.0, a) for a in grid])
    )
    rasteriser.close()
    (x0, y0), (x1, y1) = camera.project(flat[[0, 2]])[0]
    row, column = across[26], down[:, 30]
    assert row.sum() == pytest.approx(x1 - x0, abs=0.04)
    assert column.sum() == pytest.approx(y1 - y0, abs=0.04)
    assert row @ (np.arange(64) + 0.5) / row.sum() == pytest.approx((x0 + x1) / 2, abs=0.02)
    assert column @ (np.arange(48) + 0.5) / column.sum() == pytest.approx((y0 + y1) / 2, abs=0.02)


def test_light_and_texture_multiply():
    quad = LitMesh(
        np.array([[-5, -5, 1.0], [5, -5, 1], [5, 5, 1], [-5, 5, 1]]),
        np.full((4, 2), 0.5),
        np.array([[0, 3, 2], [0, 2, 1]]),
        np.full((2, 2, 3), (200, 100, 50), np.uint8),
        np.tile([0.5, 1.0, 2.0], (4, 1)),
    )
    rasteriser = PinholeRasteriser([quad], 16, 16)
    camera = Pinhole.from_fov(16, 16, 1.0)
    rgb = rasteriser.draw(camera, Pose.identity(), shift_px=(0.0, 0.0))
    assert np.abs(rgb.astype(int) - (100, 100, 100)).max() <= 1
    with pytest.raises(ValueError, match=r"8×16.*wanted 16×16"):
        rasteriser.draw(Pinhole.from_fov(8, 16, 1.0), Pose.identity(), shift_px=(0.0, 0.0))
    rasteriser.close()


def test_objects_darken_the_floor_under_them_and_nothing_far(papered_room):
    floor = still_scene(papered_room)[1]
    light = floor.texture[..., 0].astype(float) / 200.0

    def at(x, y):
        return light[round((2 - y) / 4 * 200 - 0.5), round((x + 2) / 4 * 200 - 0.5)]

    chair = papered_room.objects[0].world_from_object.translation
    assert at(chair[0], chair[1]) < 0.85
    assert at(-1.9, -1.9) == 1.0
    assert light.max() == 1.0
    assert papered_room.static[1].texture.min() == 200, "the room's own texture stays as it is"


def test_objects_are_lit_from_the_window_and_darker_below(papered_room):
    scene = still_scene(papered_room)
    book = scene[-1]
    top = book.light[book.vertices[:, 2] > book.vertices[:, 2].max() - 1e-6, 0].mean()
    bottom = book.light[book.vertices[:, 2] < book.vertices[:, 2].min() + 1e-6, 0].mean()
    assert 0.7 < top <= papered_room.ambient + papered_room.key
    assert bottom < 0.75 * top


@given(
    k1=st.floats(-0.15, 0.15).filter(lambda k: abs(k) > 1e-3),
    k2=st.floats(-0.03, 0.03),
    x=st.integers(0, 159),
    y=st.integers(0, 119),
)
def test_the_bend_is_browns(k1, k2, x, y):
    """A bent pixel shows the ray that Brown's model sends there."""
    camera = Pinhole.from_fov(80, 60, math.radians(68))
    grown, bend = drawn_camera(camera, Distortion(k1, k2))
    assert bend is not None
    straight = np.array([bend[0][y, x] + 0.5 - grown.cx, bend[1][y, x] + 0.5 - grown.cy]) / grown.fx
    r2 = float(straight @ straight)
    bent = straight * (1 + k1 * r2 + k2 * r2 * r2)
    wanted = np.array([x + 0.5, y + 0.5]) - FINE * np.array([camera.cx, camera.cy])
    assert np.abs(bent * FINE * camera.fx - wanted).max() < 0.02
    assert 0 <= bend[0][y, x] <= grown.width_px - 1
    assert 0 <= bend[1][y, x] <= grown.height_px - 1


def test_a_capture_is_photos_and_their_truth(papered_room, tmp_path):
    notes = []
    options = replace(SMALL, frames=6, held_out_every=3)
    capture = film(
        papered_room,
        tmp_path,
        rng=np.random.default_rng(5),
        options=options,
        progress=lambda done, note: notes.append((done, note)),
    )
    photos = sorted(p.name for p in (tmp_path / "images").iterdir())
    assert photos == [s.name for s in capture.shots]
    assert cv2.imread(str(tmp_path / "images" / photos[0])).shape == (120, 160, 3)
    assert [note for _, note in notes] == photos
    again = read_truth(tmp_path)
    assert again.camera == capture.camera
    assert [s.held_out for s in again.shots] == [False, True, False, False, True, False]
    for a, b in zip(again.shots, capture.shots, strict=True):
        assert np.allclose(a.world_from_camera.matrix(), b.world_from_camera.matrix(), atol=1e-12)
    values = json.loads((tmp_path / "truth" / "transforms.json").read_text())
    assert len(values["test_filenames"]) == 2
    for frame, shot in zip(values["frames"], capture.shots, strict=True):
        assert (tmp_path / "truth" / frame["file_path"]).exists()
        matrix = np.array(frame["transform_matrix"]) @ OPENGL_FROM_OPENCV.matrix()
        assert np.allclose(matrix, shot.world_from_camera.matrix(), atol=1e-12)


def test_photos_show_what_the_truth_says(papered_room, tmp_path, raycast):
    """A photo agrees with a picture of the same meshes that rays draw from the true pose."""
    capture = film(papered_room, tmp_path, rng=np.random.default_rng(5), options=SMALL)
    meshes = [(m, Pose.identity()) for m in papered_room.static]
    meshes += [(m, o.world_from_object) for o in papered_room.objects for m in o.meshes]
    for shot in capture.shots:
        photo = cv2.imread(str(tmp_path / "images" / shot.name), cv2.IMREAD_GRAYSCALE)
        rgb, _, _ = raycast(meshes, capture.camera, shot.world_from_camera, shade=False)
        wanted = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), (0, 0), 0.8)
        alike = {
            (dx, dy): np.corrcoef(
                np.roll(wanted, (dy, dx), axis=(0, 1))[4:-4, 4:-4].ravel(),
                photo[4:-4, 4:-4].ravel(),
            )[0, 1]
            for dx in (-1, 0, 1)
            for dy in (-1, 0, 1)
        }
        assert max(alike, key=lambda shift: alike[shift]) == (0, 0)
        assert alike[0, 0] > 0.9


def test_the_same_seed_gives_the_same_photos(papered_room, tmp_path):
    for folder in ("a", "b"):
        film(papered_room, tmp_path / folder, rng=np.random.default_rng(5), options=SMALL)
    for photo in (tmp_path / "a" / "images").iterdir():
        assert photo.read_bytes() == (tmp_path / "b" / "images" / photo.name).read_bytes()


def test_a_slow_shutter_blurs(papered_room, tmp_path):
    sharp = []
    for name, exposure_s in (("fast", 0.0), ("slow", 0.5)):
        options = replace(SMALL, exposure_s=exposure_s, samples=6)
        film(papered_room, tmp_path / name, rng=np.random.default_rng(5), options=options)
        photos = [cv2.imread(str(p), 0) for p in (tmp_path / name / "images").iterdir()]
        sharp.append(np.mean([cv2.Laplacian(p, cv2.CV_64F).var() for p in photos]))
    assert sharp[1] < 0.5 * sharp[0]


def test_a_video_has_every_frame_at_its_time(papered_room, tmp_path):
    rng = np.random.default_rng
    film(papered_room, tmp_path / "photos", rng=rng(5), options=SMALL)
    options = replace(SMALL, output="video")
    capture = film(papered_room, tmp_path / "video", rng=rng(5), options=options)
    with av.open(str(tmp_path / "video" / "video.mp4")) as container:
        frames = list(container.decode(video=0))
    assert len(frames) == len(capture.shots)
    for frame, shot in zip(frames, capture.shots, strict=True):
        expected_s = (shot.t_ns - capture.shots[0].t_ns) / 1e9
        assert frame.time == pytest.approx(expected_s, abs=2e-3)
        photo = cv2.imread(str(tmp_path / "photos" / "images" / shot.name))
        seen = cv2.cvtColor(frame.to_ndarray(format="rgb24"), cv2.COLOR_RGB2BGR)
        assert np.corrcoef(seen.ravel(), photo.ravel())[0, 1] > 0.95


def test_options_and_truth_that_make_no_sense_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"frames: 0"):
        PhoneOptions(frames=0)
    with pytest.raises(ValueError, match="duration > exposure"):
        PhoneOptions(duration_s=0.0)
    with pytest.raises(ValueError, match=r"'fly'.*objects.*walk"):
        PhoneOptions(path="fly")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"no truth.*film again"):
        read_truth(tmp_path)
    (tmp_path / "truth").mkdir()
    (tmp_path / "truth" / "truth.json").write_text('{"room": "x"}')
    with pytest.raises(ValueError, match=r"truth\.json.*film again"):
        read_truth(tmp_path)


@pytest.mark.parametrize("seed", [202, 205])
def test_a_crowded_room_is_walked_through_where_most_room_is(seed: int) -> None:
    """In 202 some directions have no free floor, in 205 an object has furniture before it."""
    room = random_room(seed).scanned
    rng = np.random.default_rng(seed)

    around = walk_around(room, 30.0, rng, shake=HandShake())
    near = walk_by_objects(room, 30.0, rng, shake=HandShake())

    low, high = room.footprint_m
    for walk in (around, near):
        eyes = np.stack([walk.world_from_camera(t).translation for t in np.linspace(0, 30, 60)])
        assert ((eyes[:, :2] > low) & (eyes[:, :2] < high)).all()
