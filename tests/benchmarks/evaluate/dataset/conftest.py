"""A dataset folder of the smallest size: two photos, one still, one object."""

import json
import math

import cv2
import numpy as np
import pytest

CUBE = """v 0 0 0
v 0.2 0 0
v 0 0.2 0
v 0 0 0.2
f 1 2 3
f 1 2 4
f 1 3 4
f 2 3 4
"""
IDENTITY = np.eye(4).tolist()


def at(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose.tolist()


def write(path, value):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(value if isinstance(value, str) else json.dumps(value))


@pytest.fixture
def folder(tmp_path):
    seen = {"box": {"fraction": 0.75, "box_unoccluded": [10, 10, 40, 40]}}
    frames = [
        {"file": f"images/{name}.png", "world_from_camera": at(place, 0, 1)}
        for place, name in enumerate(("a", "b"))
    ]
    camera = {"width": 64, "height": 48, "fx": 50, "fy": 50, "cx": 32, "cy": 24}
    write(tmp_path / "capture/cameras.json", {**camera, "frames": frames})
    write(
        tmp_path / "capture/visible.json",
        {
            "labels": {"ids": {"box": 1}, "scale": 2},
            "frames": {f"images/{name}.png": seen for name in "ab"},
        },
    )
    labels = np.zeros((24, 32), np.uint8)
    labels[6:12, 8:20] = 1
    for name in "ab":
        for kind in ("images", "masks"):
            (tmp_path / "capture" / kind).mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(tmp_path / f"capture/images/{name}.png"), np.zeros((48, 64, 3), np.uint8))
        cv2.imwrite(str(tmp_path / f"capture/masks/{name}.png"), labels)
    item = {
        "type": "box",
        "mesh": "objects/box.obj",
        "box_min": [0, 0, 0],
        "box_max": [0.2, 0.2, 0.2],
        "world_from_object": at(1, 1, 0),
        "symmetry": "repeats every 90 deg",
    }
    write(tmp_path / "objects.json", {"objects": {"box": item}})
    write(tmp_path / "objects/box.obj", CUBE)
    write(tmp_path / "room.obj", CUBE)
    corners = [[0, 2, 1.5], [0.2, 2, 1.5], [0.2, 2, 1.3], [0, 2, 1.3]]
    codes = {"A": {"corners_world": corners, "role": "check"}}
    write(tmp_path / "qr.json", {"side_m": 0.2, "codes": codes})
    still = {
        "name": "start_0",
        "file": "images/start_0.png",
        "world_from_object": {"box": at(1, 1, 0)},
        "visible": seen,
    }
    lens = {"width": 64, "height": 64, "f_px": 18, "cx": 32, "cy": 32, "fov_deg": 200}
    write(
        tmp_path / "fisheye/room/truth.json",
        {
            "camera": lens,
            "world_from_camera": IDENTITY,
            "moving": ["box", "person"],
            "frames": [still, {**still, "name": "r0", "world_from_object": {"box": at(2, 1, 0)}}],
        },
    )
    (tmp_path / "fisheye/room/images").mkdir()
    cv2.imwrite(str(tmp_path / "fisheye/room/images/start_0.png"), np.zeros((64, 64, 3), np.uint8))
    assert math.isclose(lens["f_px"] * math.radians(100), 31.4, abs_tol=0.1)
    return tmp_path
