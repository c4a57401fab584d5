import hashlib
import json
import shutil
import subprocess
import threading
import zipfile

import pytest

from studio.handover.archive import write_archive
from studio.session.pipeline import CancelledError


@pytest.fixture
def files(tmp_path):
    (tmp_path / "in").mkdir()
    found = {}
    for name, data in (("a.json", b"{}" * 500_000), ("film.mp4", bytes(range(256)) * 9000)):
        (tmp_path / "in" / name).write_bytes(data)
        found[f"session/{name}"] = tmp_path / "in" / name
    return found


def test_every_file_is_in_it_with_its_size_and_digest(files, tmp_path):
    reached = []
    write_archive(
        tmp_path / "a.zip",
        files,
        cancelled=threading.Event(),
        reached=lambda share, name: reached.append((share, name)),
    )

    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert archive.testzip() is None
        assert set(archive.namelist()) == {*files, "manifest.json", "SHA256SUMS"}
        manifest = json.loads(archive.read("manifest.json"))
        for entry in manifest["files"]:
            data = archive.read(entry["path"])
            assert data == files[entry["path"]].read_bytes()
            assert len(data) == entry["bytes"]
            assert hashlib.sha256(data).hexdigest() == entry["sha256"]
        assert archive.getinfo("session/a.json").compress_size < 10_000
        stored = archive.getinfo("session/film.mp4")
        assert stored.compress_type == zipfile.ZIP_STORED
        archive.extractall(tmp_path / "out")
    assert len(manifest["files"]) == len(files)
    assert reached[-1] == (1.0, "session/film.mp4")
    program = shutil.which("sha256sum")
    if program is not None:
        subprocess.run([program, "-c", "SHA256SUMS"], cwd=tmp_path / "out", check=True, timeout=60)


def test_a_cancelled_one_stops(files, tmp_path):
    cancelled = threading.Event()

    with pytest.raises(CancelledError):
        write_archive(
            tmp_path / "a.zip",
            files,
            cancelled=cancelled,
            reached=lambda _share, _name: cancelled.set(),
        )
