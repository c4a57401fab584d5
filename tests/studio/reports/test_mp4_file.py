"""Pictures into an MP4: each at its place, whole or not at all."""

import av
import numpy as np
import pytest

from studio.reports.mp4_file import Mp4File


def grey(value):
    return np.full((32, 48, 3), value, np.uint8)


def shown(path):
    """(seconds, grey) of each picture."""
    with av.open(str(path)) as container:
        return [
            (f.pts * f.time_base, f.to_ndarray(format="rgb24").mean())
            for f in container.decode(video=0)
        ]


def test_a_picture_stays_until_the_place_of_the_next(tmp_path):
    path = tmp_path / "film.mp4"
    with Mp4File(path, 10.0) as film:
        film.add(grey(40))
        film.add(grey(80), at=5)
        film.add(grey(120))
        with pytest.raises(ValueError, match="picture at 3, wanted 7 or later"):
            film.add(grey(0), at=3)
    times, greys = zip(*shown(path), strict=True)
    assert [round(float(t), 3) for t in times] == [0.0, 0.5, 0.6]
    assert np.allclose(greys, [40, 80, 120], atol=1.5)


def test_an_error_leaves_nothing(tmp_path):
    def fail():
        with Mp4File(tmp_path / "film.mp4", 10.0) as film:
            film.add(grey(40))
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_it_must_be_opened(tmp_path):
    with pytest.raises(ValueError, match="was not opened"):
        Mp4File(tmp_path / "film.mp4", 10.0).add(grey(1))
