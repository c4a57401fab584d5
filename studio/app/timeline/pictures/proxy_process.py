"""The process that makes a recording's reduced pictures, at the lowest priority.

It reads "h" (hold) and "g" (go on) on stdin and ends when that is closed. It prints `file PATH`
once it knows where the pictures are or will be, then `done` or `failed WHY`.
"""

from __future__ import annotations

import hashlib
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import mkstemp

import numpy as np
from numpy.typing import NDArray

from devices.messages import EncodedFrame
from devices.packet_runs import PacketRun, RunError
from devices.recording import RecordingReader
from scenes.workers.task import Task
from studio.app.timeline.pictures.proxy_file import SUFFIX, ProxyWriter, is_whole, make_room

STDIN = 0
"""Its descriptor."""

ROOM_EVERY = 100
"""Pictures between two looks at how much all files take: at most 40 MB."""


def main() -> None:
    """Make what the command line names: recording, its video's topic, folder, side, most bytes."""
    recording, topic, folder, side_px, most_bytes = sys.argv[1:]
    if hasattr(os, "nice"):
        os.nice(19)
    go, ended = threading.Event(), threading.Event()
    go.set()
    Task("orders", lambda _: _listen(go, ended)).start()

    def is_ended() -> bool:
        go.wait()
        return ended.is_set()

    def say(line: str) -> None:
        print(line, flush=True)

    try:
        make_proxies(
            Path(recording),
            topic,
            Path(folder),
            side_px=int(side_px),
            most_bytes=int(most_bytes),
            is_ended=is_ended,
            found=lambda path: say(f"file {path}"),
        )
    except (ValueError, OSError) as error:
        say(f"failed {' '.join(str(error).split())}")
    else:
        say("done")


def make_proxies(
    recording: Path,
    topic: str,
    folder: Path,
    *,
    side_px: int,
    most_bytes: int,
    is_ended: Callable[[], bool],
    found: Callable[[Path], None],
) -> None:
    """Write all reduced pictures of a recording, unless a whole file of them is there.

    Args:
        recording: an MCAP recording.
        topic: of its video.
        folder: of the files; made if there is none.
        side_px: of each picture, even.
        most_bytes: of all files; pictures that find no room are left out.
        is_ended: asked between packets, and waits while others need the processor; once it says
            yes, what was written is removed.
        found: is given the file before the first picture is in it.

    Raises:
        RecordingError, ValueError: the recording is damaged.
        OSError: a file cannot be read or written; nothing unfinished is left.
    """
    folder.mkdir(parents=True, exist_ok=True)
    key = f"{content_digest(recording, is_ended)}-{side_px}"
    for path in folder.glob(f"{key}.*{SUFFIX}"):
        if is_whole(path):
            os.utime(path)
            found(path)
            return
    make_room(folder, keep=None, most_bytes=most_bytes)
    handle, name = mkstemp(prefix=f"{key}.", suffix=SUFFIX, dir=folder)
    os.close(handle)
    writer = ProxyWriter(Path(name))
    found(writer.path)
    is_kept = False
    try:
        for count, (number, t_ns, picture) in enumerate(_pictures(recording, topic, side_px)):
            if is_ended():
                return
            if count % ROOM_EVERY == 0:
                make_room(folder, keep=writer.path, most_bytes=most_bytes)
            if writer.size_bytes + picture.nbytes > most_bytes:
                break
            writer.add(number, t_ns, picture)
        writer.finish()
        is_kept = True
    finally:
        writer.close()
        if not is_kept:
            with suppress(OSError):
                writer.path.unlink()


def content_digest(path: Path, is_ended: Callable[[], bool] = lambda: False) -> str:
    """Of a file's bytes, 24 hexadecimal digits: half a second for 640 MB."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while data := file.read(1 << 22):
            if is_ended():
                raise OSError(f"{path}: closed before it was read")
            digest.update(data)
    return digest.hexdigest()[:24]


def _pictures(
    recording: Path, topic: str, side_px: int
) -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
    """Number, time and reduced picture of every packet that has one.

    Packets from a damaged one to the next keyframe have none.
    """
    with RecordingReader(recording) as reader:
        run: PacketRun | None = None
        for number, encoded in enumerate(reader.messages(topics=(topic,))):
            packet = reader.decoded(encoded)
            assert isinstance(packet, EncodedFrame)
            if packet.keyframe and (run is None or packet.begins):
                run = PacketRun(reader.session, packet.codec, threads=1)
            if run is None:
                continue
            try:
                came = run.feed(packet, number)
            except RunError:
                run = None
                continue
            for picture in came:
                if picture.number == number:
                    yield number, packet.t_ns, run.reduced(picture, side_px)


def _listen(go: threading.Event, ended: threading.Event) -> None:
    # Not sys.stdin, whose lock a thread that still reads keeps from the interpreter's end.
    while (word := os.read(STDIN, 1)) in (b"h", b"g"):
        if word == b"h":
            go.clear()
        else:
            go.set()
    ended.set()
    go.set()


if __name__ == "__main__":
    main()
