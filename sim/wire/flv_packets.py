"""Encoded pictures as the video messages of RTMP: H.264 with lengths instead of start codes."""

from __future__ import annotations

import re

START = re.compile(rb"\x00\x00\x00?\x01")
"""The start code before each unit of Annex B, in both its lengths."""

SPS, PPS, DELIMITER = 7, 8, 9
"""NAL unit types of H.264 that are distinguished here (ITU-T H.264, table 7-1)."""


def nal_units(annex_b: bytes) -> list[bytes]:
    """The units of one access unit, without start codes."""
    return [unit.rstrip(b"\x00") for unit in START.split(annex_b) if unit]


def avc_header(annex_b: bytes) -> bytes:
    """The message that comes before the first picture, made from a keyframe's parameter sets.

    Raises:
        ValueError: the access unit has none.
    """
    units = nal_units(annex_b)
    sps = next((unit for unit in units if unit[0] & 31 == SPS), None)
    pps = next((unit for unit in units if unit[0] & 31 == PPS), None)
    if sps is None or pps is None:
        raise ValueError("H.264 keyframe without parameter sets: the encoder must repeat them")
    record = b"\x01" + sps[1:4] + b"\xff\xe1" + len(sps).to_bytes(2, "big") + sps
    return b"\x17\x00\x00\x00\x00" + record + b"\x01" + len(pps).to_bytes(2, "big") + pps


def avc_picture(annex_b: bytes, *, keyframe: bool) -> bytes:
    """The message of one picture."""
    parts = [b"\x17" if keyframe else b"\x27", b"\x01\x00\x00\x00"]
    for unit in nal_units(annex_b):
        if unit[0] & 31 not in (SPS, PPS, DELIMITER):
            parts += [len(unit).to_bytes(4, "big"), unit]
    return b"".join(parts)
