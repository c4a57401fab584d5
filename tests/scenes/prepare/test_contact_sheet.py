from __future__ import annotations

import numpy as np

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
