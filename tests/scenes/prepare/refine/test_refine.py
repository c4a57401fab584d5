"""Refinement of half a coarse ball: sharper, in its place, and the same each time."""

import math

import numpy as np
import pytest

from scenes.prepare.progress import Cancelled
from scenes.prepare.refine import refine as refinement
from scenes.prepare.refine.refine import RefineOptions, refine

FIELDS = ("means", "scales", "rotations", "opacities", "sh")
OPTIONS = RefineOptions(steps=160)


@pytest.fixture(autouse=True, scope="module")
def few_splats():
    """As many as a photo of 96 × 72 px asks for."""
    patch = pytest.MonkeyPatch()
    patch.setattr(refinement, "MIN_SPLATS", 500)
    yield
    patch.undo()


def refined(room, mask, views, options=OPTIONS, **more):
    return refine(room, mask, views=views, options=options, rng=np.random.default_rng(1), **more)


@pytest.fixture(scope="module")
def done(coarse_ball, is_upper, ball_views):
    return refined(coarse_ball, is_upper, ball_views)


def test_photos_kept_aside_are_drawn_better(done):
    assert done.photos == 14
    assert done.is_better
    assert done.after_db > done.before_db + 4
    assert "dB on photos kept aside" in done.summary()


def test_the_region_has_more_splats_where_it_was(done):
    assert 400 < len(done.splats) <= 560
    radius = np.linalg.norm(done.splats.means, axis=1)
    assert np.median(np.abs(radius - 1)) < 0.03
    assert (done.splats.means[:, 2] > -0.4).all()


def test_splats_are_flat_and_lie_along_the_ball(done):
    scales = np.sort(done.splats.scales, axis=1)
    assert (scales[:, 0] <= 0.11 * scales[:, 1]).all()


def test_it_is_the_same_with_any_number_of_threads(done, coarse_ball, is_upper, ball_views):
    again = refined(coarse_ball, is_upper, ball_views, RefineOptions(steps=160, threads=1))
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(again.splats, field), getattr(done.splats, field))


def test_what_gets_worse_is_left_as_it_was(coarse_ball, is_upper, ball_views, monkeypatch):
    judged = iter([30.0, 29.0])
    monkeypatch.setattr(refinement._Run, "quality_db", lambda *_: next(judged))
    kept = refined(coarse_ball, is_upper, ball_views, RefineOptions(steps=20))
    assert not kept.is_better
    assert "kept as they were: 30.0 -> 29.0 dB" in kept.summary()
    np.testing.assert_array_equal(kept.splats.means, coarse_ball.means[is_upper])


def test_few_photos_leave_none_aside(coarse_ball, is_upper, ball_views):
    short = refined(coarse_ball, is_upper, ball_views[:3], RefineOptions(steps=20))
    assert math.isnan(short.after_db)
    assert short.summary() == f"{len(short.splats)} splats of 3 photos"


def test_a_region_that_one_photo_shows_is_refused(coarse_ball, is_upper, ball_views):
    with pytest.raises(ValueError, match="1 of 1 photos show this region, wanted at least 2"):
        refined(coarse_ball, is_upper, ball_views[:1])


def test_an_empty_region_is_refused(coarse_ball, ball_views):
    nothing = np.zeros(len(coarse_ball), dtype=bool)
    with pytest.raises(ValueError, match="no splat is in the region"):
        refined(coarse_ball, nothing, ball_views)
    with pytest.raises(ValueError, match="wanted"):
        refined(coarse_ball, nothing[1:], ball_views)


def test_it_can_be_cancelled(coarse_ball, is_upper, ball_views):
    def progress(done, note):
        if done > 0.2:
            raise Cancelled

    with pytest.raises(Cancelled):
        refined(coarse_ball, is_upper, ball_views, progress=progress)


@pytest.mark.parametrize("values", [{"steps": 0}, {"layer_price": -1.0}, {"threads": -1}])
def test_options_out_of_range_are_refused(values):
    with pytest.raises(ValueError, match=f"RefineOptions.{next(iter(values))}"):
        RefineOptions(**values)
