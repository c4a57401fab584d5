"""RTMP's chunk stream: messages cut into chunks and put together again, every length checked.

Adobe, "RTMP specification 1.0", section 5.3. Pure: bytes in, messages out.
"""

from __future__ import annotations

from dataclasses import dataclass

HANDSHAKE_BYTES = 1536
"""Size of C1, C2, S1 and S2."""

DEFAULT_CHUNK_BYTES = 128
"""Chunk size until one side announces another."""

MAX_CHUNK_BYTES = 1 << 24
"""Largest chunk size that the specification allows: no message is longer."""

MAX_MESSAGE_BYTES = 8 << 20
"""Longest message that is received: a keyframe of 5760×2880 at 100 Mbit/s has about 2 MB."""

MAX_COMMAND_BYTES = 64 << 10
"""Longest message before a stream is published; the commands until then have under 1 kB."""

MAX_CHUNK_STREAMS = 16
"""Chunk streams of one connection that are kept; publishers use 3 to 6."""

EXTENDED = 0xFFFFFF
"""A time stamp of this value says that four bytes with the real one follow."""


class RtmpError(ValueError):
    """Bytes that are no RTMP; the connection is of no more use."""


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """One whole message.

    Attributes:
        kind: RTMP's message type id: 8 audio, 9 video, 20 command, …
        stream: message stream id.
        time_ms: time stamp, modulo 2³².
        data: its bytes.
    """

    kind: int
    stream: int
    time_ms: int
    data: bytes


@dataclass(slots=True)
class _ChunkStream:
    time_ms: int = 0
    delta_ms: int = 0
    size: int = 0
    kind: int = 0
    stream: int = 0
    is_extended: bool = False
    partial: bytearray | None = None


HEADER_BYTES = (11, 7, 3, 0)
"""Length of the message header by the chunk's format 0 to 3."""


class ChunkReader:
    """Puts chunks together; all partial messages of a connection are bounded in sum.

    Attributes:
        max_bytes: the longest message and, in sum, the partial ones that are held.
    """

    def __init__(self) -> None:
        self.max_bytes = MAX_COMMAND_BYTES
        self._held_bytes = 0
        self._buffer = bytearray()
        self._at = 0
        self._chunk_bytes = DEFAULT_CHUNK_BYTES
        self._streams: dict[int, _ChunkStream] = {}

    def take(self, data: bytes) -> list[Message]:
        """The messages that are whole now.

        Raises:
            RtmpError: the bytes are no chunks, or a message is too long.
        """
        self._buffer += data
        messages: list[Message] = []
        while True:
            used, message = self._chunk()
            if not used:
                break
            self._at += used
            if message is not None:
                self._control(message)
                messages.append(message)
        del self._buffer[: self._at]
        self._at = 0
        return messages

    def _control(self, message: Message) -> None:
        if message.kind == 1:
            size = int.from_bytes(message.data[:4], "big")
            if len(message.data) < 4 or not 1 <= size <= MAX_CHUNK_BYTES:
                raise RtmpError(f"RTMP: chunk size {size} bytes, wanted 1 to {MAX_CHUNK_BYTES}")
            self._chunk_bytes = size
        elif message.kind == 2:
            aborted = self._streams.get(int.from_bytes(message.data[:4], "big"))
            if aborted is not None:
                self._held_bytes -= len(aborted.partial or b"")
                aborted.partial = None

    def _chunk(self) -> tuple[int, Message | None]:
        """Bytes used (0: more are wanted) and the message that they complete."""
        buffer, at, end = self._buffer, self._at, len(self._buffer)
        if end - at < 1:
            return 0, None
        form, number = buffer[at] >> 6, buffer[at] & 0x3F
        at += 1
        if number < 2:
            extra = number + 1
            if end - at < extra:
                return 0, None
            number = 64 + int.from_bytes(buffer[at : at + extra], "little")
            at += extra
        stream = self._stream(number, form)
        header = HEADER_BYTES[form]
        if end - at < header:
            return 0, None
        fields = bytes(buffer[at : at + header])
        at += header
        time = int.from_bytes(fields[:3], "big") if header else 0
        is_extended = time == EXTENDED if header else stream.is_extended
        if is_extended:
            if end - at < 4:
                return 0, None
            time = int.from_bytes(buffer[at : at + 4], "big")
            at += 4
        size = int.from_bytes(fields[3:6], "big") if header >= 7 else stream.size
        if size > self.max_bytes:
            raise RtmpError(f"RTMP: a message of {size} bytes, wanted at most {self.max_bytes}")
        held = 0 if stream.partial is None else len(stream.partial)
        if held and header:
            raise RtmpError(f"RTMP: a new message on chunk stream {number} within another")
        payload = min(self._chunk_bytes, size - held)
        if end - at < payload:
            return 0, None
        if not held:
            _begin(stream, form, fields, time, is_extended)
        whole = self._add(stream, at, payload)
        return at + payload - self._at, whole

    def _stream(self, number: int, form: int) -> _ChunkStream:
        known = self._streams.get(number)
        if known is not None:
            return known
        # Some encoders begin with a header of form 1, which leaves out the message stream alone.
        if form > 1:
            raise RtmpError(f"RTMP: chunk stream {number} begins without a length")
        if len(self._streams) >= MAX_CHUNK_STREAMS:
            raise RtmpError(f"RTMP: more than {MAX_CHUNK_STREAMS} chunk streams")
        return self._streams.setdefault(number, _ChunkStream())

    def _add(self, stream: _ChunkStream, at: int, payload: int) -> Message | None:
        if stream.partial is None:
            stream.partial = bytearray()
        stream.partial += self._buffer[at : at + payload]
        self._held_bytes += payload
        if self._held_bytes > self.max_bytes:
            raise RtmpError(f"RTMP: partial messages of more than {self.max_bytes} bytes")
        if len(stream.partial) < stream.size:
            return None
        data = bytes(stream.partial)
        stream.partial = None
        self._held_bytes -= len(data)
        return Message(stream.kind, stream.stream, stream.time_ms, data)


def _begin(stream: _ChunkStream, form: int, fields: bytes, time: int, is_extended: bool) -> None:
    """A new message: what its header says, and what it leaves as it was."""
    stream.is_extended = is_extended
    if form == 0:
        stream.time_ms, stream.delta_ms = time, 0
        stream.stream = int.from_bytes(fields[7:11], "little")
    elif form < 3:
        stream.delta_ms = time
    if form:
        stream.time_ms = (stream.time_ms + stream.delta_ms) & 0xFFFFFFFF
    if form < 2:
        stream.size, stream.kind = int.from_bytes(fields[3:6], "big"), fields[6]


def encode_message(
    kind: int, data: bytes, *, channel: int = 3, stream: int = 0, chunk_bytes: int
) -> bytes:
    """One message as chunks, time stamp 0.

    Args:
        kind: message type id.
        data: its bytes.
        channel: chunk stream id, 2 to 63.
        stream: message stream id.
        chunk_bytes: the sender's chunk size.
    """
    header = (
        bytes([channel, 0, 0, 0])
        + len(data).to_bytes(3, "big")
        + bytes([kind])
        + stream.to_bytes(4, "little")
    )
    parts = [header, data[:chunk_bytes]]
    for at in range(chunk_bytes, len(data), chunk_bytes):
        parts += [bytes([0xC0 | channel]), data[at : at + chunk_bytes]]
    return b"".join(parts)
