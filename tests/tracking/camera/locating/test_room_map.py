"""The map of a room: places that are free, and scores that peak at the right place and turn."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.splats import SplatCloud
from tracking.camera.locating.panorama import Panorama, drawn_panorama
from tracking.camera.locating.room_map import free_places, map_of, scores, turned


def test_places_are_in_the_room_and_clear_of_the_table(table):
    places = free_places(table.scan.room, np.random.default_rng(0))
    low, high = np.percentile(table.scan.room.means, [1, 99], axis=0)
    assert 100 < len(places) < 2000
    assert (places > low).all()
    assert (places[:, :2] < high[:2]).all()
    assert places[:, 2].min() > 0.3
    assert places[:, 2].max() < 2.2


def test_another_generator_shifts_the_places(table):
    first, second = (free_places(table.scan.room, np.random.default_rng(k)) for k in (0, 1))
    assert not np.array_equal(first, second)


def test_a_room_without_free_space_is_refused():
    rng = np.random.default_rng(0)
    means = rng.uniform((0, 0, -0.05), (2, 2, 3), (60_000, 3)).astype(np.float32)
    count = len(means)
    solid = SplatCloud(
        means,
        np.full((count, 3), 0.05, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.9, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )
    with pytest.raises(ValueError, match="no camera can stand"):
        free_places(solid, rng)


def test_scores_are_one_for_the_same_place_at_the_turn_between(room_map, table):
    number = len(room_map.places) // 2
    drawn = drawn_panorama(room_map.posed, table.renderer, room_map.places[number])
    rolled = Panorama(np.roll(drawn.details, -9, axis=1), np.roll(drawn.weight, -9, axis=1))
    score = scores(room_map, [drawn, rolled])
    assert score[number, 0, 0] == pytest.approx(1.0, abs=1e-3)
    assert score[number, 1, 9] == pytest.approx(1.0, abs=1e-3)
    assert np.unravel_index(score[:, 1].argmax(), score[:, 1].shape) == (number, 9)
    assert score.max() < 1.001


def test_a_column_stands_for_its_turn():
    assert turned(24).yaw() == pytest.approx(np.pi / 2)
    assert turned(72).yaw() == pytest.approx(-np.pi / 2)


def test_drawing_ends_when_it_is_told_to(table):
    shares = []
    made = map_of(
        table.scan.room,
        table.renderer,
        rng=np.random.default_rng(0),
        advance=lambda share: shares.append(share) or len(shares) < 3,
    )
    assert made is None
    assert len(shares) == 3
    assert isinstance(turned(0), Pose)
