import os
import subprocess
import sys

import pytest

from scenes.formats.storage.atomic import (
    WriteError,
    name_when_whole,
    write_file,
    write_folder,
    write_whole,
)


def failing_blocks():
    yield b"half"
    raise OSError(28, "No space left on device")


def test_a_file_is_written_and_replaced_whole(tmp_path):
    path = tmp_path / "a.bin"
    assert write_file(path, [b"ab", b"", memoryview(b"c")]) == 3
    assert write_file(path, [b"new"]) == 3
    assert path.read_bytes() == b"new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises(WriteError, match=r"a\.bin.*No space left.*nothing was left.*free some"):
        write_file(path, failing_blocks())
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_any_other_failure_leaves_nothing_either(tmp_path):
    def blocks():
        yield b"half"
        raise RuntimeError("bug")

    with pytest.raises(RuntimeError, match="bug"):
        write_file(tmp_path / "a.bin", blocks())
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(WriteError, match=r"make the folder .*gone first"):
        write_file(tmp_path / "gone" / "a.bin", [b"x"])
    (tmp_path / "file").write_bytes(b"x")
    with pytest.raises(WriteError, match="is a file, choose a folder"):
        write_file(tmp_path / "file" / "a.bin", [b"x"])


FULL = """
import resource, sys
from pathlib import Path
import numpy as np
from scenes.formats.registry import write_splats
from scenes.splats import SplatCloud
n = 20_000
one = np.ones((n, 1), np.float32)
cloud = SplatCloud(one.repeat(3, 1), one.repeat(3, 1), one.repeat(4, 1) / 2, one[:, 0],
                   np.zeros((n, 1, 3), np.float32))
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    write_splats(Path(sys.argv[1]), cloud)
except OSError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are a POSIX feature")
@pytest.mark.parametrize("name", ["a.ply", "a.splat"])
def test_a_write_that_the_system_cuts_short_leaves_nothing(tmp_path, name):
    target = tmp_path / name
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(target)], capture_output=True, text=True, check=True
    )
    assert str(target) in done.stdout
    assert "nothing was left behind" in done.stdout
    assert done.stdout.count("\n") == 1
    assert not list(tmp_path.iterdir())


def fill_with(text):
    def fill(folder):
        (folder / "inner").mkdir()
        (folder / "inner" / "a.txt").write_text(text)

    return fill


def test_a_folder_is_made_with_its_parents_and_replaced(tmp_path):
    folder = tmp_path / "deep" / "room"
    write_folder(folder, fill_with("one"), replace=True)
    write_folder(folder, fill_with("two"), replace=True)
    assert (folder / "inner" / "a.txt").read_text() == "two"
    assert [p.name for p in folder.parent.iterdir()] == ["room"]


def test_a_failed_fill_leaves_the_old_folder_and_names_the_final_place(tmp_path):
    folder = tmp_path / "room"
    write_folder(folder, fill_with("one"), replace=True)

    def fill(part):
        write_file(part / "b.bin", failing_blocks())

    with pytest.raises(WriteError) as caught:
        write_folder(folder, fill, replace=True)
    assert str(folder / "b.bin") in str(caught.value)
    assert ".part" not in str(caught.value)
    assert (folder / "inner" / "a.txt").read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["room"]


def test_the_first_of_two_processes_wins_when_nothing_may_be_replaced(tmp_path):
    folder = tmp_path / "room"

    def overtaken(part):
        fill_with("slow")(part)
        write_folder(folder, fill_with("fast"), replace=False)

    write_folder(folder, overtaken, replace=False)
    assert (folder / "inner" / "a.txt").read_text() == "fast"
    assert [p.name for p in tmp_path.iterdir()] == ["room"]


def test_a_file_is_written_with_its_folders_and_replaced(tmp_path):
    path = tmp_path / "a" / "b.txt"
    for text in ("first, µ", "second"):
        assert write_whole(path, text, makes_folder=True) == len(text.encode())
        assert path.read_text(encoding="utf-8") == text
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_is_the_system_s_own_error(tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(28, "No space left on device")

    path = tmp_path / "b.txt"
    write_whole(path, "first")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, "second")
    assert path.read_text(encoding="utf-8") == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_the_name_of_a_sibling_tells_whose_it_is():
    assert name_when_whole(".sweep.json.0123abcd.part") == "sweep.json"
    assert name_when_whole("sweep.json") == "sweep.json"
    assert name_when_whole(".hidden.part") == ".hidden.part"


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_a_private_file_is_for_the_user_alone_from_its_first_byte(tmp_path):
    path = tmp_path / "key"
    modes = []

    def blocks():
        yield b"se"
        modes.extend(file.stat().st_mode & 0o777 for file in tmp_path.iterdir())
        yield b"cret"

    assert write_whole(path, blocks(), is_private=True) == 6
    assert modes == [0o600]
    assert path.stat().st_mode & 0o777 == 0o600
    write_whole(path, "open")
    assert path.stat().st_mode & 0o044 == 0o044 & ~umask()


def umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask
