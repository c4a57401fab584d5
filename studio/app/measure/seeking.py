"""How soon any instant of a five-minute recording is there."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from studio.app.timeline.pictures.proxies import Proxies
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.index import RecordingIndex
from studio.app.timeline.recorded.reading import read_index
from studio.bench.timeline import SeekTimes, Seen, measure_seeks, seek_rows_of, write_recording
from studio.console.rows import Row

LIMIT_S = 900.0
"""After so long something hangs."""


def seek_rows(folder: Path) -> list[Row]:
    """Write the recording into a folder, and go to instants of it at random.

    First as right after opening; then once all reduced pictures are there, which is timed with
    nothing else to do.
    """
    path = folder / "long.mcap"
    write_recording(path)
    index = read_index(path)
    assert index is not None, "reading ends early only when it is cancelled"
    assert index.packets is not None, "the recording holds pictures"
    before = _seeks(index, None)
    proxies = Proxies(path, index.packets.topics[0], folder / "pictures", begin_after_s=0.0)
    try:
        taken_s, size_mb = _made(proxies)
        after = _seeks(index, proxies)
    finally:
        proxies.stop()
    return [
        Row("studio.seek.proxies_s", taken_s, "s"),
        Row("studio.seek.proxies_mb", size_mb, "MB"),
        *seek_rows_of(before, after),
    ]


def pictures_at(thread: PictureThread, t_ns: int) -> Iterator[Seen]:
    """Ask for the picture at a time; what comes, until the full one.

    Raises:
        TimeoutError: it does not come.
    """
    thread.ask(t_ns)
    while True:
        picture = thread.pictures.take(timeout_s=30.0)
        if picture is None:
            raise TimeoutError(f"no picture at {t_ns / 1e9:.2f} s within 30 s")
        if picture.asked_ns == t_ns:
            yield Seen(picture.is_exact, picture.is_full)
            if picture.is_exact and picture.is_full:
                return


def _seeks(index: RecordingIndex, proxies: Proxies | None) -> SeekTimes:
    thread = PictureThread(index, proxies=proxies)
    try:
        return measure_seeks(
            (index.start_ns, index.end_ns),
            state_at=index.state_at,
            pictures_at=lambda t_ns: pictures_at(thread, t_ns),
        )
    finally:
        thread.stop()


def _made(proxies: Proxies) -> tuple[float, float]:
    """Seconds until all reduced pictures were there, and their MB."""
    begin = time.monotonic()
    while not proxies.is_done:
        if time.monotonic() - begin > LIMIT_S:
            raise TimeoutError(f"the reduced pictures are not there in {LIMIT_S:.0f} s")
        time.sleep(0.1)
    if proxies.problem or proxies.path is None:
        raise ValueError(f"no reduced pictures: {proxies.problem}")
    return time.monotonic() - begin, proxies.path.stat().st_size / 1e6
