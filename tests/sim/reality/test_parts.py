"""`sim.reality.parts`: a second reconstruction is taken apart once."""

import numpy as np
import pytest

from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.package.reality import Reality
from scenes.prepare.cutout.likewise import TakenApart
from scenes.splats import concatenate
from sim.reality import parts
from sim.reality.parts import parts_of


@pytest.fixture
def reality(scan, tmp_path):
    path = tmp_path / "second.ply"
    write_ply(path, concatenate([scan.room, scan.box]), comments=[WORLD_COMMENT])
    return Reality(path, "test", 10, 8, np.zeros((7, 7)))


def test_parts_are_made_once_and_read_afterwards(scan, reality, tmp_path, monkeypatch):
    asked = []

    def made(scene, cloud, *, renderer, progress):
        asked.append(len(cloud))
        return TakenApart(scan.room, {"box": scan.box}, {"lamp": "too small"})

    monkeypatch.setattr(parts, "taken_apart_like", made)
    first = parts_of(scan.scene, reality, None, folder=tmp_path / "kept")
    again = parts_of(scan.scene, reality, None, folder=tmp_path / "kept")
    assert asked == [len(scan.room) + len(scan.box)]
    assert again.missing == {"lamp": "too small"}
    assert np.array_equal(first.room.means, again.room.means)
    assert np.array_equal(again.objects["box"].means, scan.box.means)


def test_damaged_parts_are_made_again(scan, reality, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(
        parts, "taken_apart_like", lambda *a, **k: TakenApart(scan.room, {"box": scan.box}, {})
    )
    kept = tmp_path / "kept"
    parts_of(scan.scene, reality, None, folder=kept)
    (next(kept.iterdir()) / "room.ply").write_bytes(b"ply\n")
    found = parts_of(scan.scene, reality, None, folder=kept)
    assert len(found.room) == len(scan.room)
    assert "damaged" in caplog.text
