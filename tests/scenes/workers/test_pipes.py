"""A wide pipe takes a picture without a reader."""

from __future__ import annotations

import os
import sys

import pytest

from scenes.workers.pipes import PIPE_BYTES, widen


@pytest.mark.skipif(sys.platform != "linux", reason="pipes have one width elsewhere")
def test_a_whole_picture_goes_in_at_once():
    reading, writing = os.pipe()
    try:
        widen(writing)
        os.set_blocking(writing, False)
        written = os.write(writing, bytes(760 * 428 * 3 // 2))
        # Where a user has many wide pipes, the system gives no more.
        assert written in (760 * 428 * 3 // 2, 1 << 16)
        assert written <= PIPE_BYTES
    finally:
        os.close(reading)
        os.close(writing)


def test_what_is_no_pipe_stays_as_it_is(tmp_path):
    with (tmp_path / "file").open("wb") as file:
        widen(file.fileno())
        file.write(b"x")
