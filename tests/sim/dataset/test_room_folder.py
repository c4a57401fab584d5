"""`sim.dataset.room_folder`, `.photos`, `.check`: written, read back, damaged."""

import hashlib
import json
import shutil

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.rays import RayScene
from sim.dataset import json_stream, pictures
from sim.dataset.check import check_dataset, check_room_folder
from sim.dataset.room_folder import NANOSECONDS
from sim.dataset.truth.agreement import Looked, agreement
from sim.dataset.truth.surfaces import read_obj


def _digest(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_what_is_written_agrees_with_the_meshes(room_folder):
    folder, written = room_folder
    assert (written.frames, written.photos) == (3, 6)
    checked = check_dataset(folder)
    assert checked == written.checked
    assert checked.images == 6
    assert checked.compared >= 3
    assert checked.iou_worst > 0.98
    assert checked.length_mm < 1.0
    assert f"{checked.compared} silhouettes" in checked.line()


def test_the_same_seed_writes_the_same_bytes(small_room, room_folder, write, tmp_path):
    folder, _ = room_folder
    write(small_room, tmp_path / "again")
    assert _digest(tmp_path / "again") == _digest(folder)
    write(small_room, tmp_path / "other", seed=4, photos=None)
    other = _digest(tmp_path / "other")
    name = "fisheye/sequence/images/f00000.png"
    assert other[name] != _digest(folder)[name]
    assert not any(file.startswith("capture") for file in other)


def test_masks_of_photos_lie_on_the_objects(small_room, room_folder):
    folder, _ = room_folder
    seen = json.loads((folder / "capture/visible.json").read_text())
    cameras = json.loads((folder / "capture/cameras.json").read_text())
    assert [frame["file"] for frame in cameras["frames"]] == list(seen["frames"])
    camera = Pinhole(*(cameras[key] for key in ("width", "height", "fx", "fy", "cx", "cy")))
    compared = 0
    for frame in cameras["frames"]:
        name = frame["file"].replace("images", "masks").replace("jpg", "png")
        labels = pictures.read_picture(folder / "capture" / name)
        eye = Pose.from_matrix(np.array(frame["world_from_camera"]))
        for item in small_room.objects:
            entry = seen["frames"][frame["file"]][item.object_id]
            mask = labels == seen["labels"]["ids"][item.object_id]
            assert np.count_nonzero(mask) == entry["pixels_visible"]
            if entry["fraction"] < 0.98 or entry["pixels_visible"] < 200:
                continue
            mesh = RayScene(read_obj(folder / f"objects/{item.object_id}.obj"))
            looked = Looked(camera, eye, np.zeros(labels.shape), True)
            found = agreement(looked, mesh, item.world_from_object, alone=mask, visible=mask)
            assert found.iou > 0.9
            compared += 1
    assert compared


def test_a_video_holds_every_packet_and_no_raw_stream(small_room, write, tmp_path):
    write(small_room, tmp_path / "set", pictures="video", photos=None)
    video = cv2.VideoCapture(str(tmp_path / "set/fisheye/video.mp4"))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == 6
    assert NANOSECONDS == 1_000_000_000
    assert not list((tmp_path / "set").rglob("*.h264"))
    truth = json.loads((tmp_path / "set/fisheye/sequence/truth.json").read_text())
    assert [frame["video_frame"] for frame in truth["frames"]] == [0, 2, 4]


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda truth: truth["frames"][0]["world_from_object"]["chair-1"][0].__setitem__(0, 2.0),
         "rotations"),
        (lambda truth: [f["world_from_object"]["chair-1"][0].__setitem__(3, 1.0)
                        for f in truth["frames"]], "overlap"),
        (lambda truth: truth["frames"][0]["visible"]["chair-1"].update(fraction=0.3), "fractions"),
        (lambda truth: truth.update(range_unit_m=0.0006), "lengths"),
        (lambda truth: truth["frames"][0].pop("visible"), "visible"),
    ],
)  # fmt: skip
def test_damage_is_found(room_folder, tmp_path, damage, said):
    folder = tmp_path / "set"
    shutil.copytree(room_folder[0], folder)
    path = folder / "fisheye/sequence/truth.json"
    truth = json.loads(path.read_text())
    damage(truth)
    json_stream.write_json(path, truth)
    with pytest.raises(ValueError, match=said):
        check_dataset(folder).require(folder)


def test_a_missing_picture_is_named(room_folder, tmp_path):
    shutil.copytree(room_folder[0], tmp_path / "set")
    (tmp_path / "set/fisheye/sequence/images/f00002.png").unlink()
    with pytest.raises(ValueError, match=r"f00002\.png"):
        check_room_folder(tmp_path / "set")


def test_a_full_disk_leaves_nothing(small_room, write, tmp_path, monkeypatch):
    calls = []

    def full(path, picture):
        calls.append(path)
        if len(calls) > 9:
            raise OSError(28, "No space left on device", str(path))
        path.write_bytes(b"x")

    monkeypatch.setattr(pictures, "_write", full)
    with pytest.raises(OSError, match="nothing was left behind"):
        write(small_room, tmp_path / "set", photos=None)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_something_is_left_alone(small_room, write, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(OSError, match="already holds something"):
        write(small_room, tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "mine"
