"""Patches at rest: an even drift of exposure is no change, a changed share of the object is one."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.state import TrackState
from tracking.follow.rest import CHANGED_LEVEL, CHANGED_SHARE, PATCH_PX, first_look
from tracking.follow.track import Rest
from tracking.kernels import native

SIDE_PX, PATCHES = 200, 100
CORNERS = np.array([[18 * (k % 10) + 4, 18 * (k // 10) + 4] for k in range(PATCHES)])


@pytest.fixture
def picture():
    return np.random.default_rng(5).integers(40, 200, (SIDE_PX, SIDE_PX, 3), dtype=np.uint8)


def look(before, after, *, state=TrackState.STATIC, inside=PATCHES):
    colours = native.patch_means(before, CORNERS, PATCH_PX).reshape(-1, 3)
    track = SimpleNamespace(rest=Rest(0, CORNERS, colours, inside), state=state)
    frame = SimpleNamespace(images=(after,))
    return first_look(SimpleNamespace(track=track, scene=SimpleNamespace(frame=frame)))


def changed(picture, count):
    """The picture with so many patches brighter than what counts as unchanged."""
    after = picture.copy()
    for x, y in CORNERS[:count]:
        after[y : y + PATCH_PX, x : x + PATCH_PX] += np.uint8(2 * 255 * CHANGED_LEVEL)
    return after


def test_an_equal_picture_and_an_even_drift_of_exposure_are_unchanged(picture):
    assert look(picture, picture)
    assert look(picture, picture + np.uint8(30))


def test_a_changed_share_of_the_object_has_to_be_measured(picture):
    least = int(PATCHES * CHANGED_SHARE)
    assert look(picture, changed(picture, least - 1))
    assert not look(picture, changed(picture, least))


def test_what_changes_around_the_object_alone_does_not_count(picture):
    after = picture.copy()
    x, y = CORNERS[-1]
    after[y : y + PATCH_PX, x : x + PATCH_PX] += np.uint8(2 * 255 * CHANGED_LEVEL)
    assert look(picture, after, inside=PATCHES - 1)


def test_only_what_rests_is_looked_at(picture):
    assert not look(picture, picture, state=TrackState.TRACKED)
    assert not look(picture, picture, inside=0)
