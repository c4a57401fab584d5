import errno
import json
import shutil
import threading
import zipfile
from collections import namedtuple

import pytest

from studio.console.progress import Progress
from studio.handover import share as room
from studio.handover.share import share
from studio.session.pipeline import CancelledError

pytestmark = pytest.mark.usefixtures("in_tiny_scene", "modules")


def contents(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))


def test_everything_is_made_and_nothing_else_is_left(rehearsed, tmp_path):
    lines = []
    before = contents(rehearsed)

    shared = share(
        rehearsed,
        tmp_path / "out",
        progress=Progress(lambda text, final: lines.append((text, final))),
    )

    assert contents(tmp_path) == [
        "out",
        "out/archive.zip",
        "out/pictures",
        *(f"out/pictures/{number}.jpg" for number in (1, 2, 3, 4)),
        "out/rehearsal.mp4",
        "out/session-sheet.html",
        "out/session-sheet.md",
        "out/viewer.html",
    ]
    assert contents(rehearsed) == before
    assert all(path.stat().st_size for path in shared.paths)
    assert (shared.splats, shared.of_splats) == (380, 380)
    assert shared.film.read_bytes() == (rehearsed / "rehearsal.mp4").read_bytes()
    assert [text.split(":")[0] for text, final in lines if final] == [
        "reading the recording",
        "opening the scene",
        "making the viewer",
        "writing film and session sheet",
        "packing the archive",
    ]
    with zipfile.ZipFile(shared.archive) as archive:
        names = set(archive.namelist())
        manifest = json.loads(archive.read("manifest.json"))
    assert {f"session/{name}" for name in before} <= names
    assert {"shared/viewer.html", "shared/session-sheet.md", "manifest.json"} <= names
    assert {entry["path"] for entry in manifest["files"]} == names - {"manifest.json", "SHA256SUMS"}


def test_the_page_holds_no_address_to_fetch_from(rehearsed, tmp_path):
    viewer = share(rehearsed, tmp_path / "out").viewer.read_text(encoding="utf-8")

    assert "connect-src 'none'" in viewer
    for fetching in ("src=", "href=", "@import", "url("):
        assert fetching not in viewer.split("<script")[0]
    assert "Copyright" in viewer
    assert "Permission is hereby granted" in viewer


def test_an_earlier_one_is_replaced(rehearsed, tmp_path):
    share(rehearsed, tmp_path / "out")
    (tmp_path / "out" / "session-sheet.md").write_text("old")

    share(rehearsed, tmp_path / "out")

    assert (tmp_path / "out" / "session-sheet.md").read_text().startswith("# tiny")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("stage", ["reading", "making", "packing"])
def test_a_cancelled_one_leaves_nothing(rehearsed, tmp_path, stage):
    cancelled = threading.Event()

    def show(text, _final):
        if text.startswith(stage):
            cancelled.set()

    with pytest.raises(CancelledError):
        share(rehearsed, tmp_path / "out", progress=Progress(show), cancelled=cancelled)

    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_while_writing_leaves_the_earlier_one(rehearsed, tmp_path, monkeypatch):
    share(rehearsed, tmp_path / "out")
    before = contents(tmp_path)

    def full(*_args, **_options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(room, "write_archive", full)
    with pytest.raises(OSError, match=r"nothing was left behind; free some space"):
        share(rehearsed, tmp_path / "out")

    assert contents(tmp_path) == before


def test_a_disk_without_room_is_refused_before_anything_is_made(rehearsed, tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: usage(10**9, 10**9, 30_000_000))

    with pytest.raises(OSError, match=r"about 8\d MB are needed there .* 30 MB are free"):
        share(rehearsed, tmp_path / "new" / "out")

    assert list(tmp_path.iterdir()) == []


def test_a_place_that_holds_something_else_is_refused(rehearsed, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")

    with pytest.raises(ValueError, match=r"holds 'file', which 'nexus share' did not write"):
        share(rehearsed, tmp_path)
    with pytest.raises(ValueError, match="is a file"):
        share(rehearsed, tmp_path / "file")
    for out in (rehearsed, rehearsed / "shared", rehearsed.parent):
        with pytest.raises(ValueError, match="rehearsal's own folder"):
            share(rehearsed, out)
    assert contents(tmp_path) == ["file", "thesis.txt"]


@pytest.mark.parametrize("name", ["recording.mcap", "report.json", "rehearsal.mp4"])
def test_a_folder_that_no_rehearsal_left_is_refused(rehearsed, tmp_path, name):
    shutil.copytree(rehearsed, tmp_path / "run")
    (tmp_path / "run" / name).unlink()

    with pytest.raises(ValueError, match=f"holds no {name}"):
        share(tmp_path / "run", tmp_path / "out")


def test_a_viewer_too_small_for_its_libraries_is_refused(rehearsed, tmp_path):
    with pytest.raises(ValueError, match=r"MB are needed before any splat.*--viewer-mb"):
        share(rehearsed, tmp_path / "out", viewer_bytes=1_000_000)

    assert list(tmp_path.iterdir()) == []


def test_a_scene_that_changed_since_is_said_on_the_sheet(rehearsed, tmp_path, tiny, monkeypatch):
    from dataclasses import replace

    other = replace(tiny.scene, objects=tiny.scene.objects[:1])
    monkeypatch.setattr(room, "recorded_scene", lambda _info: other)

    text = share(rehearsed, tmp_path / "out").sheet_markdown.read_text()

    assert "the scene has changed since" in text
