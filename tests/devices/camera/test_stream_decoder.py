"""Tracks of a camera become pictures together, and a new connection starts its decoder anew."""

from __future__ import annotations

import numpy as np

from devices.camera.stream_decoder import StreamDecoder
from devices.camera.units import StreamFormat, Unit
from devices.video import H264Encoder


def units(track: int, count: int) -> list[Unit]:
    encoder, form = H264Encoder(64, 64, 30.0, 200_000), StreamFormat("h264")
    out: list[Unit] = []
    for k in range(count):
        packet = encoder.encode(np.full((64, 64, 3), 40 * k, np.uint8), k, k + 1)[0]
        out.append(Unit(form, packet.data, packet.keyframe, None, track))
    return out


def test_a_picture_is_complete_once_every_track_has_one():
    decoder = StreamDecoder(2)
    first, second = units(0, 2), units(1, 2)
    assert decoder.decode(first[0], 0) is None
    found = decoder.decode(second[0], 1)
    assert found is not None
    assert (found.number, len(found.pictures)) == (1, 2)
    assert decoder.decode(second[1], 2) is None
    assert decoder.decode(first[1], 3) is not None


def test_the_first_unit_of_a_connection_begins_it():
    decoder = StreamDecoder(1)
    first, again = units(0, 2), units(0, 2)
    assert decoder.begins(first[0])
    decoder.decode(first[0], 0)
    assert not decoder.begins(first[1])
    assert decoder.begins(again[0])
    # In the middle of another stream nothing can be decoded before its keyframe.
    assert decoder.decode(again[1], 1) is None
    assert decoder.decode(again[0], 2) is not None


def test_damaged_units_are_counted():
    decoder = StreamDecoder(1)
    (unit,) = units(0, 1)
    decoder.decode(unit, 0)
    decoder.decode(Unit(unit.format, b"\x00\x00\x00\x01\x65" + b"\xff" * 40, True, None), 1)
    assert decoder.damaged == 1
