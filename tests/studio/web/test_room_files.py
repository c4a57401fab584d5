import json
import threading

import numpy as np
import pytest

from scenes.formats.registry import read_splats
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose, rotation_from_quaternion
from studio.session.pipeline import CancelledError
from studio.web.room_files import MANIFEST, MAX_FIRST_BYTES, write_room_files


@pytest.fixture(scope="module")
def lab_files(lab, tmp_path_factory):
    return write_room_files(lab, tmp_path_factory.mktemp("room"))


def test_a_room_comes_in_two_steps_and_each_object_by_itself(lab, lab_files):
    first, whole = (read_splats(lab_files[f"{name}.spz"]) for name in ("first", "room"))

    assert lab_files["first.spz"].stat().st_size <= MAX_FIRST_BYTES
    assert 0.4 * len(lab.room) < len(first) < len(whole) == len(lab.room)
    assert first.sh.shape[1] == 1
    for index, item in enumerate(lab.objects):
        assert len(read_splats(lab_files[f"object-{index}.spz"])) == len(item.splats)


def test_the_manifest_says_where_everything_is_with_y_up(lab, lab_files):
    manifest = json.loads(lab_files[MANIFEST].read_text())

    assert [item["id"] for item in manifest["objects"]] == [o.object_id for o in lab.objects]
    assert manifest["footprint"] == lab.footprint_m.tolist()
    assert 2.2 <= manifest["height_m"] < 3.5
    for item, model in zip(manifest["objects"], lab.objects, strict=True):
        x, y, z, qx, qy, qz, qw = item["pose"]
        pose = Pose(rotation_from_quaternion(np.array([qw, qx, qy, qz])), np.array([x, y, z]))
        back = WORLD_FROM_GLTF @ pose @ WORLD_FROM_GLTF.inverse()
        np.testing.assert_allclose(back.matrix(), model.world_from_object.matrix(), atol=1e-4)


def test_a_budget_of_splats_is_kept(lab, tmp_path):
    files = write_room_files(lab, tmp_path, max_splats=20_000)

    counts = {name: len(read_splats(path)) for name, path in files.items() if name[0] in "ofr"}
    objects = sum(count for name, count in counts.items() if name.startswith("object"))
    assert 19_000 < counts["room.spz"] + objects <= 20_000
    assert counts["first.spz"] + objects <= 20_000


def test_files_of_the_same_scene_are_taken_as_they_lie(lab, lab_files, box_room, tmp_path):
    before = {name: path.stat().st_mtime_ns for name, path in lab_files.items()}
    again = write_room_files(lab, lab_files[MANIFEST].parent)
    assert {name: path.stat().st_mtime_ns for name, path in again.items()} == before

    made = write_room_files(box_room, tmp_path)
    made["object-0.spz"].unlink()
    assert write_room_files(box_room, tmp_path)["object-0.spz"].is_file()


def test_a_cancelled_one_leaves_no_manifest(box_room, tmp_path):
    cancelled = threading.Event()
    cancelled.set()

    with pytest.raises(CancelledError):
        write_room_files(box_room, tmp_path, cancelled=cancelled)

    assert not (tmp_path / MANIFEST).exists()
