"""Decoding beside reading: late, it leaves out what is old; its errors reach whoever reads."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from devices.camera.decoding import Arrived, Decoding
from devices.camera.received import Received
from devices.camera.units import SourceError, StreamFormat, Unit
from devices.clock import ManualClock
from devices.video import H264Encoder

LIMIT_S = 10.0


def units(count: int, *, keyframe_interval: int) -> list[Unit]:
    """Pictures that get lighter by 8 each."""
    encoder = H264Encoder(64, 64, 30.0, 200_000, keyframe_interval=keyframe_interval)
    form, out = StreamFormat("h264"), []
    for k in range(count):
        (packet,) = encoder.encode(np.full((64, 64, 3), 8 * k, np.uint8), k, k + 1)
        out.append(Unit(form, packet.data, packet.keyframe, 1000 * k))
    return out


def decoding(hand_out, tracks: int = 1) -> Decoding:
    return Decoding(tracks, clock=ManualClock(), name="decode test", hand_out=hand_out)


def test_every_picture_is_handed_out_with_its_own_times():
    seen: list[Received] = []
    made = decoding(seen.append)
    for number, unit in enumerate(units(6, keyframe_interval=30)):
        made.put(Arrived(unit, number, 10 * number))
    made.finish(threading.Event())
    made.close()
    assert [(r.seq, r.t_ns, r.pts_ns) for r in seen] == [(k, 10 * k, 1000 * k) for k in range(6)]
    assert made.skipped == 0


def test_a_late_decoder_goes_on_with_the_newest_keyframe():
    """It is stopped at the first picture; then 8 are there, with keyframes at 4 and 8."""
    seen: list[Received] = []
    reached, go_on = threading.Event(), threading.Event()

    def hand_out(received: Received) -> None:
        seen.append(received)
        reached.set()
        assert go_on.wait(LIMIT_S)

    made = decoding(hand_out)
    for number, unit in enumerate(units(10, keyframe_interval=4)):
        made.put(Arrived(unit, number, number))
        assert number or reached.wait(LIMIT_S)
    go_on.set()
    made.finish(threading.Event())
    made.close()
    assert [received.seq for received in seen] == [0, 8, 9]
    assert made.skipped == 7
    lightness = [float(np.median(received.pictures[0].y)) for received in seen]
    assert lightness == sorted(lightness)
    assert lightness[1] - lightness[0] == pytest.approx(8 * 8 * 219 / 255, abs=4)


def test_a_stop_ends_it_before_all_is_decoded():
    go_on, stop = threading.Event(), threading.Event()
    seen: list[Received] = []

    def hand_out(received: Received) -> None:
        seen.append(received)
        stop.set()
        assert go_on.wait(LIMIT_S)

    made = decoding(hand_out)
    for number, unit in enumerate(units(6, keyframe_interval=30)):
        made.put(Arrived(unit, number, number))
    made.finish(stop)
    threading.Timer(0.1, go_on.set).start()
    made.close()
    assert len(seen) == 1


def test_pictures_that_cannot_be_decoded_are_an_error_for_the_reader():
    made = decoding(lambda _: None)
    made.put(Arrived(Unit(StreamFormat("vp6f"), b"x", True, None), 0, 0))
    made._task.join(LIMIT_S)
    with pytest.raises(SourceError, match=r"set the camera to H\.264"):
        made.check()
    assert "vp6f" in str(made.finish(threading.Event()))
    made.close()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_defect_of_whoever_takes_pictures_reaches_the_reader():
    def hand_out(_: Received) -> None:
        raise KeyError("a defect")

    made = decoding(hand_out)
    made.put(Arrived(units(1, keyframe_interval=30)[0], 0, 0))
    made._task.join(LIMIT_S)
    with pytest.raises(RuntimeError, match="decode test: died"):
        made.put(Arrived(units(1, keyframe_interval=30)[0], 1, 0))
