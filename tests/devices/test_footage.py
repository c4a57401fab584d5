import csv
import json

import av
import cv2
import numpy as np
import pytest

from devices.footage import FootageError, duration_ns, lens_size_px, read_camera, read_footage
from scenes.cameras import Fisheye, Rig, rig_to_json
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose

SIZE = 64
LENS = Fisheye.from_fov(SIZE, np.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
WHERE = Pose.from_yaw(0.4, (1.0, -2.0, 1.3))


@pytest.fixture
def camera(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(camera_values()))
    return read_camera(path)


def camera_values():
    where = {"wxyz": WHERE.quaternion().tolist(), "translation": WHERE.translation.tolist()}
    return {**rig_to_json(RIG), "world_from_rig": where}


def lens_picture(seq, lens):
    """Flat colours survive compression: red counts pictures, green tells the lens."""
    return np.full((SIZE, SIZE, 3), (40 + 12 * seq, 60 + 120 * lens, 90), np.uint8)


def write_video(path, tracks, *, fps=10):
    """One picture track each; a track is a list of RGB pictures."""
    with av.open(str(path), "w", format="mp4") as container:
        streams = []
        for pictures in tracks:
            stream = container.add_stream("libx264", rate=fps)
            stream.width, stream.height = pictures[0].shape[1], pictures[0].shape[0]
            stream.pix_fmt = "yuv420p"
            streams.append(stream)
        for index in range(len(tracks[0])):
            for stream, pictures in zip(streams, tracks, strict=True):
                frame = av.VideoFrame.from_ndarray(pictures[index], format="rgb24")
                container.mux(
                    stream.encode(frame.reformat(dst_colorspace="ITU709", format="yuv420p"))
                )
        for stream in streams:
            container.mux(stream.encode())


def side_by_side(seq):
    return np.hstack([lens_picture(seq, 0), lens_picture(seq, 1)])


def write_folder(folder, rows, columns):
    folder.mkdir(exist_ok=True)
    with (folder / "times.csv").open("w", newline="") as opened:
        writer = csv.writer(opened)
        writer.writerow(columns)
        writer.writerows(rows)


def assert_pictures(frames, count):
    assert [frame.seq for frame in frames] == list(range(count))
    for frame in frames:
        for lens in (0, 1):
            seen = np.median(frame.images[lens].reshape(-1, 3), axis=0)
            assert np.abs(seen - lens_picture(frame.seq, lens)[0, 0]).max() < 6
        assert np.array_equal(frame.world_from_rig.matrix(), WHERE.matrix())


def test_a_video_with_both_lenses_side_by_side(tmp_path, camera):
    path = tmp_path / "room.mp4"
    write_video(path, [[side_by_side(k) for k in range(5)]])
    frames = list(read_footage(path, camera))
    assert_pictures(frames, 5)
    assert [frame.t_ns for frame in frames] == [k * 100_000_000 for k in range(5)]
    assert duration_ns(path) == pytest.approx(5e8, rel=0.01)


@pytest.mark.parametrize("name", ["room.mp4", "VID_00_001.insv"])
def test_a_track_for_each_lens(tmp_path, camera, name):
    path = tmp_path / name
    write_video(path, [[lens_picture(k, lens) for k in range(4)] for lens in (0, 1)])
    assert_pictures(list(read_footage(path, camera)), 4)


def test_a_file_for_each_lens(tmp_path, camera):
    for part, lens in (("_00_", 0), ("_10_", 1)):
        path = tmp_path / f"VID_20260101{part}001.insv"
        write_video(path, [[lens_picture(k, lens) for k in range(4)]])
    assert_pictures(list(read_footage(tmp_path / "VID_20260101_00_001.insv", camera)), 4)


def test_the_side_of_a_lens_s_picture_is_known_before_it_is_decoded(tmp_path):
    both = tmp_path / "both.mp4"
    write_video(both, [[side_by_side(0)]])
    each = tmp_path / "each.mp4"
    write_video(each, [[lens_picture(0, lens)] for lens in (0, 1)])
    side = lens_picture(0, 0).shape[0]
    assert lens_size_px(both, 2) == lens_size_px(each, 2) == side
    with pytest.raises(FootageError, match="wanted 3 square lens pictures"):
        lens_size_px(both, 3)


def test_the_other_lens_s_file_is_missing(tmp_path, camera):
    path = tmp_path / "VID_20260101_00_001.insv"
    write_video(path, [[lens_picture(k, 0) for k in range(2)]])
    with pytest.raises(FootageError, match=r"VID_20260101_10_001\.insv.*missing"):
        list(read_footage(path, camera))


@pytest.mark.parametrize("each", [False, True])
def test_a_folder_of_pictures_with_times(tmp_path, camera, each):
    rows = []
    for seq in range(3):
        if each:
            names = [f"{seq}-{lens}.png" for lens in (0, 1)]
            pictures = [lens_picture(seq, lens) for lens in (0, 1)]
        else:
            names, pictures = [f"{seq}.png"], [side_by_side(seq)]
        for name, picture in zip(names, pictures, strict=True):
            cv2.imwrite(str(tmp_path / name), picture[:, :, ::-1])
        rows.append([7 + seq * 1000, *names])
    columns = ["t_ns", "file_0", "file_1"] if each else ["t_ns", "file"]
    write_folder(tmp_path, rows, columns)
    frames = list(read_footage(tmp_path, camera))
    assert_pictures(frames, 3)
    assert [frame.t_ns for frame in frames] == [7, 1007, 2007]


def test_times_that_do_not_grow(tmp_path, camera):
    cv2.imwrite(str(tmp_path / "a.png"), side_by_side(0))
    write_folder(tmp_path, [[5, "a.png"], [5, "a.png"]], ["t_ns", "file"])
    with pytest.raises(FootageError, match="picture 1 is of 5 ns, not after"):
        list(read_footage(tmp_path, camera))


@pytest.mark.parametrize(
    ("rows", "columns", "said"),
    [
        ([["soon", "a.png"]], ["t_ns", "file"], "line 2: t_ns is 'soon'"),
        ([[1, "b.png"]], ["t_ns", "file"], "line 2: .*b.png: No such file"),
        ([[1, ""]], ["t_ns", "file"], "line 2: names no picture"),
        ([[1, "times.csv"]], ["t_ns", "file"], "no picture that can be read"),
        ([[1, "a.png"]], ["time", "file"], "wanted t_ns and file"),
    ],
)
def test_a_bad_list_of_times(tmp_path, camera, rows, columns, said):
    cv2.imwrite(str(tmp_path / "a.png"), side_by_side(0))
    write_folder(tmp_path, rows, columns)
    with pytest.raises(FootageError, match=said):
        list(read_footage(tmp_path, camera))


def test_a_folder_without_times(tmp_path, camera):
    folder = tmp_path / "pictures"
    folder.mkdir()
    with pytest.raises(FootageError, match=r"no times\.csv"):
        list(read_footage(folder, camera))


def test_pictures_of_another_size(tmp_path, camera):
    cv2.imwrite(str(tmp_path / "a.png"), side_by_side(0)[:32])
    write_folder(tmp_path, [[1, "a.png"]], ["t_ns", "file"])
    with pytest.raises(FootageError, match="64×32 px, the camera file says 64×64"):
        list(read_footage(tmp_path, camera))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("room.mp4", b"no video at all", "no video that can be opened"),
        ("room.txt", b"text", "neither a video"),
        ("room.mp4", None, "no such video or folder"),
    ],
)
def test_what_is_no_footage(tmp_path, camera, name, content, said):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FootageError, match=said):
        list(read_footage(path, camera))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v: v.pop("world_from_rig"), "'world_from_rig' is missing"),
        (lambda v: v["world_from_rig"].pop("wxyz"), "'wxyz' is missing"),
        (lambda v: v["lenses"].pop(), "1 lenses and 2 poses"),
        (lambda v: v["lenses"][0].update(model="box"), "camera model 'box'"),
        (lambda v: v["world_from_rig"].update(wxyz=[1, 2]), "camera.json"),
    ],
)
def test_a_bad_camera_file(tmp_path, change, said):
    values = camera_values()
    change(values)
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(values))
    with pytest.raises(FootageError, match=said):
        read_camera(path)


@pytest.mark.parametrize("text", ["{", "[1]", "\ud800"])
def test_a_camera_file_that_is_none(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(FootageError, match="not a camera file"):
        read_camera(path)
