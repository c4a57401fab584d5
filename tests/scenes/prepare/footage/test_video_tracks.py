from contextlib import ExitStack

import numpy as np
import pytest

from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.footage.video_tracks import decoded_lenses, frame_count, open_video
from tests.insta360_file import write_insv
from tests.studio.live.test_filmed import RIG


def shots(levels, lenses=2):
    return [
        tuple(np.full((64, 64, 3), level + 60 * lens, np.uint8) for lens in range(lenses))
        for level in levels
    ]


def levels_of(path, lenses):
    with ExitStack() as stack:
        return [
            tuple(round(float(np.mean(f.to_ndarray(format="gray"))), -1) for f in frames)
            for _, _, frames in decoded_lenses(path, lenses, stack=stack)
        ]


def test_a_track_a_lens_a_file_a_lens_and_one_picture_for_all(tmp_path):
    both = write_insv(tmp_path / "VID_1.insv", shots([20, 60, 100]), RIG)
    assert levels_of(both, 2) == [(20, 80), (60, 120), (100, 160)]
    assert levels_of(both, 1) == [(20,), (60,), (100,)]
    front = write_insv(tmp_path / "VID_00_1.insv", shots([20, 60], 1), RIG)
    with pytest.raises(CaptureError, match=r"VID_10_1\.insv with the other one is missing"):
        levels_of(front, 2)
    write_insv(tmp_path / "VID_10_1.insv", shots([80, 120], 1), RIG)
    assert levels_of(front, 2) == [(20, 80), (60, 120)]


def test_a_video_says_how_long_it_is(tmp_path):
    with open_video(write_insv(tmp_path / "a.mp4", shots([20] * 7), RIG)) as opened:
        assert frame_count(*opened) == 7
    (tmp_path / "no.mp4").write_bytes(b"x" * 100)
    with (
        pytest.raises(CaptureError, match="no video that can be opened"),
        open_video(tmp_path / "no.mp4"),
    ):
        pass
