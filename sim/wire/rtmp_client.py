"""The publisher's side of RTMP on one socket: greeting, commands, messages with their times."""

from __future__ import annotations

import contextlib
import socket
from urllib.parse import urlsplit

from devices.camera.rtmp.amf import AmfError, AmfValue, decode_amf, encode_amf
from devices.camera.rtmp.chunks import (
    EXTENDED,
    HANDSHAKE_BYTES,
    ChunkReader,
    Message,
    RtmpError,
    encode_message,
)

RETRY_S = 0.5
"""Seconds between attempts to connect again."""

STALLED_S = 3.0
"""Seconds of no progress in sending after which the camera gives a connection up."""

CHUNK_BYTES = 4096
"""Chunk size that it announces, bytes: OBS's."""

GREETING_S = 1.5
"""Longest that connecting, or an answer of the server, may take: a dead way is found soon. A server
that holds another publisher for dead answers within a second."""

SEND_BYTES = 1 << 18
"""Bytes that wait in the socket, at most: 0.25 s at 8 Mbit/s. With the system's megabytes a camera
would send into a dead connection for many seconds before it noticed."""

MAX_READS = 200
"""Pieces in which an answer may come: servers send it in one to three. One that sends other
messages for ever, or a byte at a time, is none."""

COMMAND, VIDEO = 20, 9
"""Message type ids."""


class RtmpClient:
    """Connects and asks to publish; blocks for at most `timeout_s` at a time.

    Args:
        url: `rtmp://HOST:PORT/APPLICATION/KEY`.
        timeout_s: longest that a message may take to be sent.

    Raises:
        OSError: no connection, or none in time.
        RtmpError: the server refuses, with its reason, or speaks no RTMP.
    """

    def __init__(self, url: str, *, timeout_s: float = 3.0) -> None:
        parts = urlsplit(url)
        application, _, key = parts.path.strip("/").rpartition("/")
        self._chunks = ChunkReader()
        self._socket = socket.create_connection(
            (parts.hostname or "127.0.0.1", parts.port or 1935), GREETING_S
        )
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
            self._greet()
            self._publish(url, application, key)
            self._socket.settimeout(timeout_s)
        except BaseException:
            self._socket.close()
            raise

    def _greet(self) -> None:
        self._socket.sendall(b"\x03" + bytes(HANDSHAKE_BYTES))
        answer = self._exactly(1 + 2 * HANDSHAKE_BYTES)
        self._socket.sendall(answer[1 : 1 + HANDSHAKE_BYTES])

    def _publish(self, url: str, application: str, key: str) -> None:
        self._socket.sendall(encode_message(1, CHUNK_BYTES.to_bytes(4, "big"), chunk_bytes=128))
        target = url.rpartition("/")[0]
        fields: AmfValue = {"app": application, "type": "nonprivate", "tcUrl": target}
        self._command("connect", 1.0, fields)
        self._wait("_result")
        self._command("createStream", 2.0, None)
        self._wait("_result")
        self._command("publish", 3.0, None, key, "live")
        self._wait("onStatus")

    def _command(self, *values: AmfValue) -> None:
        data = encode_amf(*values)
        self._socket.sendall(encode_message(COMMAND, data, chunk_bytes=CHUNK_BYTES))

    def _wait(self, name: str) -> None:
        for _read in range(MAX_READS):
            for message in self._messages():
                if message.kind != COMMAND:
                    continue
                values = _values(message.data)
                if values and values[0] == name:
                    _check(values)
                    return
        raise RtmpError(f"RTMP: no {name} within {MAX_READS} answers of the server")

    def _messages(self) -> list[Message]:
        data = self._socket.recv(65536)
        if not data:
            raise RtmpError("RTMP: the server closed the connection")
        return self._chunks.take(data)

    def _exactly(self, count: int) -> bytes:
        data = b""
        for _read in range(MAX_READS):
            if len(data) == count:
                return data
            more = self._socket.recv(count - len(data))
            if not more:
                raise RtmpError("RTMP: the server closed the connection in the greeting")
            data += more
        raise RtmpError(f"RTMP: the server's greeting comes in more than {MAX_READS} pieces")

    def send_video(self, data: bytes, time_ms: int) -> None:
        """One video message.

        Raises:
            OSError: the connection broke, or nothing could be sent in time.
        """
        self.look()
        self._socket.sendall(_message(VIDEO, data, time_ms))

    def send_bytes(self, data: bytes) -> None:
        """Bytes that are no message, for tests of what receives them.

        Raises:
            OSError: as `send_video`.
        """
        self._socket.sendall(data)

    def look(self) -> None:
        """Take what the server sent meanwhile, such as acknowledgements; never waits.

        Raises:
            OSError: the server has closed the connection.
        """
        timeout_s = self._socket.gettimeout()
        self._socket.settimeout(0.0)
        try:
            if not self._socket.recv(65536):
                raise ConnectionResetError("the server closed the connection")
        except BlockingIOError:
            pass
        finally:
            self._socket.settimeout(timeout_s)

    def finish(self) -> None:
        """Say that the stream ends, and close."""
        with contextlib.suppress(OSError):
            self._command("deleteStream", 4.0, None, 1.0)
        self.close()

    def close(self) -> None:
        """Close without a word, as a camera that loses power does."""
        self._socket.close()


def _values(data: bytes) -> list[AmfValue]:
    try:
        return decode_amf(data)
    except AmfError as error:
        raise RtmpError(f"RTMP: the server's answer cannot be read ({error})") from None


def _check(values: list[AmfValue]) -> None:
    fields = values[3] if len(values) > 3 else None
    if isinstance(fields, dict) and fields.get("level") == "error":
        raise RtmpError(f"RTMP: refused, {fields.get('description')}")


def _message(kind: int, data: bytes, time_ms: int) -> bytes:
    """A message of message stream 1 on chunk stream 4, with its time."""
    time_ms &= 0xFFFFFFFF
    extended = time_ms.to_bytes(4, "big") if time_ms >= EXTENDED else b""
    parts = [
        b"\x04" + min(time_ms, EXTENDED).to_bytes(3, "big") + len(data).to_bytes(3, "big"),
        bytes([kind]) + (1).to_bytes(4, "little") + extended,
        data[:CHUNK_BYTES],
    ]
    for at in range(CHUNK_BYTES, len(data), CHUNK_BYTES):
        parts += [b"\xc4", extended, data[at : at + CHUNK_BYTES]]
    return b"".join(parts)
