"""A file of reduced pictures gives back what was put in, or nothing."""

import os
import time
from collections import namedtuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.app.timeline.pictures import proxy_file
from studio.app.timeline.pictures.proxy_file import (
    ABANDONED_S,
    SUFFIX,
    ProxyFile,
    ProxyWriter,
    is_whole,
    make_room,
    proxy_folder,
)

COUNT = 6


def picture(number):
    """A smooth picture, which JPEG keeps."""
    ramp = np.linspace(0, 200, 32)[None, :, None] + np.zeros((32, 1, 3))
    return (ramp + 5 * number).astype(np.uint8)


def written(path, *, is_finished=True):
    writer = ProxyWriter(path)
    for number in range(COUNT):
        writer.add(number, 10 * number, picture(number))
    if is_finished:
        writer.finish()
    else:
        writer.close()
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return written(tmp_path_factory.mktemp("proxies") / f"a{SUFFIX}")


def test_what_was_put_in_comes_out(whole):
    assert is_whole(whole)
    file = ProxyFile(whole)
    for number in (3, 0, 5):
        found = file.find(number, 10 * number)
        assert np.abs(found.astype(int) - picture(number)).max() <= 3
    assert file.find(COUNT, 10 * COUNT) is None
    assert not file.is_damaged
    file.close()


def test_pictures_are_found_while_the_file_grows(tmp_path):
    path = tmp_path / f"b{SUFFIX}"
    writer = ProxyWriter(path)
    file = ProxyFile(path)
    for number in range(3):
        assert file.find(number, number) is None
        writer.add(number, number, picture(number))
        assert file.find(number, number) is not None
    writer.close()
    assert not is_whole(path)


def test_a_picture_of_another_time_is_none(whole):
    file = ProxyFile(whole)
    assert file.find(2, 21) is None
    assert file.is_damaged


@given(st.integers(0, 10**6), st.integers(1, 255))
def test_a_changed_byte_gives_no_wrong_picture(whole, tmp_path_factory, place, change):
    data = bytearray(whole.read_bytes())
    data[place % len(data)] ^= change
    path = tmp_path_factory.mktemp("changed") / f"c{SUFFIX}"
    path.write_bytes(data)
    file, intact = ProxyFile(path), ProxyFile(whole)
    for number in range(COUNT):
        found = file.find(number, 10 * number)
        assert found is None or np.array_equal(found, intact.find(number, 10 * number))


@given(st.integers(0, 10**6))
def test_a_file_that_was_cut_off_is_not_whole_and_gives_what_is_there(
    whole, tmp_path_factory, size
):
    data = whole.read_bytes()
    path = tmp_path_factory.mktemp("cut") / f"d{SUFFIX}"
    path.write_bytes(data[: size % len(data)])
    assert not is_whole(path)
    file = ProxyFile(path)
    found = [file.find(number, 10 * number) is not None for number in range(COUNT)]
    assert found == sorted(found, reverse=True)
    assert not file.is_damaged


def test_the_oldest_go_first_and_the_one_being_written_stays(tmp_path):
    paths = [written(tmp_path / f"{number}{SUFFIX}") for number in range(4)]
    size = paths[0].stat().st_size
    for number, path in enumerate(paths):
        os.utime(path, (1000 + number, 1000 + number))
    other = tmp_path / "notes.txt"
    other.write_text("kept")
    make_room(tmp_path, keep=paths[0], most_bytes=2 * size)
    assert [path.exists() for path in paths] == [True, False, False, True]
    assert other.exists()


def test_what_nobody_finishes_is_removed(tmp_path):
    old, new = (written(tmp_path / f"{n}{SUFFIX}", is_finished=False) for n in ("old", "new"))
    past = time.time() - ABANDONED_S - 10
    os.utime(old, (past, past))
    make_room(tmp_path, keep=None)
    assert not old.exists()
    assert new.exists()


def test_a_disk_that_is_nearly_full_is_left_alone(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(proxy_file.shutil, "disk_usage", lambda _path: usage(10, 9, 1))
    writer = ProxyWriter(tmp_path / f"e{SUFFIX}")
    with pytest.raises(OSError, match="are free"):
        writer.add(0, 0, picture(0))


def test_the_variable_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    assert proxy_folder().parent == tmp_path
