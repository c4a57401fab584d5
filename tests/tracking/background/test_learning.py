"""Plates learn the room in bands."""

import math

import numpy as np
import pytest

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from tracking.background.images import BackgroundImages, Exposure, expose
from tracking.background.learning import Care, band_of, learn, learn_unscanned, whole_lens
from tracking.background.strips import STRIPS
from tracking.window.filters import bell_blurred
from tracking.window.window import Layer

SIDE = 360
LENS = Fisheye.from_fov(SIDE, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
NEUTRAL = Exposure(np.ones(3), np.zeros(3), np.zeros(3))


@pytest.fixture(scope="module")
def room():
    """A room as it is, and plates that are a little off everywhere."""
    rng = np.random.default_rng(0)
    true = bell_blurred(rng.uniform(0, 1, (SIDE, SIDE, 3)).astype(np.float32), 4.0, 12)
    true = np.clip(0.5 + 4 * (true - 0.5), 0.05, 0.95)
    rough = np.clip(true + rng.normal(0, 0.02, true.shape), 0, 1).astype(np.float32)
    whole = np.ones((SIDE, SIDE), np.float32)
    background = BackgroundImages.of_pictures(Pose.identity(), (rough, rough), (whole, whole))
    image = np.round(true * 255).astype(np.uint8)
    frame = Frame("camera", 0, 0, 0, (image, image), RIG, Pose.identity())
    return true, background, frame


def test_every_row_of_every_lens_has_its_turn():
    turns = [band_of(turn, (100, 77)) for turn in range(2 * STRIPS)]
    for lens, height in enumerate((100, 77)):
        rows = [row for b in turns if b.lens == lens for row in range(b.top, b.bottom)]
        assert rows == list(range(height))
    assert band_of(2 * STRIPS, (100, 77)) == turns[0]


def test_a_band_learns_its_rows_only_and_what_the_whole_would(room):
    true, background, frame = room
    band = band_of(5, (SIDE, SIDE))
    part = learn(background, frame, NEUTRAL, (), band)
    whole = learn(background, frame, NEUTRAL, (), whole_lens(band.lens, SIDE))
    rows = slice(band.top, band.bottom)
    before, after = background.images[band.lens].whole(), part.images[band.lens].whole()
    np.testing.assert_array_equal(after[: band.top], before[: band.top])
    np.testing.assert_array_equal(after[band.bottom :], before[band.bottom :])
    np.testing.assert_allclose(after[rows], whole.images[band.lens][rows, :], atol=1e-6)
    assert part.learned[band.lens][rows, :].mean() > 0.98
    assert float(np.abs(after[rows] - true[rows]).mean()) < 0.004
    assert part.images[1 - band.lens] is background.images[1 - band.lens]


def test_nothing_is_learned_where_an_object_stands(room):
    _, background, frame = room
    square = np.ones((40, 50), np.float32)
    taken = Layer(100, 120, np.zeros((40, 50, 3), np.float32), square, square)
    found = learn(background, frame, NEUTRAL, (taken,), whole_lens(0, SIDE))
    assert not found.learned[0][120:160, 100:150].any()
    assert found.learned[0][:100, :].mean() > 0.98


def test_while_things_may_be_anywhere_nothing_is_learned_beside_what_differs(room):
    true, background, frame = room
    image = frame.images[0].copy()
    image[100:140, 100:110] = 255
    # The thing's other side is as good as the room's colours.
    image[100:140, 110:114] = np.clip(255 * true[100:140, 110:114] + 4, 0, 255)
    seen = Frame("camera", 0, 0, 0, (image, image), RIG, Pose.identity())
    band = whole_lens(0, SIDE)
    after = learn(background, seen, NEUTRAL, (), band, care=Care.WARY).learned[0].whole()
    assert not after[104:136, 96:116].any()
    assert after[200:, 200:].mean() > 0.9
    less = learn(background, seen, NEUTRAL, (), band, care=Care.CAUTIOUS).learned[0].whole()
    assert after.sum() < less.sum()


def test_what_no_photo_showed_is_taken_from_the_picture_away_from_objects(room):
    """A scan without its ceiling would differ there for ever."""
    true, *_ = room
    scanned = np.ones((SIDE, SIDE), np.float32)
    scanned[40:90, 60:200] = 0.2
    empty = np.where(scanned[..., None] > 0.5, true, 0.0).astype(np.float32)
    exposure = Exposure(np.full(3, 1.1), np.full(3, -0.2), np.full(3, 0.02))
    y, x = (np.mgrid[0:SIDE, 0:SIDE] + 0.5) * 2 / SIDE - 1
    shown = expose(true, exposure, radius2=x**2 + y**2)
    image = np.round(np.clip(shown, 0, 1) * 255).astype(np.uint8)
    seen = Frame("camera", 0, 0, 0, (image, image), RIG, Pose.identity())
    background = BackgroundImages.of_pictures(Pose.identity(), (empty, empty), (scanned, scanned))
    square = np.ones((20, 30), np.float32)
    taken = Layer(60, 40, np.zeros((20, 30, 3), np.float32), square, square)
    after = learn_unscanned(background, seen, lens=1, exposure=exposure, taken=(taken,))
    learned = after.learned[1].whole()
    assert learned[45:85, 100:195].all()
    assert not learned[40:60, 60:90].any()
    assert not learned[scanned > 0.5].any()
    difference = np.abs(after.images[1].whole() - true)
    assert difference[learned].max() < 0.01
    np.testing.assert_array_equal(after.coverage[1] > 0.5, learned | (scanned > 0.5))
    assert after.images[0] is background.images[0]
