"""A short synthetic recording is whole, and every seek is counted."""

from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.reading import read_index
from studio.bench.timeline import OBJECTS, measure_seeks, write_recording


def test_seeks_in_a_synthetic_recording_are_measured(tmp_path):
    path = tmp_path / "long.mcap"
    write_recording(path, duration_s=5.0, lens_px=64)
    index = read_index(path)
    assert tuple(index.tracks) == OBJECTS
    assert index.packets.keyframe.sum() == 3
    reader = PictureReader(path, index.packets)
    asked = []

    def state_at(t_ns):
        asked.append(t_ns)
        return index.state_at(t_ns)

    rows = measure_seeks(
        (index.start_ns, index.end_ns),
        state_at=state_at,
        picture_at=lambda t_ns, early: reader.picture_at(t_ns, early=early),
        seeks=7,
    )
    reader.close()
    assert len(asked) == 7
    assert rows[-1].name == "studio.seek_ms.p95"
    assert rows[1].value <= rows[2].value
