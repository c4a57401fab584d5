import csv
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.takes import RECORDING, TakeCache
from benchmarks.evaluate.protocols.stations import carried
from devices.recording import Recorder
from devices.recording_codec import FrameStamp
from scenes.cameras import rig_to_json
from scenes.package import save_package
from scenes.pose import Pose, rotation_angle
from scenes.samples import sample_room
from studio.cli import EXIT_DONE, EXIT_INPUT, main
from studio.session.plan import SessionPlan
from studio.verbs.track import Tally, tracks_as_json
from tests.insta360_file import write_insv


def camera_file(path, rig, world_from_rig):
    pose = {
        "wxyz": world_from_rig.quaternion().tolist(),
        "translation": world_from_rig.translation.tolist(),
    }
    path.write_text(json.dumps({**rig_to_json(rig), "world_from_rig": pose}))
    return path


def written(tiny, frames):
    tally, done = Tally(), []
    blocks = tracks_as_json(
        {"format": "gaussiannexus tracks"},
        "own",
        tiny.tracker(0.03),
        iter(frames),
        done=done.append,
        tally=tally,
    )
    return json.loads(b"".join(blocks)), tally, done


def test_every_frame_and_object_is_in_the_file(tiny):
    frames = [message.frame for message in tiny.inputs()]
    values, tally, done = written(tiny, frames)
    tracks = values["methods"]["own"]
    assert [entry["t_ns"] for entry in tracks] == [frame.t_ns for frame in frames]
    assert done == frames
    for entry in tracks:
        assert {track["object_id"] for track in entry["objects"]} == {"chair-1", "stool-1"}
        for track in entry["objects"]:
            assert track["t_ns"] == entry["t_ns"]
            assert np.array(track["world_from_object"]).shape == (4, 4)
            assert np.array(track["covariance"]).shape == (4, 4)
            assert 0 <= track["visible_fraction"] <= 1
            assert track["state"] in ("static", "tracked", "occluded", "lost")
            assert track["confidence"] == 0.9
    assert tally.frames == tiny.frames
    rows = {row.name: row.value for row in tally.rows()}
    assert rows["track.chair-1.occluded"] == pytest.approx(len(tiny.hidden) / tiny.frames)


def test_footage_without_pictures_leaves_no_file(tiny):
    with pytest.raises(ValueError, match="without a single picture"):
        written(tiny, [])


@pytest.mark.usefixtures("no_traceback")
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["lab", "missing.mp4", "--out", "{tmp}/t.json"], "no such video or folder"),
        (["lab", "{tmp}/film", "--out", "{tmp}/t.json"], "give --camera CAMERA.json"),
        (["lab", "missing.mcap", "--out", "{tmp}/t.json"], "missing.mcap"),
        (["lab", "x.mp4", "--camera", "{tmp}/none.json", "--out", "{tmp}/t.json"], "none.json"),
        (["lab", "x.mp4", "--out", "{tmp}/no/t.json"], "in a folder that exists"),
        (["lab", "x.mp4", "--out", "{tmp}"], "wanted a file name"),
        (["lab", "x.mp4", "--camera", "{tmp}/cam.json", "--out", "{tmp}/t.json"], "no such video"),
        (["{tmp}/nowhere", "{tmp}/film", "--camera", "{tmp}/cam.json", "--out", "{tmp}/t.json"],
         "nowhere"),
        (["{tmp}/bare", "{tmp}/film", "--camera", "{tmp}/cam.json", "--out", "{tmp}/t.json"],
         "nexus cut"),
        (["{tmp}/tiny", "{tmp}/film", "--camera", "{tmp}/cam.json", "--out", "{tmp}/t.json"],
         "no times.csv"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_line_and_leaves_nothing(tiny, tmp_path, capsys, words, said):
    frame = next(tiny.inputs()).frame
    camera_file(tmp_path / "cam.json", frame.rig, frame.world_from_rig)
    (tmp_path / "film").mkdir()
    save_package(tiny.scene, tmp_path / "tiny", replace=False)
    save_package(replace(tiny.scene, objects=()), tmp_path / "bare", replace=False)
    code = main(["track", *(word.format(tmp=tmp_path) for word in words)])
    assert code == EXIT_INPUT
    message = capsys.readouterr().err.strip().splitlines()[-1]
    assert said in message
    assert not (tmp_path / "t.json").exists()


@pytest.mark.slow
def test_a_simulated_clip_is_tracked_the_same_from_a_recording_and_from_pictures(tmp_path):
    """The chair's pose comes out near the truth; how the frames travelled makes no difference."""
    room = sample_room("lab")
    poses = {item.object_id: item.world_from_object for item in room.objects}
    start = poses["chair-1"]
    end = Pose.from_yaw(start.yaw() + 0.3, start.translation + np.array([0.2, -0.1, 0.0]))
    way = [start, start, *carried(start, end, 5)]
    shots = [Shot(k * 10**8, standing({**poses, "chair-1": p})) for k, p in enumerate(way)]
    with FilmSet(room, cache=TakeCache(tmp_path / "takes")) as film_set:
        conditions = Conditions(lens_size_px=640)
        take = film_set.film(shots, conditions, seed=0, advance=lambda _share: None)
    camera = camera_file(tmp_path / "cam.json", take.session().rig, room.world_from_rig)
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    with (pictures / "times.csv").open("w", newline="") as opened:
        writer = csv.writer(opened)
        writer.writerow(["t_ns", "file_0", "file_1"])
        for message in take.play(room.world_from_rig):
            names = [f"{message.frame.seq}-{lens}.png" for lens in (0, 1)]
            for name, image in zip(names, message.frame.images, strict=True):
                cv2.imwrite(str(pictures / name), image[:, :, ::-1])
            writer.writerow([message.frame.t_ns, *names])
    found = []
    for footage in (take.folder / RECORDING, pictures):
        out = tmp_path / "tracks.json"
        words = ["track", "lab", str(footage), "--camera", str(camera), "--out", str(out)]
        assert main(words) == EXIT_DONE
        found.append(json.loads(out.read_text())["methods"]["own"])
    assert found[0] == found[1]
    chair = next(t for t in found[0][-1]["objects"] if t["object_id"] == "chair-1")
    seen = Pose.from_matrix(chair["world_from_object"])
    assert np.linalg.norm(seen.translation - end.translation) < 0.05
    assert rotation_angle(seen.rotation.T @ end.rotation) < np.radians(5)


@pytest.mark.slow
def test_an_insv_is_tracked_with_its_own_lenses_from_where_the_room_shows_it(tmp_path, capsys):
    room = sample_room("lab")
    poses = {item.object_id: item.world_from_object for item in room.objects}
    shots = [Shot(k * 10**8, standing(poses)) for k in range(4)]
    with FilmSet(room, cache=TakeCache(tmp_path / "takes")) as film_set:
        take = film_set.film(
            shots, Conditions(lens_size_px=640), seed=0, advance=lambda _share: None
        )
    images = [message.frame.images for message in take.play(room.world_from_rig)]
    video = write_insv(tmp_path / "VID_20260101_00_001.insv", images, take.session().rig)
    out = tmp_path / "tracks.json"
    assert main(["track", "lab", str(video), "--out", str(out)]) == EXIT_DONE
    said = capsys.readouterr().err
    assert "lenses: as Insta360 X4 itself has calibrated them" in said
    where = Pose.from_matrix(json.loads(out.read_text())["methods"]["own"][-1]["world_from_rig"])
    off = where.translation - room.world_from_rig.translation
    assert np.linalg.norm(off) < 0.01


def test_a_recording_without_the_camera_s_place_says_so(tiny, tmp_path, capsys):
    """A camera that nobody located: the file is whole, but cannot be tracked without a pose."""
    message = next(tiny.inputs())
    frame = message.frame
    path = tmp_path / "r.mcap"
    info = tiny.session(SessionPlan(scene="tiny", methods=("own",))).info
    with Recorder(path, info) as recorder:
        recorder.write(FrameStamp(frame.stream_id, 0, frame.t_ns, frame.t_ns, None))
        recorder.write(message.input.packet)
    save_package(tiny.scene, tmp_path / "tiny", replace=False)
    out = tmp_path / "t.json"
    assert main(["track", str(tmp_path / "tiny"), str(path), "--out", str(out)]) == EXIT_INPUT
    assert "has no camera pose" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--matcher", "none.onnx"], "add --method paper"),
        (["--method", "paper", "--matcher", "none.onnx"], "no such file"),
        (["--method", "paper", "--detector", "none.onnx"], "no such file"),
    ],
)
def test_networks_are_refused_before_anything_begins(tmp_path, capsys, flags, message):
    out = tmp_path / "tracks.json"
    assert main(["track", "lab", str(tmp_path), "--out", str(out), *flags]) == EXIT_INPUT
    assert message in capsys.readouterr().err
    assert not out.exists()
