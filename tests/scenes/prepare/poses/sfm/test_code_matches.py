"""Features of one printed code that look like those of another."""

import cv2
import numpy as np
import pycolmap
import pytest
import zxingcpp

from scenes.prepare.poses.sfm.code_matches import (
    NO_CODE,
    Sheet,
    drop_mixed_codes,
    labels_of,
    sheets_in,
)
from scenes.prepare.poses.sfm.session import open_database

SQUARE = np.array([[100.0, 100], [200, 100], [200, 200], [100, 200]])


def test_features_on_a_sheet_are_the_codes():
    keypoints = np.array([[150.0, 150], [80, 150], [70, 150], [400, 150]])
    for corners in (SQUARE, SQUARE[::-1]):
        labels = labels_of(keypoints, [Sheet("B", corners)], numbers={"A": 0, "B": 1})
        assert labels.tolist() == [1, 1, NO_CODE, NO_CODE]


@pytest.fixture
def database(tmp_path):
    """Three pictures with four features each, of which all pairs are matched one to one."""
    path = tmp_path / "database.db"
    points = np.array([[150, 150], [110, 190], [400, 150], [20, 20]], np.float32)
    with open_database(path) as opened:
        camera = pycolmap.Camera.create_from_model_id(
            1, pycolmap.CameraModelId.SIMPLE_PINHOLE, 500.0, 640, 480
        )
        lens = opened.write_camera(camera)
        ids = [
            opened.write_image(pycolmap.Image(name=name, camera_id=lens))
            for name in ("a.jpg", "b.jpg", "c.jpg")
        ]
        for image in ids:
            opened.write_keypoints(image, points)
        every = np.repeat(np.arange(4, dtype=np.uint32)[:, None], 2, axis=1)
        for first, second in ((0, 1), (0, 2), (1, 2)):
            opened.write_matches(ids[first], ids[second], every)
            geometry = pycolmap.TwoViewGeometry()
            geometry.config = pycolmap.TwoViewGeometryConfiguration.CALIBRATED
            geometry.inlier_matches = every
            opened.write_two_view_geometry(ids[first], ids[second], geometry)
    return path


def test_matches_of_two_codes_are_dropped_and_no_others(database):
    sheets = {
        "a.jpg": (Sheet("A", SQUARE),),
        "b.jpg": (Sheet("B", SQUARE),),
        "c.jpg": (Sheet("A", SQUARE),),
    }
    pairs = [("a.jpg", "b.jpg"), ("a.jpg", "c.jpg"), ("b.jpg", "c.jpg")]
    with open_database(database) as opened:
        assert drop_mixed_codes(opened, pairs, sheets=sheets) == [pairs[0], pairs[2]]
        ids = [opened.read_image_with_name(f"{name}.jpg").image_id for name in "abc"]
        assert np.asarray(opened.read_matches(ids[0], ids[1]))[:, 0].tolist() == [2, 3]
        assert not opened.exists_two_view_geometry(ids[0], ids[1])
        assert opened.exists_two_view_geometry(ids[0], ids[2])
        assert drop_mixed_codes(opened, pairs, sheets=sheets) == []


def test_a_room_with_one_code_keeps_all(database):
    sheets = {"a.jpg": (Sheet("A", SQUARE),), "b.jpg": (Sheet("A", SQUARE),), "c.jpg": ()}
    with open_database(database) as opened:
        assert (
            drop_mixed_codes(opened, [("a.jpg", "b.jpg"), ("a.jpg", "c.jpg")], sheets=sheets) == []
        )


def test_codes_are_read_in_pictures(tmp_path):
    picture = np.full((300, 400), 255, np.uint8)
    barcode = zxingcpp.create_barcode("ROOM-1", zxingcpp.BarcodeFormat.QRCode)
    symbol = np.asarray(barcode.to_image(scale=6, add_quiet_zones=False))
    side = len(symbol)
    picture[60 : 60 + side, 90 : 90 + side] = symbol
    cv2.imwrite(str(tmp_path / "a.png"), picture)
    found = sheets_in(tmp_path, ["a.png", "missing.png"])
    (sheet,) = found["a.png"]
    assert sheet.payload == "ROOM-1"
    assert np.allclose(sheet.corners_px.mean(axis=0), [90 + side / 2, 60 + side / 2], atol=3)
    assert "missing.png" not in found
