"""A session on disk: one MCAP file with zstd chunks, whole or clearly not whole.

While it is written the file is called `NAME.part`; it gets its name when it is complete.
"""

from __future__ import annotations

import errno
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO

from mcap.reader import SeekingReader
from mcap.records import Schema
from mcap.writer import CompressionType, Writer

from devices.messages import EncodedFrame, Event
from devices.recorded.index import DAMAGE, RecordingError, damaged, open_reader
from devices.recorded.schemas import json_schema
from devices.recording_codec import (
    Encoded,
    RecordedValue,
    decode_message,
    encode_message,
    stream_of,
)
from devices.session_info import SessionInfo, session_from_json, session_to_json
from devices.streams import ByteQuota

SESSION_METADATA = "gaussiannexus.session"
CLOSING_METADATA = "gaussiannexus.closing"
DEFAULT_QUOTA_BYTES = 8 * 1024**3
"""Messages of a recording at most, unless another quota is given."""
VIDEO_RESERVE_SHARE = 0.1
"""Share of the quota kept free of video, so that poses fit to the end."""


class Recorder:
    """Writes a session. Use as a context manager: leaving it normally completes the file.

    When the quota runs short, video stops first, so that poses fit to the end; the file says so in
    an event and in its closing metadata.

    Args:
        path: final name; `path` + ".part" is written until then.
        session: what was recorded, written first.
        quota: most bytes of messages.

    Raises:
        OSError: the file cannot be made or written; names it.
    """

    def __init__(self, path: Path, session: SessionInfo, *, quota: ByteQuota | None = None) -> None:
        self.path = path
        self.part = path.with_name(path.name + ".part")
        self._quota = quota or ByteQuota(DEFAULT_QUOTA_BYTES)
        self._reserve = int(VIDEO_RESERVE_SHARE * self._quota.limit_bytes)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._shed_video = 0
        self._shed_other = 0
        self._file: IO[bytes] = self.part.open("wb")
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        with _NamedDiskErrors(self.part):
            self._writer.start(profile="", library="gaussiannexus-studio")
            self._writer.add_metadata(SESSION_METADATA, {"json": session_to_json(session)})

    @property
    def shed_video(self) -> int:
        """Video packets left out for lack of room."""
        return self._shed_video

    def write(self, value: RecordedValue) -> None:
        """Append one message.

        Raises:
            OSError: the disk is full or gone; the unfinished file keeps its `.part` name.
            ValueError: a number in the message is not finite.
        """
        encoded = encode_message(value)
        if isinstance(value, EncodedFrame):
            # A packet needs the ones before it: after the first gap the rest is of no use.
            fits = not self._shed_video and self._quota.spend(
                len(encoded.data), reserve_bytes=self._reserve
            )
            if not fits:
                self._shed_video += 1
                if self._shed_video == 1:
                    limit_mb = self._quota.limit_bytes / 1e6
                    text = f"video stops at frame {value.seq}: quota of {limit_mb:.0f} MB is used"
                    self.write(Event(value.t_ns, "recorder", "video-shed", text))
                return
        elif not self._quota.spend(len(encoded.data)):
            self._shed_other += 1
            return
        self._append(encoded)

    def _append(self, encoded: Encoded) -> None:
        with _NamedDiskErrors(self.part):
            self._writer.add_message(
                channel_id=self._channel(encoded.topic, encoded.schema),
                log_time=encoded.t_ns,
                publish_time=encoded.t_ns,
                sequence=encoded.seq,
                data=encoded.data,
            )

    def _channel(self, topic: str, schema: str) -> int:
        if topic not in self._channels:
            if schema not in self._schemas:
                self._schemas[schema] = self._writer.register_schema(
                    name=schema, encoding="jsonschema", data=json_schema(schema)
                )
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding="json", schema_id=self._schemas[schema]
            )
        return self._channels[topic]

    def close(self) -> None:
        """Complete the file and give it its name.

        Raises:
            OSError: the disk is full; the file keeps its `.part` name.
        """
        closing = {"video_shed": str(self._shed_video), "other_shed": str(self._shed_other)}
        with _NamedDiskErrors(self.part):
            self._writer.add_metadata(CLOSING_METADATA, closing)
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            self.part.replace(self.path)

    def abandon(self) -> None:
        """Stop without completing: what was written stays in the `.part` file."""
        with suppress(OSError):
            self._file.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is not None:
            self.abandon()
            return
        try:
            self.close()
        except BaseException:
            self.abandon()
            raise


class _NamedDiskErrors:
    """Puts the unfinished file's name, and what became of it, into errors of the disk."""

    def __init__(self, part: Path) -> None:
        self._part = part

    def __enter__(self) -> None:
        return None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if isinstance(error, OSError):
            why = "the disk is full" if error.errno == errno.ENOSPC else (error.strerror or "?")
            raise OSError(
                error.errno,
                f"recording stopped: {why}; what was written so far is in {self._part}",
            ) from None


def read_session(path: Path) -> SessionInfo:
    """How a recording was made.

    Raises:
        RecordingError: the file is damaged or no recording of ours.
        OSError: it cannot be opened.
    """
    with path.open("rb") as file:
        return _session_of(open_reader(path, file), path)


def read_recording(path: Path) -> Iterator[RecordedValue]:
    """All messages in the order of `(t_ns, topic, seq)`, a chunk at a time.

    Raises:
        RecordingError: the file is damaged or not a recording of ours; one that was cut off is
            read to its last whole chunk.
        OSError: it cannot be opened.
    """
    with path.open("rb") as file:
        reader = open_reader(path, file)
        _session_of(reader, path)
        same_time: list[Encoded] = []
        for encoded in _messages(reader, path):
            if same_time and encoded.t_ns != same_time[0].t_ns:
                yield from _decode(same_time, path)
                same_time = []
            same_time.append(encoded)
        yield from _decode(same_time, path)


class RecordingReader:
    """A recording that is read from any instant on. Use as a context manager.

    Args:
        path: an MCAP recording.

    Raises:
        RecordingError: the file is damaged or no recording of ours.
        OSError: it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("rb")
        try:
            self._reader = open_reader(path, self._file)
            self.session = _session_of(self._reader, path)
            self.span_ns = self._read_span()
        except BaseException:
            self._file.close()
            raise

    def _read_span(self) -> tuple[int, int] | None:
        """Times of the first and the last message; None if there is none."""
        try:
            summary = self._reader.get_summary()
        except DAMAGE as error:
            raise damaged(self.path, error) from None
        statistics = None if summary is None else summary.statistics
        if statistics is None or not statistics.message_count:
            return None
        return statistics.message_start_time, statistics.message_end_time

    def messages(
        self,
        *,
        topics: Sequence[str] | None = None,
        from_ns: int | None = None,
        before_ns: int | None = None,
    ) -> Iterator[Encoded]:
        """Messages in the order of `(t_ns, topic, seq)`, not decoded, a chunk at a time.

        Args:
            topics: only theirs; None for all.
            from_ns: first time.
            before_ns: the time after the last.

        Raises:
            RecordingError: the file is damaged.
        """
        same_time: list[Encoded] = []
        found = _messages(self._reader, self.path, topics, from_ns, before_ns)
        for encoded in found:
            if same_time and encoded.t_ns != same_time[0].t_ns:
                yield from sorted(same_time, key=_place)
                same_time = []
            same_time.append(encoded)
        yield from sorted(same_time, key=_place)

    def decoded(self, encoded: Encoded) -> RecordedValue:
        """Decode a message.

        Raises:
            RecordingError: it is damaged.
        """
        return next(_decode([encoded], self.path))

    def __enter__(self) -> RecordingReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _place(encoded: Encoded) -> tuple[int, str, int]:
    """Place of a message among those of a recording: a frame's stamp before all its packets."""
    topic = encoded.topic
    if topic.endswith("/video"):
        camera, _, track = stream_of(topic).partition("/")
        topic = f"/{camera}/video/{track}"
    return encoded.t_ns, topic, encoded.seq


def _session_of(reader: SeekingReader, path: Path) -> SessionInfo:
    try:
        for metadata in reader.iter_metadata():
            if metadata.name == SESSION_METADATA:
                return session_from_json(metadata.metadata["json"])
    except DAMAGE as error:
        raise damaged(path, error) from None
    raise RecordingError(f"{path}: an MCAP file, but not a GaussianNexus recording")


def _messages(
    reader: SeekingReader,
    path: Path,
    topics: Sequence[str] | None = None,
    from_ns: int | None = None,
    before_ns: int | None = None,
) -> Iterator[Encoded]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for schema, channel, message in reader.iter_messages(
                topics, starting_at=from_ns, ending_before=before_ns
            ):
                yield Encoded(
                    channel.topic,
                    schema.name if isinstance(schema, Schema) else "",
                    message.log_time,
                    message.sequence,
                    message.data,
                )
    except DAMAGE as error:
        raise damaged(path, error) from None


def _decode(messages: list[Encoded], path: Path) -> Iterator[RecordedValue]:
    for encoded in sorted(messages, key=_place):
        try:
            value = decode_message(encoded)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise damaged(path, error) from None
        yield value
