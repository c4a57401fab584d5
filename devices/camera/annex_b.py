"""H.264 and HEVC as in MP4 and RTMP (lengths) to Annex B (start codes), with every length checked.

ISO/IEC 14496-15: section 5.3.3.1 (`avcC`) and 8.3.3.1 (`hvcC`).
"""

from __future__ import annotations

from dataclasses import dataclass

START_CODE = b"\x00\x00\x00\x01"


class BitstreamError(ValueError):
    """Bytes that are no such stream; says which length was wrong."""


@dataclass(frozen=True, slots=True)
class ParameterSets:
    """A decoder's configuration.

    Attributes:
        annex_b: parameter sets, each after a start code.
        length_bytes: size of the length before each unit of the stream, 1 to 4.
    """

    annex_b: bytes
    length_bytes: int


class _Reader:
    def __init__(self, data: bytes, name: str) -> None:
        self._data, self._at, self._name = data, 0, name

    def take(self, count: int) -> bytes:
        taken = self._data[self._at : self._at + count]
        if len(taken) != count:
            raise BitstreamError(
                f"{self._name}: {count} bytes wanted at {self._at}, {len(taken)} left"
            )
        self._at += count
        return taken

    def number(self, count: int) -> int:
        return int.from_bytes(self.take(count), "big")


def avc_parameter_sets(record: bytes) -> ParameterSets:
    """SPS and PPS of an `avcC` record.

    Raises:
        BitstreamError: it is none.
    """
    reader = _Reader(record, "avcC")
    if reader.number(1) != 1:
        raise BitstreamError(f"avcC: version {record[0]}, wanted 1")
    reader.take(3)
    length_bytes = (reader.number(1) & 3) + 1
    parts: list[bytes] = []
    for mask in (0x1F, 0xFF):
        for _ in range(reader.number(1) & mask):
            parts += [START_CODE, reader.take(reader.number(2))]
    if not parts:
        raise BitstreamError("avcC: no parameter sets in it")
    return ParameterSets(b"".join(parts), length_bytes)


def hevc_parameter_sets(record: bytes) -> ParameterSets:
    """VPS, SPS and PPS of an `hvcC` record.

    Raises:
        BitstreamError: it is none.
    """
    reader = _Reader(record, "hvcC")
    if reader.number(1) != 1:
        raise BitstreamError(f"hvcC: version {record[0]}, wanted 1")
    reader.take(20)
    length_bytes = (reader.number(1) & 3) + 1
    parts: list[bytes] = []
    for _ in range(reader.number(1)):
        reader.take(1)
        for _ in range(reader.number(2)):
            parts += [START_CODE, reader.take(reader.number(2))]
    if not parts:
        raise BitstreamError("hvcC: no parameter sets in it")
    return ParameterSets(b"".join(parts), length_bytes)


def with_start_codes(data: bytes, length_bytes: int) -> bytes:
    """Units with a length before each, as units with a start code before each.

    Raises:
        BitstreamError: a length leads beyond the end.
    """
    parts: list[bytes] = []
    at, end = 0, len(data)
    while at < end:
        start = at + length_bytes
        size = int.from_bytes(data[at:start], "big")
        at = start + size
        if start > end or at > end:
            raise BitstreamError(f"access unit: a part of {size} bytes leads beyond its {end}")
        parts += [START_CODE, data[start:at]]
    return b"".join(parts)
