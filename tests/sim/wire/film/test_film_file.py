import os

import numpy as np
import pytest

from devices.messages import Event
from scenes.pose import Pose
from sim.wire.film.film import FilmFormat, PictureTruth
from sim.wire.film.film_file import (
    ABOUT,
    UNITS,
    FilmError,
    FilmWriter,
    cached_film,
    film_digest,
    read_film,
)

FORM = FilmFormat(320, 160, 25, "stacked", 5_000)


def fill(folder, size=10):
    writer = FilmWriter(folder, "few", FORM)
    for k in range(4):
        writer.add_unit(bytes([k]) * size, t_ns=40 * k, keyframe=k == 0, shows=k)
        pose = Pose(np.eye(3), np.array([k, 0.0, 1.0]))
        writer.add_picture(
            PictureTruth(40 * k, {"chair": pose}, {"chair": 0.5}, pose, {"bump": 2.0} if k else {})
        )
    writer.add_events([Event(40, "camera-360", "bumped", "by 2°")])
    writer.finish(160)


def test_what_was_written_is_read_again(tmp_path):
    fill(tmp_path)
    film = read_film(tmp_path)
    assert (film.name, film.form, film.duration_ns, len(film)) == ("few", FORM, 160, 4)
    assert [film.unit(k).data for k in range(4)] == [bytes([k]) * 10 for k in range(4)]
    assert [film.unit(k).keyframe for k in range(4)] == [True, False, False, False]
    truth = film.truth_of(3)
    assert truth.t_ns == 120
    assert truth.world_from_object["chair"].translation.tolist() == [3, 0, 1]
    assert truth.visible_fraction == {"chair": 0.5}
    assert (film.truth_of(0).faults, truth.faults) == ({}, {"bump": 2.0})
    assert film.events == (Event(40, "camera-360", "bumped", "by 2°"),)


def test_the_cache_makes_a_film_once(tmp_path):
    digest = film_digest({"seed": 1})
    assert digest != film_digest({"seed": 2})
    made = [cached_film(tmp_path / "films", digest, fill) for _ in range(2)]
    assert [was_there for _, was_there in made] == [False, True]
    assert [folder.name for folder in (tmp_path / "films").iterdir()] == [digest]


def test_a_cancelled_film_leaves_nothing(tmp_path):
    def cancelled(folder):
        fill(folder)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cached_film(tmp_path, "a", cancelled)
    assert not list(tmp_path.iterdir())


def test_a_damaged_film_is_made_again(tmp_path):
    cached_film(tmp_path, "a", fill)
    (tmp_path / "a" / UNITS).write_bytes(b"short")
    with pytest.raises(FilmError, match="no whole film"):
        read_film(tmp_path / "a")
    film, was_there = cached_film(tmp_path, "a", fill)
    assert not was_there
    assert len(film.unit(3).data) == 10


def test_a_film_of_another_version_is_refused(tmp_path):
    fill(tmp_path)
    about = tmp_path / ABOUT
    about.write_text(about.read_text().replace('"version": 1', '"version": 99'))
    with pytest.raises(FilmError, match="version 99"):
        read_film(tmp_path)


def test_the_films_used_longest_ago_make_room(tmp_path):
    for age, name in enumerate(("new", "old")):
        cached_film(tmp_path, name, lambda folder: fill(folder, 1000))
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    size = sum(file.stat().st_size for file in (tmp_path / "new").iterdir())
    cached_film(tmp_path, "newest", lambda folder: fill(folder, 1000), max_bytes=2 * size + 100)
    assert {folder.name for folder in tmp_path.iterdir()} == {"new", "newest"}
