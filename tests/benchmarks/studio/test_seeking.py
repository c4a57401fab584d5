"""A short synthetic recording is whole, and every seek is counted."""

from benchmarks.studio.seeking import (
    OBJECTS,
    SeekTimes,
    Seen,
    measure_seeks,
    pictures_at,
    seek_rows_of,
    write_recording,
)
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.reading import read_index


def test_seeks_in_a_synthetic_recording_are_measured(tmp_path):
    path = tmp_path / "long.mcap"
    write_recording(path, duration_s=5.0, lens_px=64)
    index = read_index(path)
    assert tuple(index.tracks) == OBJECTS
    assert index.packets.keyframe.sum() == 3
    thread = PictureThread(index)
    asked = []

    def state_at(t_ns):
        asked.append(t_ns)
        return index.state_at(t_ns)

    found = measure_seeks(
        (index.start_ns, index.end_ns),
        state_at=state_at,
        pictures_at=lambda t_ns: pictures_at(thread, t_ns),
        seeks=7,
    )
    thread.stop()
    assert len(asked) == 7
    assert 0.0 < found.first <= found.exact <= found.full
    assert found.exact <= found.whole


def test_a_keyframe_is_not_the_picture_that_was_asked_for():
    import time

    def slowly(_t_ns):
        yield Seen(is_exact=False, is_full=True)
        time.sleep(0.02)
        yield Seen(is_exact=True, is_full=False)
        time.sleep(0.02)
        yield Seen(is_exact=True, is_full=True)

    found = measure_seeks((0, 100), state_at=lambda _t: None, pictures_at=slowly, seeks=3)
    assert found.first < 20.0 <= found.exact
    assert found.exact + 19.0 < found.full


def test_the_bar_is_for_an_exact_picture_once_there_are_reduced_ones():
    before, after = SeekTimes(1.0, 90.0, 400.0, 400.0, 401.0), SeekTimes(1.0, 9.0, 9.0, 350.0, 10.0)
    rows = {row.name: row for row in seek_rows_of(before, after)}
    assert rows["studio.seek_ms.p95"].value == 10.0
    assert rows["studio.seek_ms.p95"].passed
    assert rows["studio.seek.exact_picture_ms.p95"].value == 350.0
    assert rows["studio.seek.before_proxies.seek_ms.p95"].value == 401.0
    assert not seek_rows_of(after, before)[-1].passed
