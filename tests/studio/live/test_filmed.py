"""Footage that carries its camera's calibration; the search for its place is stubbed."""

from types import SimpleNamespace

import numpy as np
import pytest

from devices.footage import FootageError
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from studio.live import placing
from studio.live.filmed import camera_of_footage, carried_rig
from tests.insta360_file import write_insv

LENS = Fisheye.from_fov(160, np.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
HERE = Pose(np.eye(3), np.array([1.0, 2.0, 1.3]))


def shots(count=4, size=160):
    return [(np.full((size, size, 3), 90, np.uint8),) * 2 for _ in range(count)]


@pytest.fixture
def found(monkeypatch):
    """Finds the camera at `HERE` and fits what it was given; keeps the frames."""
    kept = SimpleNamespace(frames=(), refusal="", lenses="")

    def calibrate(frames, where, room, renderer, *, objects):
        kept.frames = frames
        return SimpleNamespace(
            rig=frames[0].rig,
            world_from_rig=where,
            trusted=not kept.lenses,
            refusal=kept.lenses,
            described=lambda: "lenses found",
        )

    monkeypatch.setattr(placing, "calibrate_lenses", calibrate)
    kept.locate = lambda frame, near: SimpleNamespace(
        world_from_rig=HERE, refusal=kept.refusal, described=lambda: "camera located"
    )
    return kept


def look(video, tiny, found, said=None):
    return camera_of_footage(
        video,
        tiny.scene,
        renderer=None,
        locate=found.locate,
        instead="--camera FILE",
        say=([] if said is None else said).append,
    )


def test_lenses_are_the_file_s_and_the_place_the_room_s(tmp_path, tiny, found):
    video = write_insv(tmp_path / "VID_00_001.insv", shots(), RIG)
    said = []
    camera = look(video, tiny, found, said)
    assert camera.world_from_rig is HERE
    assert camera.rig.lenses[0].f_px == pytest.approx(LENS.f_px, rel=0.02)
    assert len(found.frames) == 3
    assert said == [
        "lenses: as Insta360 X4 itself has calibrated them, of VID_00_001.insv, 160 px each",
        "camera: camera located; lenses found",
    ]


def test_a_camera_that_is_not_found_says_what_to_give(tmp_path, tiny, found):
    video = write_insv(tmp_path / "VID_00_001.insv", shots(), RIG)
    found.refusal = "too dark"
    with pytest.raises(FootageError, match=r"not found in .*too dark.*or give --camera FILE"):
        look(video, tiny, found)
    found.refusal, found.lenses = "", "3 windows"
    with pytest.raises(FootageError, match=r"do not fit the room: 3 windows.*or give --camera"):
        look(video, tiny, found)


def test_files_that_carry_nothing_or_something_else_are_refused(tmp_path):
    def refused(video, says):
        with pytest.raises(FootageError, match=says):
            carried_rig(video, instead="--camera FILE", say=lambda _: None)

    refused(tmp_path / "none.insv", "no such video or folder")
    refused(tmp_path, "does not say what its camera is: give --camera FILE")
    video = write_insv(tmp_path / "a.insv", shots(), RIG)
    video.write_bytes(video.read_bytes()[:-400])
    refused(video, "give --camera FILE")
    wide = [(np.zeros((160, 176, 3), np.uint8),) * 2]
    refused(write_insv(tmp_path / "b.insv", wide, RIG), "wanted 2 square lens pictures")
    other = Rig((LENS,), (Pose.identity(),))
    refused(write_insv(tmp_path / "c.insv", shots(), other), "c.insv: .*wanted version 3 of 2")
