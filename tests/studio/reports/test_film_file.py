import threading
from types import SimpleNamespace

import av
import numpy as np
import pytest

from studio.reports import film_file
from studio.reports.film_file import FilmFile, FilmThread, Stills
from studio.session.plan import SessionPlan


def frames(count):
    return [SimpleNamespace(t_ns=index * 10**8) for index in range(count)]


class Maker:
    """Draws grey pictures; the first one waits for `turn`."""

    def __init__(self, turn=None):
        self.turn = turn
        self.count = 0

    def picture(self, frame):
        if self.turn is not None and frame.t_ns == 0:
            assert self.turn.wait(timeout=30)
        self.count += 1
        return np.full((32, 48, 3), 40 + frame.t_ns // 10**8 % 100, np.uint8)


def shown(path):
    with av.open(str(path)) as container:
        return [f.to_ndarray(format="rgb24").mean() for f in container.decode(video=0)]


def test_every_frame_is_one_picture_in_order(tmp_path):
    path = tmp_path / "film.mp4"
    with FilmFile(path, Maker(), 10.0, stills=4) as film:
        for frame in frames(12):
            film.add(frame)
    assert np.allclose(shown(path), 40 + np.arange(12), atol=1.5)
    assert [round(t, 6) for t, _ in film.stills] == [0.0, 0.4, 0.7, 1.1]
    assert [p.name for p in tmp_path.iterdir()] == ["film.mp4"]


def test_an_error_leaves_no_film(tmp_path):
    film = FilmFile(tmp_path / "film.mp4", Maker(), 10.0, stills=4)

    def fail():
        with film:
            film.add(frames(1)[0])
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("length", [1, 7, 33, 500, 4001])
def test_stills_are_evenly_apart_and_few_in_memory(length):
    stills = Stills(8)
    for index in range(length):
        stills.add(float(index), np.zeros(0))
        assert len(stills._kept) <= 32
    times = [t for t, _ in stills.chosen()]
    assert (times[0], times[-1]) == (0.0, length - 1)
    assert len(times) == min(8, length)
    even = np.linspace(0, length - 1, len(times))
    assert np.abs(np.array(times) - even).max() <= max(0.5, (length - 1) / 7 / 4)


def test_in_real_time_a_full_queue_costs_pictures_and_not_time(tmp_path, monkeypatch):
    monkeypatch.setattr(film_file, "QUEUE", 2)
    turn = threading.Event()
    maker = Maker(turn)
    path = tmp_path / "film.mp4"
    with FilmFile(path, maker, 10.0, stills=4) as film, FilmThread(film) as thread:
        for frame in frames(10):
            thread.add(frame)
        turn.set()
    assert thread.left_out >= 7
    assert maker.count == 10 - thread.left_out == len(shown(path))


def test_an_error_while_drawing_reaches_the_session(tmp_path):
    class Broken(Maker):
        def picture(self, frame):
            raise OSError("no space")

    film = FilmFile(tmp_path / "film.mp4", Broken(), 10.0, stills=4)
    with pytest.raises(OSError, match="no space"), film, FilmThread(film) as thread:
        thread.add(frames(1)[0])
    assert list(tmp_path.iterdir()) == []


def test_a_film_frame_keeps_no_large_image(tiny):
    from studio.reports.film import PANEL_PX, film_frame

    outputs = []
    tiny.session(SessionPlan()).run(outputs.append)
    kept = film_frame(outputs[-1])
    assert kept.camera_panel.shape == (PANEL_PX, PANEL_PX, 3)
    assert set(kept.tracks) == {"chair-1", "stool-1"}
    assert kept.truth.seq == tiny.frames - 1
    assert not hasattr(kept, "images")
