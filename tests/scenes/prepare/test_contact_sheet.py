from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.prepare.capture import CaptureOptions
from scenes.prepare.contact_sheet import GREEN, RED, camera_map, contact_sheet
from scenes.prepare.gather import gather
from scenes.prepare.reconstruction import Reconstruction, View


def test_frames_without_a_place_are_framed_red(photographed, tmp_path):
    capture = gather(
        photographed.folder, tmp_path, options=CaptureOptions(frames=12, least_frames=3)
    )
    sheet = contact_sheet(capture, failed=(capture.frames[5].name,), columns=4, width_px=80)
    assert sheet.shape == (180, 320, 3)
    corners = sheet[::60, ::80].reshape(-1, 3)
    assert [tuple(c) == RED for c in corners] == [k == 5 for k in range(12)]
    assert sum(tuple(c) == GREEN for c in corners) == 11


def test_the_map_shows_the_way_seen_from_above(photographed):
    views = tuple(
        View(name, photographed.folder / name, photographed.camera, world_from_camera)
        for name, world_from_camera in photographed.world_from_camera.items()
    )
    rng = np.random.default_rng(0)
    points = rng.uniform([0, 0, 0], [4, 4, 3], (500, 3))
    colours = np.full((500, 3), 90, dtype=np.uint8)
    reconstruction = Reconstruction(views, points, colours, np.zeros(500, dtype=np.float32))
    picture = camera_map(reconstruction, size_px=200)
    assert picture.shape == (200, 200, 3)
    assert (picture == 90).all(axis=2).sum() > 100
    assert (picture == GREEN).all(axis=2).sum() > 60


def test_the_map_is_not_mirrored():
    """Walking a circle to the left is anticlockwise seen from above, so right comes before up."""
    camera = Pinhole.from_fov(64, 48, 1.0)
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    where = np.stack([2 * np.cos(angles), 1.2 * np.sin(angles), 0 * angles], axis=1)
    views = tuple(
        View(f"{k}", Path(), camera, look_at(eye, np.array([0.0, 0.0, -0.1])))
        for k, eye in enumerate(where)
    )
    marks = np.repeat([[3.0, 0.0, 0.0], [0.0, 3.0, 0.0]], 300, axis=0)
    marks = marks + np.random.default_rng(0).normal(0, 0.1, marks.shape)
    colours = np.repeat(np.array([[200, 0, 0], [0, 0, 200]], dtype=np.uint8), 300, axis=0)
    errors_px = np.zeros(600, dtype=np.float32)
    picture = camera_map(Reconstruction(views, marks, colours, errors_px), size_px=300)
    at_x, at_y = (
        np.argwhere((picture == colour).all(axis=2)).mean(axis=0)[::-1] - 150
        for colour in (colours[0], colours[-1])
    )
    assert at_x[0] * -at_y[1] - -at_x[1] * at_y[0] > 0
