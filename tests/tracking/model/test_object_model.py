"""Levels of detail: each for pictures up to a size, in which it looks like the scan."""

import math

import numpy as np
import pytest

from scenes.opening import open_scene
from scenes.render.native import NativeRenderer
from tracking.model.object_model import COARSEST_PX, detail_levels_of, make_model
from tracking.model.templates import HALF_WIDTH, drawn_around


@pytest.fixture(scope="module")
def book():
    return next(item for item in open_scene("desk").objects if item.object_id == "book-1")


@pytest.fixture(scope="module")
def model(book):
    return make_model(book, NativeRenderer())


def test_levels_grow_and_the_last_is_the_scan(model, book):
    counts = [len(level.splats) for level in model.levels]
    assert counts == sorted(counts)
    assert counts[0] < 0.2 * counts[-1]
    assert model.levels[-1].splats is book.splats
    assert math.isinf(model.levels[-1].max_radius_px)


def test_the_level_for_a_picture_is_the_coarsest_that_is_fine_enough(model):
    assert model.level_for(0.5 * COARSEST_PX) is model.levels[0]
    assert model.level_for(COARSEST_PX + 0.1) is model.levels[1]
    assert model.level_for(1e4) is model.levels[-1]


def test_a_level_looks_like_the_scan_at_its_size(model, book):
    level = model.level_for(17.0)
    side_px = round(2 * 17.0 * HALF_WIDTH)
    whole, coarse = (
        drawn_around(splats, NativeRenderer(), model.centre_m, model.radius_m, 0.5, side_px=side_px)
        for splats in (book.splats, level.splats)
    )
    shown = whole[..., 3] > 0.5
    assert np.abs(whole - coarse)[shown].mean() < 0.03


def test_every_level_can_be_relit(book):
    for level in detail_levels_of(book, 0.2):
        assert len(level.relightable.facing) == len(level.relightable.splats)
