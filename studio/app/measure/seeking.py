"""How soon any instant of a five-minute recording is there."""

from __future__ import annotations

from pathlib import Path

from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.reading import read_index
from studio.bench.timeline import measure_seeks, write_recording
from studio.console.rows import Row


def seek_rows(folder: Path) -> list[Row]:
    """Write the recording into a folder, and go to instants of it at random."""
    path = folder / "long.mcap"
    write_recording(path)
    index = read_index(path)
    assert index is not None, "reading ends early only when it is cancelled"
    assert index.packets is not None, "the recording holds pictures"
    reader = PictureReader(path, index.packets)
    try:
        return measure_seeks(
            (index.start_ns, index.end_ns),
            state_at=index.state_at,
            picture_at=lambda t_ns, early: reader.picture_at(t_ns, early=early),
        )
    finally:
        reader.close()
