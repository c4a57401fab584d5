"""The layout is found in pictures of the simulated camera, in rooms that set no constant of it."""

from __future__ import annotations

import math
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.random_rooms.room import random_room
from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.search import PAIRS_OF_TURNS, darkness_outside, find_layout, shrunk
from devices.camera.lenses.upright_evidence import rim_agreement, small_lens_picture, upright_nats
from devices.camera.stream_decoder import StreamPicture
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, CameraOptions, default_rig
from tests.stream_pictures import picture_from_rgb

FRAME = os.environ.get("NEXUS_DUAL_FISHEYE_FRAME", "")
"""A real camera's I420 frame as a grey or coloured picture: Y above the two quarters U and V."""

PAIRS = (Arrangement.SIDE_BY_SIDE, Arrangement.STACKED)
SINGLES = (Arrangement.EQUIRECTANGULAR, Arrangement.ONE_LENS)
LAYOUTS = [LensLayout(a, turns) for a in PAIRS for turns in PAIRS_OF_TURNS] + [
    LensLayout(a, (turn,)) for a in SINGLES for turn in range(4)
]
FIRST_ROOM = 7000
"""Rooms 5000 to 5039 set the constants."""


def filmed(seed, size=384):
    """Both lens pictures of a random room."""
    room = random_room(seed).live
    bodies = [body_of_object(item) for item in room.objects]
    camera = Camera360(
        room,
        default_rig(size),
        room.world_from_rig,
        bodies,
        options=CameraOptions(supersampling=1),
    )
    where = {
        item.object_id: Placement(
            (item.world_from_object,), float(item.world_from_object.translation[2])
        )
        for item in room.objects
    }
    view = camera.view(where)
    camera.close()
    return [lens.rgb for lens in view.lenses]


def sphere(lenses, height=256):
    """An equirectangular picture of what both lenses see."""
    down, right = np.mgrid[:height, : 2 * height] + 0.5
    lat, lon = (down / height - 0.5) * np.pi, (right / (2 * height) - 0.5) * 2 * np.pi
    rays = np.stack([np.sin(lon) * np.cos(lat), np.sin(lat), np.cos(lon) * np.cos(lat)], axis=-1)
    halves = []
    for picture, lens, signs in zip(
        lenses, default_rig(len(lenses[0])).lenses, ([1, 1, 1], [-1, 1, -1]), strict=True
    ):
        pixels, _ = lens.project((rays * signs).reshape(-1, 3))
        places = (pixels - 0.5).astype(np.float32).reshape(*rays.shape[:2], 2)
        halves.append(cv2.remap(picture, places[..., 0], places[..., 1], cv2.INTER_LINEAR))
    return np.where(rays[..., 2:] > 0, halves[0], halves[1])


def laid_out(lenses, layout):
    if layout.arrangement is Arrangement.EQUIRECTANGULAR:
        return np.rot90(sphere(lenses), -layout.turns[0])
    turned = [np.rot90(lens, -turn) for lens, turn in zip(lenses, layout.turns, strict=False)]
    axis = 1 if layout.arrangement is Arrangement.SIDE_BY_SIDE else 0
    return np.concatenate(turned, axis=axis)


def in_other_light(picture, rng):
    """Exposure, gamma, colour of light, noise, a raised black level and compression."""
    values = (picture / 255.0) ** rng.uniform(0.7, 1.4)
    values *= math.exp(rng.uniform(math.log(0.2), math.log(1.6))) * rng.uniform(0.8, 1.1, 3)
    values = np.clip(values, 0, 1) * 255
    values += rng.normal(0, rng.uniform(0.5, 4), values.shape)
    values[picture.max(axis=2) == 0] = rng.uniform(0, 12)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.uniform(40, 90))]
    _, data = cv2.imencode(".jpg", np.clip(values, 0, 255).astype(np.uint8)[..., ::-1], quality)
    return np.ascontiguousarray(cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1])


@pytest.fixture(scope="module")
def lenses():
    return filmed(FIRST_ROOM)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.shown)
def test_every_layout_of_a_room_is_found(lenses, layout):
    found = find_layout(picture_from_rgb(np.ascontiguousarray(laid_out(lenses, layout))))
    assert found.layout == layout
    assert found.confidence > 0.5
    assert found.score == found.others[0][1] > 0


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_forty_rooms_in_forty_lights_are_all_found():
    rng = np.random.default_rng(1)
    wrong = []
    for number in range(40):
        layout = LAYOUTS[number % len(LAYOUTS)]
        picture = laid_out(filmed(FIRST_ROOM + number), layout)
        found = find_layout(picture_from_rgb(in_other_light(picture, rng)))
        if found.layout != layout:
            wrong.append((FIRST_ROOM + number, layout.shown, found.layout.shown))
    assert not wrong


@pytest.mark.skipif(not Path(FRAME).is_file(), reason="NEXUS_DUAL_FISHEYE_FRAME names no picture")
def test_a_real_camera_s_frame_has_two_lenses_turned_against_each_other():
    y = cv2.imread(FRAME, cv2.IMREAD_GRAYSCALE)
    y = y[: y.shape[0] * 2 // 3 & ~1, : y.shape[1] & ~1]
    grey = np.full((y.shape[0] // 2, y.shape[1] // 2), 128, np.uint8)
    found = find_layout(StreamPicture(y, grey, grey, True))
    assert found.layout == LensLayout(Arrangement.SIDE_BY_SIDE, (3, 1))


def test_a_picture_without_circles_is_one_lens_and_unsure(lenses):
    picture = cv2.resize(lenses[0][100:280, 60:320], (640, 480))
    found = find_layout(picture_from_rgb(picture))
    assert found.layout.arrangement is Arrangement.ONE_LENS


def test_a_tiny_picture_is_refused():
    with pytest.raises(ValueError, match="at least 64 px"):
        find_layout(picture_from_rgb(np.zeros((32, 64, 3), np.uint8)))


def test_corners_are_dark_where_the_circles_are(lenses):
    luma = picture_from_rgb(np.concatenate(lenses, axis=1)).y
    small = shrunk(luma)
    assert darkness_outside(small, Arrangement.SIDE_BY_SIDE) > 0.95
    assert darkness_outside(small, Arrangement.ONE_LENS) < 0.5


def test_rims_agree_only_as_the_lenses_are_mounted(lenses):
    front, back = (small_lens_picture(picture_from_rgb(lens).y) for lens in lenses)
    assert rim_agreement(front, back) > 0.9
    assert rim_agreement(np.ascontiguousarray(np.rot90(front)), back) < 0.5


def test_upright_is_likelier_than_upside_down(lenses):
    front = small_lens_picture(picture_from_rgb(lenses[0]).y)
    assert upright_nats(front) > upright_nats(np.ascontiguousarray(front[::-1, ::-1])) + 1.0
