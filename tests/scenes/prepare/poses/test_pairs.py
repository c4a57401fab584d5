from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.prepare.poses.sfm.features import (
    all_pairs,
    neighbour_pairs,
    picture_signatures,
    similar_pairs,
)


@given(st.integers(0, 40))
def test_all_pairs_are_all_of_them_once(count):
    pairs = all_pairs(count)
    assert len(set(pairs)) == len(pairs) == count * (count - 1) // 2
    assert all(0 <= i < j < count for i, j in pairs)


@given(st.integers(1, 200), st.integers(1, 10))
def test_neighbours_are_near_or_powers_of_two_times_that(count, reach):
    pairs = neighbour_pairs(count, reach)
    assert len(set(pairs)) == len(pairs)
    assert all(0 <= i < j < count for i, j in pairs)
    assert {(i, i + 1) for i in range(count - 1)} <= set(pairs)


def views_on_a_loop(rng, count=40, each=300):
    """Descriptors of pictures that each see a window of a ring of features; noisy bytes."""
    ring = rng.integers(0, 120, (2000, 128))
    windows = [(np.arange(each) + k * 2000 // count) % 2000 for k in range(count)]
    return [
        np.clip(ring[w] + rng.normal(0, 6, (each, 128)), 0, 255).astype(np.uint8) for w in windows
    ]


def test_pictures_of_the_same_things_propose_each_other():
    rng = np.random.default_rng(4)
    signatures = picture_signatures(views_on_a_loop(rng), rng)
    pairs = similar_pairs(signatures, 4)
    ring_distance = [min(j - i, 40 - (j - i)) for i, j in pairs]
    assert np.mean(np.array(ring_distance) <= 5) > 0.9
    assert (0, 39) in pairs


def test_near_ones_are_no_proposal_where_they_are_matched_anyway():
    rng = np.random.default_rng(4)
    signatures = picture_signatures(views_on_a_loop(rng), rng)
    assert all(j - i >= 9 for i, j in similar_pairs(signatures, 4, apart=9))


def test_pictures_without_features_harm_nobody():
    nothing = np.zeros((0, 128), dtype=np.uint8)
    rng = np.random.default_rng(0)
    assert np.isfinite(picture_signatures([nothing, nothing], rng)).all()
    mixed = picture_signatures([nothing, *views_on_a_loop(rng, count=6)], rng)
    assert not mixed[0].any()
    assert np.allclose(np.linalg.norm(mixed[1:], axis=1), 1.0)
