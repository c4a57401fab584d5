"""The process that makes reduced pictures: what it makes, waits for, and leaves behind."""

import time
from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.studio.seeking import write_recording
from devices.replay import ReplayCamera
from studio.app.timeline.pictures import proxies as proxies_module
from studio.app.timeline.pictures.proxies import Proxies, proxies_of
from studio.app.timeline.pictures.proxy_process import content_digest, make_proxies
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.reading import read_index

SIDE_PX, FRAMES = 32, 50


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "recording.mcap"
    write_recording(path, duration_s=FRAMES / 10, lens_px=64)
    return read_index(path)


def begun(index, folder, **rest):
    wanted = {"begin_after_s": 0.0, "side_px": SIDE_PX, **rest}
    return Proxies(index.path, index.packets.topics[0], folder, **wanted)


def wait(condition, limit_s=120.0):
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, f"not there in {limit_s} s"
        time.sleep(0.01)


@pytest.fixture(scope="module")
def made(long, tmp_path_factory):
    """The folder with all reduced pictures."""
    folder = tmp_path_factory.mktemp("made")
    proxies = begun(long, folder)
    wait(lambda: proxies.is_done)
    assert proxies.problem == ""
    proxies.stop()
    return folder


def test_every_packet_has_the_reduced_picture_of_exactly_that_instant(long, made):
    proxies = begun(long, made)
    wait(lambda: proxies.is_done)
    frames = list(ReplayCamera(long.path).frames())
    small = np.array(
        [
            cv2.resize(frame.images[0], (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA)
            for frame in frames
        ],
        float,
    )
    for number, frame in enumerate(frames):
        found = proxies.find(number, frame.t_ns)
        assert found.shape == (SIDE_PX, SIDE_PX, 3)
        off = np.abs(found - small).mean(axis=(1, 2, 3))
        assert off[number] == off[max(0, number - 9) : number + 10].min()
    proxies.stop()
    assert len(list(made.iterdir())) == 1


def test_what_was_made_is_found_again_and_not_made_anew(long, made):
    (path,) = made.iterdir()
    before = path.read_bytes()
    proxies = begun(long, made)
    wait(lambda: proxies.is_done)
    assert proxies.path == path
    proxies.stop()
    assert path.read_bytes() == before


def test_a_damaged_file_gives_nothing_and_is_removed(long, made, tmp_path):
    (path,) = made.iterdir()
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    damaged = tmp_path / path.name
    damaged.write_bytes(data)
    proxies = begun(long, tmp_path)
    wait(lambda: proxies.is_done)
    found = [proxies.find(n, int(t)) is not None for n, t in enumerate(long.packets.t_ns)]
    assert not all(found)
    assert "damaged" in proxies.problem
    assert not damaged.exists()
    proxies.stop()


def test_nothing_is_made_while_somebody_holds_and_nothing_is_left_by_a_stop(long, tmp_path):
    proxies = begun(long, tmp_path, begin_after_s=0.1)
    proxies.hold("session")
    proxies.hold("picture")
    proxies.release("picture")
    time.sleep(1.5)
    assert not proxies.is_done
    proxies.stop()
    assert proxies.is_done
    assert list(tmp_path.iterdir()) == []


def test_who_is_released_goes_on(long, tmp_path):
    proxies = begun(long, tmp_path)
    with proxies.held("picture"):
        time.sleep(0.2)
    wait(lambda: proxies.is_done)
    assert proxies.find(FRAMES - 1, int(long.packets.t_ns[-1])) is not None
    proxies.stop()


def test_one_that_never_began_leaves_nothing(long, tmp_path):
    proxies = begun(long, tmp_path / "none", begin_after_s=60.0)
    proxies.stop()
    assert not (tmp_path / "none").exists()


def test_a_folder_that_cannot_be_written_is_a_problem_in_words(long, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    proxies = begun(long, tmp_path / "file")
    wait(lambda: proxies.is_done)
    assert proxies.problem
    assert proxies.find(0, 0) is None
    proxies.stop()


def test_an_end_in_the_middle_removes_what_was_written(long, tmp_path):
    asked = []

    def is_ended():
        asked.append(1)
        return len(asked) > 10

    paths = []
    make_proxies(
        long.path, long.packets.topics[0], tmp_path,
        side_px=SIDE_PX, most_bytes=10**9, is_ended=is_ended, found=paths.append,
    )  # fmt: skip
    assert len(paths) == 1
    assert list(tmp_path.iterdir()) == []


def test_pictures_that_find_no_room_are_left_out(long, tmp_path):
    limit = 20_000
    make_proxies(
        long.path, long.packets.topics[0], tmp_path,
        side_px=SIDE_PX, most_bytes=limit, is_ended=lambda: False, found=lambda _path: None,
    )  # fmt: skip
    (path,) = tmp_path.iterdir()
    assert 10_000 < path.stat().st_size <= limit


def test_the_name_is_that_of_the_content(long, tmp_path):
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(long.path.read_bytes())
    assert content_digest(copy) == content_digest(long.path)
    copy.write_bytes(copy.read_bytes() + b" ")
    assert content_digest(copy) != content_digest(long.path)


def test_a_seek_shows_the_reduced_picture_and_then_the_full_one(long, made):
    proxies = begun(long, made)
    wait(lambda: proxies.is_done)
    thread = PictureThread(long, proxies=proxies)
    came = []
    thread.pictures.put = came.append
    t_ns = int(long.packets.t_ns[17])
    thread.ask(t_ns)
    wait(lambda: len(came) == 2)
    thread.ask(int(long.packets.t_ns[18]))  # plays on: the full picture is as soon
    wait(lambda: len(came) == 3)
    thread.stop()
    proxies.stop()
    reduced, full, after = came
    assert (reduced.t_ns, full.t_ns, after.t_ns) == (t_ns, t_ns, int(long.packets.t_ns[18]))
    assert [picture.is_full for picture in came] == [False, True, True]
    assert all(picture.is_exact for picture in came)
    assert reduced.picture.shape == (SIDE_PX, SIDE_PX, 3)
    assert full.picture.shape == (64, 64, 3)


def test_small_pictures_and_those_without_long_groups_need_none(long, monkeypatch):
    assert proxies_of(long) is None
    monkeypatch.setattr(proxies_module, "SIDE_PX", SIDE_PX)
    wanted = proxies_of(long)
    assert wanted is not None
    wanted.stop()
    packets = replace(long.packets, keyframe=np.ones(FRAMES, bool))
    assert proxies_of(replace(long, packets=packets)) is None
    assert proxies_of(replace(long, packets=None)) is None
