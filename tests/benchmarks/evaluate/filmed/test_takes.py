import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.takes import BODY_NUMBERS, RECORDING, TakeCache
from scenes.pose import Pose
from scenes.samples import sample_room

CONDITIONS = Conditions(lens_size_px=96, bitrate_mbps=2.0)
WHERE = Pose.from_yaw(0.2, (0.6, -0.7, 1.3))


@pytest.fixture(scope="module")
def desk():
    return sample_room("desk")


@pytest.fixture(scope="module")
def shots(desk):
    poses = {item.object_id: item.world_from_object for item in desk.objects}
    book = poses["book-1"]
    way = [Pose(book.rotation, book.translation + np.array([0.02 * k, 0, 0])) for k in range(3)]
    return [
        Shot(k * 100_000_000, standing({**poses, "book-1": pose})) for k, pose in enumerate(way)
    ]


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return tmp_path_factory.mktemp("takes")


@pytest.fixture(scope="module")
def film_set(desk, root):
    with FilmSet(desk, cache=TakeCache(root)) as opened:
        yield opened


def film(film_set, shots, conditions=CONDITIONS, seed=0):
    calls = []
    take = film_set.film(shots, conditions, seed=seed, advance=calls.append)
    return take, calls


@pytest.fixture(scope="module")
def take(film_set, shots):
    return film(film_set, shots)[0]


def test_a_take_plays_frames_truth_and_masks(take, shots, desk):
    messages = list(take.play(WHERE))
    assert [m.frame.t_ns for m in messages] == [shot.t_ns for shot in shots]
    for message, shot in zip(messages, shots, strict=True):
        assert message.frame.images[0].shape == (96, 96, 3)
        assert np.array_equal(message.frame.world_from_rig.matrix(), WHERE.matrix())
        assert np.allclose(
            message.truth.recorded.world_from_object["book-1"].matrix(),
            shot.placements["book-1"].world_from_part[0].matrix(),
        )
        assert np.allclose(
            message.truth.recorded.world_from_rig.matrix(), desk.world_from_rig.matrix()
        )
        assert message.truth.masks["book-1"][0].any()
        assert message.truth.recorded.moved == (frozenset() if shot is shots[0] else {"book-1"})


def test_the_second_time_it_is_not_filmed(take, film_set, shots):
    again, calls = film(film_set, shots)
    assert again == take
    assert calls == []


def test_the_camera_s_pose_error_needs_no_new_take(take, film_set, shots):
    exact = replace(CONDITIONS, pose_error_deg=0.0, pose_error_cm=3.0)
    assert film(film_set, shots, exact)[0] == take


@pytest.mark.parametrize("change", ["seed", "noise", "shots"])
def test_whatever_changes_the_pictures_makes_another_take(take, film_set, shots, change):
    conditions, seed, wanted = CONDITIONS, 0, shots
    if change == "seed":
        seed = 1
    elif change == "noise":
        conditions = replace(CONDITIONS, noise=3.0)
    else:
        wanted = shots[:2]
    other, calls = film(film_set, wanted, conditions, seed)
    assert other.folder != take.folder
    assert calls[-1] == 1.0


def test_noise_is_in_the_pictures(film_set, shots):
    """Two seeds of pictures that are else the same; without noise and drift there is no chance."""

    def differ(conditions):
        first, second = (
            next(film(film_set, shots[:1], conditions, seed)[0].play(WHERE)).frame.images[0]
            for seed in (0, 1)
        )
        return float(np.abs(first.astype(int) - second.astype(int)).mean())

    plenty = replace(CONDITIONS, noise=8.0, drift=0.0, bitrate_mbps=50.0)
    assert differ(plenty) > 2.0
    assert differ(replace(plenty, noise=0.0)) == 0.0


def test_a_take_that_is_broken_off_leaves_nothing(film_set, shots, root):
    def cancel(_share):
        raise KeyboardInterrupt

    before = set(root.iterdir())
    with pytest.raises(KeyboardInterrupt):
        film_set.film(shots, CONDITIONS, seed=77, advance=cancel)
    assert set(root.iterdir()) == before


def test_the_longest_unused_takes_go_first(tmp_path):
    cache = TakeCache(tmp_path, limit_bytes=2500)
    for age, key in enumerate(["old", "middle", "new"]):
        with cache.filming(key) as folder:
            (folder / RECORDING).write_bytes(bytes(900))
            (folder / BODY_NUMBERS).write_bytes(bytes(100))
        os.utime(tmp_path / key, (age + 1, age + 1))
        if key == "middle":
            assert cache.find("old", ()) is not None
            os.utime(tmp_path / "old", (1, 1))
    assert cache.find("old", ()) is None
    assert cache.find("middle", ()) is not None
    assert cache.find("new", ()) is not None


def test_every_source_of_the_pictures_is_there():
    from benchmarks.evaluate.filmed.takes import PICTURE_SOURCES

    root = Path(__file__).parents[4]
    assert [pattern for pattern in PICTURE_SOURCES if not list(root.glob(pattern))] == []
