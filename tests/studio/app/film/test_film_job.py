"""Films of a recording and of what goes on: what is in the file, cancelled and failed ones."""

import time

import av
import numpy as np
import pytest

from scenes.frames import look_at
from scenes.state import Avatar, SceneState
from studio.app.film.film_job import WAITING, FilmJob
from studio.app.film.film_picture import FilmSet, film_picture
from studio.app.film.moments import Moment, recorded_moments
from studio.app.film.plan import FilmPlan
from studio.app.model.documents.document import Document
from studio.app.timeline.recorded.reading import read_index
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Shown

EYE = look_at(np.array([0.0, -2.0, 1.6]), np.array([0.0, 0.0, 0.5]))


@pytest.fixture(scope="module")
def made_of(tiny):
    drawing = SceneDrawing(tiny.scene)
    drawing.prepare()
    yield FilmSet(drawing, Document("tiny"), Shown(labels=False))
    drawing.close()


def plan(path, **values):
    return FilmPlan(path, 160, 90, 10.0, **{"world_from_camera": EYE, **values})


def pictures(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (160, 90)
        assert stream.codec_context.pix_fmt == "yuv420p"
        return [(float(f.time), f.to_ndarray(format="rgb24")) for f in container.decode(video=0)]


def difference(one, other):
    return np.abs(one.astype(int) - other.astype(int)).mean()


def test_a_recording_is_filmed_from_end_to_end(made_of, recording, tmp_path):
    path = tmp_path / "made" / "film.mp4"
    job = FilmJob(plan(path), made_of, recording)
    job.join()
    assert job.failure is None
    assert job.is_made
    assert job.share.take() == pytest.approx(1.0)
    index = read_index(recording)
    found = pictures(path)
    times = plan(path).times_ns(index.start_ns, index.end_ns)
    assert len(found) == len(times) == job.written
    assert [t for t, _ in found] == pytest.approx([n / 10 for n in range(len(times))], abs=1e-3)
    expected = [
        film_picture(made_of, plan(path), Moment(index.state_at(times[number])))
        for number in (0, len(times) - 1)
    ]
    # H.264 changes colours by some levels, the chair that has moved by more.
    for number, other in ((0, 1), (1, 0)):
        seen = found[-number][1]
        assert difference(seen, expected[number]) < 6
        assert difference(seen, expected[number]) < difference(seen, expected[other])


def test_a_person_and_the_camera_are_filmed(made_of, recording, tmp_path):
    index = read_index(recording)
    person = plan(tmp_path / "maya.mp4", source="maya", world_from_camera=None)
    state = index.state_at(index.end_ns)
    head = state.avatars["maya"].world_from_head
    own = film_picture(made_of, person, Moment(state))
    assert np.array_equal(
        own, film_picture(made_of, plan(tmp_path / "f.mp4", world_from_camera=head), Moment(
            SceneState(objects=state.objects, world_from_rig=state.world_from_rig)
        ))
    )  # fmt: skip
    camera = plan(tmp_path / "camera.mp4", source="camera", to_s=0.2)
    job = FilmJob(camera, made_of, recording)
    job.join()
    assert job.failure is None
    shown = pictures(camera.path)[-1][1]
    middle, edge = shown[:, 40:120], shown[:, :20]
    assert middle.std() > 3 * edge.std()  # a square picture in the middle, nothing beside it
    away = film_picture(made_of, person, Moment(SceneState()))
    assert away.std(axis=(0, 1)).max() == 0


def test_moments_of_a_recording_have_the_cameras_picture_where_it_is_shown(tiny, recording):
    index = read_index(recording)
    for shows_camera in (True, False):
        moments = list(
            recorded_moments(
                index,
                tiny.scene,
                Document("tiny"),
                times_ns=(index.start_ns, index.end_ns),
                shows_camera=shows_camera,
            )
        )
        assert [moment.place for moment in moments] == [0, 1]
        assert all((m.camera_picture is not None) == shows_camera for m in moments)


def test_what_goes_on_is_filmed_until_it_is_ended(made_of, tmp_path):
    path = tmp_path / "film.mp4"
    job = FilmJob(plan(path), made_of, None)
    for place in (0, 3, 4):
        head = look_at(np.array([0.3 * place, 0.0, 1.6]), np.array([0.0, -2.0, 1.5]))
        job.add(Moment(SceneState(avatars={"ana": Avatar("ana", "local", head)}), place=place))
    job.end()
    job.join()
    found = pictures(path)
    assert [t for t, _ in found] == pytest.approx([0.0, 0.3, 0.4], abs=1e-3)
    moved = np.abs(found[0][1].astype(int) - found[-1][1]).max(axis=2) > 40
    assert moved.sum() > 50  # of 14,400 pixels: the head was drawn at two places


def test_what_comes_too_fast_is_counted(made_of, tmp_path):
    job = FilmJob(plan(tmp_path / "film.mp4"), made_of, None)
    count = 20 * WAITING
    for place in range(count):
        job.add(Moment(SceneState(), place=place))
    job.end()
    job.join()
    assert job.left_out > 0
    assert job.written + job.left_out == count


def test_a_cancelled_film_leaves_nothing(made_of, recording, tmp_path):
    job = FilmJob(plan(tmp_path / "film.mp4"), made_of, None)
    job.add(Moment(SceneState()))
    job.cancel()
    job.join()
    assert not job.is_made
    assert job.failure is None
    recorded = FilmJob(FilmPlan(tmp_path / "a.mp4", 1920, 1080, 60.0), made_of, recording)
    recorded.cancel()
    recorded.join()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("folder", ["/proc/nowhere", "/dev/full"])
def test_a_film_that_cannot_be_written_says_why(made_of, folder):
    from pathlib import Path

    job = FilmJob(plan(Path(folder) / "film.mp4"), made_of, None)
    job.add(Moment(SceneState()))
    time.sleep(0.05)
    job.end()
    job.join()
    assert isinstance(job.failure, OSError)


def test_an_empty_film_is_none(made_of, tmp_path):
    job = FilmJob(plan(tmp_path / "film.mp4"), made_of, None)
    job.end()
    job.join()
    assert "nothing was filmed" in str(job.failure)
    assert list(tmp_path.iterdir()) == []
