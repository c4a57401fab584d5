from __future__ import annotations

import errno
import shutil
import struct
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from PIL import Image

from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from scenes.prepare.footage import photos as photos_module
from scenes.prepare.footage.capture import CaptureError, CaptureKind, CaptureOptions
from scenes.prepare.footage.gather import gather
from scenes.prepare.footage.panorama_views import panorama_views, view_pictures
from scenes.prepare.footage.sharpness import Reason
from scenes.prepare.progress import Cancelled
from tests.insta360_file import write_insv

HEIC = Path(__file__).parents[3] / "data" / "cases" / "portrait.heic"
"""A phone's: stored on its side, turned by its container."""
FEW = CaptureOptions(frames=12, least_frames=4)


@pytest.fixture(scope="module")
def canvas(speckled) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.hstack([speckled(rng) for _ in range(3)])


def look(canvas, x, *, width=480, height=360):
    return canvas[40 : 40 + height, x : x + width]


def write_video(path, pictures, fps=20):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps))
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.options = {"preset": "ultrafast", "crf": "18"}
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="bgr24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


@pytest.fixture
def photo_folder(canvas, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(8):
        cv2.imwrite(str(folder / f"p{k}.jpg"), look(canvas, 100 * k))
    return folder


def test_good_photos_are_all_taken_in_order(photo_folder, tmp_path):
    capture = gather(photo_folder, tmp_path / "work", options=FEW)
    assert capture.kind is CaptureKind.PHOTOS
    assert [f.source for f in capture.frames] == [f"p{k}.jpg" for k in range(8)]
    assert not capture.rejected
    assert len({f.lens for f in capture.frames}) == 1
    for frame in capture.frames:
        assert cv2.imread(str(capture.folder / frame.name)).shape == (360, 480, 3)


def test_bad_photos_are_left_out_with_the_reason(photo_folder, canvas, tmp_path):
    (photo_folder / "a broken one.jpg").write_bytes(b"\xff\xd8 not a picture")
    (photo_folder / "empty.jpg").write_bytes(b"")
    cv2.imwrite(str(photo_folder / "q1.jpg"), cv2.blur(look(canvas, 150), (31, 1)))
    cv2.imwrite(str(photo_folder / "q2.jpg"), look(canvas, 150) // 30)
    cv2.imwrite(str(photo_folder / "q3.jpg"), np.full((360, 480, 3), 200, np.uint8))
    cv2.imwrite(str(photo_folder / "q4.jpg"), look(canvas, 300))
    capture = gather(photo_folder, tmp_path / "work", options=FEW)
    assert {r.source: r.reason for r in capture.rejected} == {
        "a broken one.jpg": Reason.UNREADABLE,
        "empty.jpg": Reason.UNREADABLE,
        "q1.jpg": Reason.BLURRED,
        "q2.jpg": Reason.DARK,
        "q3.jpg": Reason.EMPTY,
        "q4.jpg": Reason.ALIKE,
    }
    assert len(capture.frames) == 8
    assert "2 not readable" in capture.summary()


def test_photos_whose_names_fall_together_keep_names_of_their_own(canvas, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    names = ["Room.png", "a b.jpg", "a_b.jpg", "room.jpeg", "room.jpg", "room_0004.jpg", "x.jpg"]
    for k, name in enumerate(names):
        cv2.imwrite(str(folder / name), look(canvas, 100 * k))
    capture = gather(folder, tmp_path / "work", options=FEW)
    assert [frame.source for frame in capture.frames] == names
    stored = [frame.name for frame in capture.frames]
    assert len({name.casefold() for name in stored}) == len(names)
    assert stored[-2:] == ["room_0004.jpg", "x.jpg"]
    for k, name in enumerate(stored):
        picture = cv2.imread(str(capture.folder / name)).astype(int)
        assert np.abs(picture - look(canvas, 100 * k)).mean() < 10


def test_files_beside_the_photos_that_are_not_read_are_named(photo_folder, tmp_path):
    for name in ("a.dng", "b.HEIC", "walk.mov", ".hidden", "Thumbs.db"):
        (photo_folder / name).write_bytes(b"\0\0\0\x18ftypheic" + bytes(500))
    (photo_folder / "more").mkdir()
    (photo_folder / "p0.jpg").rename(photo_folder / "more" / "p0.jpg")
    capture = gather(photo_folder, tmp_path / "work", options=FEW)
    assert len(capture.frames) == 7
    assert {r.source: r.reason for r in capture.rejected} == {
        "a.dng": Reason.FOREIGN,
        "b.HEIC": Reason.UNREADABLE,
        "more/": Reason.FOREIGN,
        "walk.mov": Reason.FOREIGN,
    }
    assert capture.not_read().startswith("4 files were not read: b.HEIC, a.dng, more/, walk.mov. ")
    few = CaptureOptions(frames=12, least_frames=8)
    with pytest.raises(CaptureError, match=r"not read are b.HEIC, a.dng, .* Export them as JPEG"):
        gather(photo_folder, tmp_path / "few", options=few)


def test_heic_photos_are_read_upright(photo_folder, tmp_path):
    pytest.importorskip("pi_heif")
    shutil.copy(HEIC, photo_folder / "z.HEIC")
    shutil.copy(HEIC, photo_folder / "zz.jpg")
    capture = gather(photo_folder, tmp_path / "work", options=FEW)
    assert capture.frames[-1].source == "z.HEIC"
    stored = cv2.imread(str(capture.folder / capture.frames[-1].name))
    assert stored.shape == (480, 320, 3)
    assert stored[:200].mean() > stored[-200:].mean() + 20
    assert capture.rejected[-1].reason is Reason.ALIKE


def test_a_phone_s_film_is_read_as_phones_make_it(canvas, tmp_path):
    """Portrait by the container's rotation, 10-bit HEVC, frames unevenly apart."""
    film = tmp_path / "IMG_1.mov"
    with av.open(str(film), "w") as container:
        stream = container.add_stream("libx265", rate=30)
        stream.width, stream.height, stream.pix_fmt = 464, 360, "yuv420p10le"
        stream.options = {"x265-params": "log-level=none", "preset": "ultrafast", "crf": "16"}
        stream.time_base = stream.codec_context.time_base = Fraction(1, 600)
        at = 0
        for k in range(90):
            upright = look(canvas, 6 * k, width=360, height=464)
            side = np.ascontiguousarray(np.rot90(upright))
            frame = av.VideoFrame.from_ndarray(side, format="bgr24").reformat(format="yuv420p10le")
            at += (19, 20, 41)[k % 3]
            frame.pts, frame.time_base = at, Fraction(1, 600)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    data = bytearray(film.read_bytes())
    # A quarter turn clockwise in the track header, as iPhones write it (16.16 and 2.30 fixed).
    matrix = data.index(b"tkhd") + 44
    turn = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 360 << 16, 0, 1 << 30)
    data[matrix : matrix + 36] = turn
    film.write_bytes(data)
    capture = gather(film, tmp_path / "work", options=FEW)
    assert len(capture.frames) >= 10
    times = np.array([frame.t_s for frame in capture.frames])
    for frame, t_s in zip(capture.frames, times, strict=True):
        picture = cv2.imread(str(capture.folder / frame.name)).astype(int)
        assert picture.shape == (464, 360, 3)
        k = round((t_s * 600 - 19) / 80 * 3)
        nearest = min(
            np.abs(picture - look(canvas, 6 * n, width=360, height=464)).mean()
            for n in range(max(0, k - 2), k + 3)
        )
        assert nearest < 12
    assert 3.5 < times[-1] - times[0] < 4.1


def test_focal_length_camera_and_orientation_come_from_the_metadata(canvas, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(4):
        picture = Image.fromarray(np.ascontiguousarray(look(canvas, 100 * k)[..., ::-1]))
        exif = Image.Exif()
        exif[0x010F], exif[0x0110] = "Maker", "Model"
        exif[0x0112] = 6 if k == 3 else 1
        exif.get_ifd(0x8769)[0xA405] = 26
        picture.save(folder / f"{k} with spaces.jpg", exif=exif, quality=95)
    capture = gather(folder, tmp_path / "work", options=FEW)
    wanted = 26 / np.hypot(36, 24) * np.hypot(480, 360)
    assert [f.focal_px for f in capture.frames] == pytest.approx([wanted] * 4)
    upright, turned = capture.frames[0], capture.frames[3]
    assert "Maker Model" in upright.lens
    assert upright.lens != turned.lens
    assert cv2.imread(str(capture.folder / turned.name)).shape == (480, 360, 3)
    assert not any(" " in frame.name for frame in capture.frames)


def test_large_photos_are_made_smaller_with_their_focal_length(canvas, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(4):
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0xA405] = 30
        big = cv2.resize(look(canvas, 100 * k), (1200, 900))
        Image.fromarray(big[..., ::-1].copy()).save(folder / f"{k}.jpg", exif=exif)
    options = CaptureOptions(frames=12, least_frames=4, longest_px=600)
    capture = gather(folder, tmp_path / "work", options=options)
    assert cv2.imread(str(capture.folder / "0.jpg")).shape == (450, 600, 3)
    assert capture.frames[0].focal_px == pytest.approx(30 / np.hypot(36, 24) * 750)


def test_a_second_call_finds_the_pictures_and_a_changed_one_does_not(photo_folder, tmp_path):
    first = gather(photo_folder, tmp_path / "work", options=FEW)
    stamps = [(first.folder / f.name).stat().st_mtime_ns for f in first.frames]
    assert gather(photo_folder, tmp_path / "work", options=FEW) == first
    assert [(first.folder / f.name).stat().st_mtime_ns for f in first.frames] == stamps
    (photo_folder / "p7.jpg").unlink()
    assert len(gather(photo_folder, tmp_path / "work", options=FEW).frames) == 7


def test_frames_of_a_video_step_evenly_and_blurred_ones_are_avoided(canvas, tmp_path):
    pictures = [look(canvas, 4 * k) for k in range(200)]
    for k in range(60, 140, 2):
        pictures[k] = cv2.blur(pictures[k], (35, 1))
    video = write_video(tmp_path / "sweep.mp4", pictures)
    options = CaptureOptions(frames=20, least_frames=4)
    capture = gather(video, tmp_path / "work", options=options)
    assert capture.kind is CaptureKind.VIDEO
    assert 18 <= len(capture.frames) <= 22
    times = np.array([frame.t_s for frame in capture.frames])
    assert np.all(np.abs(np.diff(times) - 0.5) < 0.3)
    assert max(frame.blur for frame in capture.frames) < 0.5
    assert capture.counts()["blurred"] >= 25
    assert capture.counts()["too like its neighbour"] >= 25


def test_a_jump_in_a_video_is_reported_as_a_gap(canvas, tmp_path):
    pictures = [look(canvas, 4 * k) for k in range(60)]
    pictures += [look(canvas, 800 + 4 * k) for k in range(60)]
    video = write_video(tmp_path / "jump.mp4", pictures)
    capture = gather(video, tmp_path / "work", options=FEW)
    assert len(capture.gaps) == 1
    names = {frame.name: frame.t_s for frame in capture.frames}
    assert names[capture.gaps[0].before] < 3.0 <= names[capture.gaps[0].after]


@pytest.mark.parametrize(("level", "word"), [(0, "too dark"), (120, "without detail")])
def test_a_video_of_nothing_says_so(tmp_path, level, word):
    video = write_video(tmp_path / "nothing.mp4", [np.full((240, 320, 3), level, np.uint8)] * 40)
    with pytest.raises(CaptureError, match=f"0 usable pictures.*{word}"):
        gather(video, tmp_path / "work", options=FEW)


def test_a_video_without_motion_asks_to_walk(canvas, tmp_path):
    video = write_video(tmp_path / "still.mp4", [look(canvas, 0)] * 40)
    with pytest.raises(CaptureError, match="walk through the room"):
        gather(video, tmp_path / "work", options=FEW)


def test_a_short_video_says_how_short_and_how_long_to_film(canvas, tmp_path):
    video = write_video(tmp_path / "short.mp4", [look(canvas, 30 * k) for k in range(3)])
    with pytest.raises(CaptureError, match=r"ends at 0\.\d s: film for one to two minutes"):
        gather(video, tmp_path / "work", options=FEW)


@pytest.mark.parametrize(
    ("name", "words"),
    [("cut.mp4", "not whole: copy it from the camera again"), ("cut.avi", "export it as MP4, or")],
)
def test_a_damaged_video_says_what_to_do(tmp_path, name, words):
    (tmp_path / name).write_bytes(bytes(range(256)) * 40)
    with pytest.raises(CaptureError, match=words):
        gather(tmp_path / name, tmp_path / "work", options=FEW)


def test_what_is_no_capture_is_refused(tmp_path, photo_folder):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "no.mp4").write_bytes(b"this is no video at all")
    for source, message in [
        (tmp_path / "empty", "a folder without photos"),
        (tmp_path / "absent", "no such file or folder"),
        (tmp_path / "notes.txt", "neither a video"),
        (tmp_path / "no.mp4", "no video that can be opened"),
        ([], "no photos given"),
        ([photo_folder / "p0.jpg", photo_folder / "gone.jpg"], "gone.jpg: cannot be opened"),
        ([photo_folder / "p0.jpg", photo_folder / "p1.jpg"], "2 usable pictures, wanted"),
    ]:
        with pytest.raises(CaptureError, match=message):
            gather(source, tmp_path / "work", options=FEW)


def test_half_a_video_gives_what_it_holds(canvas, tmp_path):
    pictures = [look(canvas, 4 * k) for k in range(200)]
    whole = write_video(tmp_path / "whole.mkv", pictures)
    half = tmp_path / "half.mkv"
    half.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    capture = gather(half, tmp_path / "work", options=FEW)
    assert capture.frames[-1].t_s < 8


def test_a_full_disk_is_an_os_error_and_a_later_call_succeeds(photo_folder, tmp_path, monkeypatch):
    def full(path, blocks):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    with monkeypatch.context() as patch:
        patch.setattr(photos_module, "write_file", full)
        with pytest.raises(OSError, match="No space left"):
            gather(photo_folder, tmp_path / "work", options=FEW)
    assert len(gather(photo_folder, tmp_path / "work", options=FEW).frames) == 8


def test_it_can_be_stopped(photo_folder, tmp_path):
    def stop(done, note):
        raise Cancelled

    with pytest.raises(Cancelled):
        gather(photo_folder, tmp_path / "work", options=FEW, progress=stop)


def test_a_360_video_becomes_views_of_known_focal_length(canvas, tmp_path):
    lens = Fisheye.from_fov(240, np.radians(200))
    rig = Rig((lens, lens), (Pose.identity(), FRONT_FROM_BACK_LENS))
    pictures = [look(canvas, 4 * k, width=480, height=240) for k in range(120)]
    video = write_video(tmp_path / "room.insv.mp4", pictures)
    options = CaptureOptions(frames=24, least_frames=4, rig=rig)
    capture = gather(video, tmp_path / "work", options=options)
    assert capture.kind is CaptureKind.PANORAMA
    assert len(capture.frames) == 6 * 8
    assert {frame.focal_px for frame in capture.frames} == {capture.frames[0].focal_px}
    assert gather(video, tmp_path / "work", options=options) == capture
    each = [tuple(np.split(picture[:, :, ::-1], 2, axis=1)) for picture in pictures]
    tracks = write_insv(tmp_path / "tracks.insv", each, rig, fps=20)
    both = gather(tracks, tmp_path / "work2", options=options)
    assert len(both.frames) % 6 == 0
    wanted = view_pictures(pictures[round(20 * both.frames[0].t_s)], rig, panorama_views(rig))
    for frame, view in zip(both.frames, wanted, strict=False):
        assert np.median(cv2.absdiff(cv2.imread(str(both.folder / frame.name)), view)) < 6
    raw = video.rename(tmp_path / "room.insv")
    with pytest.raises(CaptureError, match="needs the calibration of its lenses"):
        gather(raw, tmp_path / "work", options=FEW)
