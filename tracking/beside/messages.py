"""Numbered Python values between a session and its search process, pictures without a copy.

A message is a number, the sizes of its parts, and the parts: a pickle and the arrays outside of it
(protocol 5). Both ends are this program on this machine; nothing from elsewhere is ever unpickled.
"""

from __future__ import annotations

import pickle
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from io import BufferedIOBase


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a search.

    Attributes:
        result: its result.
        failure: what it raised instead, as text.
    """

    result: object
    failure: str = ""


HEAD = struct.Struct("<qI")
"""Number of a message, and how many parts it has."""

SIZE = struct.Struct("<Q")
"""Bytes of a part."""

Part = bytes | bytearray | memoryview
"""The pickle, or the memory of an array."""


def encoded(value: object) -> list[Part]:
    """A value in parts, most of them views of its arrays, which must not change any more."""
    arrays: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=arrays.append)
    return [head, *(array.raw() for array in arrays)]


def write_message(stream: BufferedIOBase, number: int, parts: Sequence[Part]) -> None:
    """Write a message.

    Raises:
        OSError: the other end is gone.
    """
    sizes = [memoryview(part).nbytes for part in parts]
    stream.write(HEAD.pack(number, len(parts)) + b"".join(map(SIZE.pack, sizes)))
    for part in parts:
        stream.write(part)
    stream.flush()


def read_message(stream: BufferedIOBase) -> tuple[int, list[Part]] | None:
    """The next message's number and parts; None if the other end is gone."""
    head = _read(stream, HEAD.size)
    if head is None:
        return None
    number, count = HEAD.unpack(head)
    sizes = _read(stream, count * SIZE.size)
    if sizes is None:
        return None
    parts: list[Part] = []
    for (size,) in SIZE.iter_unpack(sizes):
        part = _read(stream, size)
        if part is None:
            return None
        parts.append(part)
    return number, parts


def decoded(parts: Sequence[Part]) -> object:
    """Inverse of `encoded`; its arrays lie in the parts.

    Raises:
        Exception: what the value's own code raises.
    """
    return pickle.loads(parts[0], buffers=parts[1:])


def _read(stream: BufferedIOBase, size: int) -> bytearray | None:
    """So many bytes; None if the stream ends before."""
    content = bytearray(size)
    view, have = memoryview(content), 0
    while have < size:
        count = stream.readinto(view[have:])
        if not count:
            return None
        have += count
    return content
