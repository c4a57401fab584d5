import dataclasses

import numpy as np
import pytest

from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.prepare.align.align import align
from scenes.prepare.align.alignment import apply_alignment
from scenes.prepare.align.codes.anchors import AnchorSightings, Refusal
from scenes.prepare.align.codes.triangulate import UNIT_CORNERS
from scenes.prepare.align.similarity import similarity_from_points
from tests.scenes.prepare.align.printed import SIDE_M, capture, wall_codes

PLACES = np.array(
    [[-2.8, -2.3, 0.2], [2.7, 2.3, 2.4], [-2.8, 2.3, 1.0], [2.8, -2.3, 0.1], [0.0, 0.0, 1.0]]
)


def rng(seed=0):
    return np.random.default_rng(seed)


def errors_m(alignment, truth, codes):
    """How far places in the room are off, as measured from the codes, and where they came out."""
    found = alignment.world_from_reconstruction @ (truth.inverse() @ PLACES)
    used = [a.payload for a in alignment.anchors]
    wanted = np.concatenate([codes[p] @ (SIDE_M * UNIT_CORNERS) for p in used])
    got = np.concatenate([a.world_from_code @ (SIDE_M * UNIT_CORNERS) for a in alignment.anchors])
    turn = similarity_from_points(wanted, got).rotation
    back = Pose(turn, wanted.mean(axis=0) - turn @ got.mean(axis=0))
    return np.linalg.norm(back @ found - PLACES, axis=1), found


@pytest.mark.parametrize("known", [False, True], ids=["free", "known"])
@pytest.mark.parametrize("count", [1, 3])
def test_errors_stay_within_their_bound(count, known):
    """Codes with noisy corners in photos with noisy poses, in many rooms."""
    codes = wall_codes(count)
    inside, errors, predicted = [], [], []
    for seed in range(10):
        reconstruction, sightings, truth = capture(rng(seed), codes=codes)
        alignment = align(
            reconstruction,
            sightings,
            sides_m=SIDE_M,
            world_from_codes=codes if known else None,
            rng=rng(),
        )
        # The bending is left out: these reconstructions do not bend.
        alignment = dataclasses.replace(alignment, bend_per_metre=0.0)
        if known:
            found = alignment.world_from_reconstruction @ (truth.inverse() @ PLACES)
            error = np.linalg.norm(found - PLACES, axis=1)
        else:
            error, found = errors_m(alignment, truth, codes)
        inside.append(error < alignment.predicted_error_m(found, bound=0.95))
        errors.append(error)
        predicted.append(alignment.predicted_error_m(found))
    assert np.mean(inside) > 0.9
    # ... and the bound is no idle one: the prediction is at most some times too careful.
    ratio = np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(predicted)))
    assert 0.25 < ratio < 1.3
    assert np.median(errors) < 0.005


def test_the_world_stands_on_the_floor_under_the_first_code():
    codes = wall_codes(2)
    reconstruction, sightings, truth = capture(rng(1), codes=codes, corner_px=0.02)
    alignment = align(reconstruction, sightings, sides_m=SIDE_M, rng=rng())
    metric = apply_alignment(reconstruction, alignment)
    assert alignment.gravity is not None
    assert alignment.gravity.floor_points > 50
    first = alignment.anchors[0]
    assert first.payload == "code:0"
    np.testing.assert_allclose(first.world_from_code.translation, [0, 0, 1.5], atol=0.01)
    np.testing.assert_allclose(first.world_from_code.rotation[:, 2], [1, 0, 0], atol=0.01)
    assert np.quantile(np.abs(metric.points[:, 2]), 0.08) < 0.01
    up = alignment.world_from_reconstruction.rotation @ (truth.rotation.T @ [0, 0, 1])
    assert np.degrees(np.arccos(up[2])) < 0.1
    scale, sigma = alignment.metres_per_unit()
    assert abs(scale - truth.scale) < 5 * sigma


def test_known_codes_give_their_world():
    codes = wall_codes(3)
    reconstruction, sightings, truth = capture(rng(2), codes=codes)
    alignment = align(reconstruction, sightings, sides_m=SIDE_M, world_from_codes=codes, rng=rng())
    found = alignment.world_from_reconstruction
    assert np.linalg.norm(found @ (truth.inverse() @ PLACES) - PLACES, axis=1).max() < 0.005
    for anchor in alignment.anchors:
        turn = codes[anchor.payload].rotation.T @ anchor.world_from_code.rotation
        assert np.degrees(rotation_angle(turn)) < 1.0
        assert not alignment.warnings
        off = anchor.world_from_code.translation - codes[anchor.payload].translation
        assert np.linalg.norm(off) < 0.005
        assert anchor.residual_px < 0.5
        assert anchor.residual_mm < 2.0
        assert len(anchor.views) >= 2


def test_a_code_that_is_not_where_it_was_is_told():
    codes = wall_codes(3)
    reconstruction, sightings, _ = capture(rng(2), codes=codes)
    old = Pose(codes["code:2"].rotation, codes["code:2"].translation + np.array([0.2, 0, 0]))
    alignment = align(
        reconstruction,
        sightings,
        sides_m=SIDE_M,
        world_from_codes={**codes, "code:2": old},
        rng=rng(),
    )
    assert any("from where it should be" in w for w in alignment.warnings)


def test_one_bad_photo_does_not_matter_and_is_named():
    codes = wall_codes(2)
    reconstruction, sightings, truth = capture(rng(3), codes=codes)
    first = sightings[0]
    bad = dataclasses.replace(first.sightings[0], corners_px=first.sightings[0].corners_px + 25)
    spoilt = dataclasses.replace(first, sightings=(bad, *first.sightings[1:]))
    alignment = align(reconstruction, (spoilt, *sightings[1:]), sides_m=SIDE_M, rng=rng())
    assert any("left out" in w and bad.view in w for w in alignment.warnings)
    assert alignment.metres_per_unit()[0] == pytest.approx(truth.scale, rel=3e-3)


def test_two_codes_that_disagree_are_refused_with_the_amount():
    reconstruction, sightings, _ = capture(rng(4), codes=wall_codes(2), sides_m={"code:1": 0.17})
    with pytest.raises(ValueError, match=r"'code:\d'.*'code:\d' disagree.* 17\.\d %") as error:
        align(reconstruction, sightings, sides_m=SIDE_M, rng=rng())
    assert "170." in str(error.value) or "235." in str(error.value)
    assert "measure" in str(error.value)


def test_of_three_codes_the_wrongly_printed_one_is_named_and_left_out():
    reconstruction, sightings, truth = capture(
        rng(5), codes=wall_codes(3), sides_m={"code:1": 0.19}
    )
    alignment = align(reconstruction, sightings, sides_m=SIDE_M, rng=rng())
    assert [a.payload for a in alignment.anchors] == ["code:0", "code:2"]
    (warning,) = alignment.warnings
    assert "'code:1' is not used" in warning
    assert "190." in warning
    assert alignment.metres_per_unit()[0] == pytest.approx(truth.scale, rel=3e-3)


def test_a_code_that_was_moved_is_told_with_the_distance():
    codes = wall_codes(3)
    there = Pose(codes["code:0"].rotation, codes["code:0"].translation + np.array([0.3, 0, 0]))
    reconstruction, sightings, truth = capture(
        rng(6), codes=codes, moved=("code:0", 10, there), frames=60
    )
    alignment = align(reconstruction, sightings, sides_m=SIDE_M, rng=rng())
    warning = next(w for w in alignment.warnings if "moved" in w)
    assert "'code:0' was moved" in warning
    distance_mm = float(warning.split(" mm away")[0].split()[-1])
    assert distance_mm == pytest.approx(300, abs=15)
    assert alignment.metres_per_unit()[0] == pytest.approx(truth.scale, rel=3e-3)


def test_one_photo_is_not_enough():
    reconstruction, sightings, _ = capture(rng(7), codes=wall_codes(1))
    lonely = dataclasses.replace(sightings[0], sightings=sightings[0].sightings[:1])
    with pytest.raises(ValueError, match=r"'code:0' is not used: it was measured in 1 photo"):
        align(reconstruction, [lonely], sides_m=SIDE_M, rng=rng())


def test_photos_from_one_place_are_not_enough():
    reconstruction, sightings, _ = capture(rng(7), codes=wall_codes(1))
    first, second = (s.view for s in sightings[0].sightings[:2])
    by_name = {v.name: v for v in reconstruction.views}
    beside = dataclasses.replace(by_name[first], name=second)
    views = tuple(beside if v.name == second else v for v in reconstruction.views)
    still = dataclasses.replace(reconstruction, views=views)
    seen = sightings[0].sightings[0]
    same = (seen, dataclasses.replace(seen, view=second))
    with pytest.raises(ValueError, match=r"almost one place.*half a metre apart"):
        align(still, [dataclasses.replace(sightings[0], sightings=same)], sides_m=0.2, rng=rng())


def test_no_code_says_what_to_do():
    reconstruction, _, _ = capture(rng(8), codes={})
    with pytest.raises(ValueError, match=r"None was found.*Film a printed code.*two points"):
        align(reconstruction, [], sides_m=SIDE_M, rng=rng())


def test_a_mirrored_code_says_so():
    reconstruction, _, _ = capture(rng(8), codes={})
    mirrored = AnchorSightings("code:0", None, (), (Refusal("000.jpg", "it is mirrored"),))
    with pytest.raises(ValueError, match=r"in 000\.jpg it is mirrored"):
        align(reconstruction, [mirrored], sides_m=SIDE_M, rng=rng())


def test_a_code_without_a_side_is_not_used():
    reconstruction, sightings, _ = capture(rng(9), codes=wall_codes(2))
    alignment = align(reconstruction, sightings, sides_m={"code:1": SIDE_M}, rng=rng())
    assert [a.payload for a in alignment.anchors] == ["code:1"]
    assert any("'code:0' is not used: its printed side" in w for w in alignment.warnings)


@pytest.mark.parametrize("side_m", [0.0, -0.2, np.nan, 200.0])
def test_a_side_that_is_no_length_is_refused(side_m):
    reconstruction, sightings, _ = capture(rng(9), codes=wall_codes(1))
    with pytest.raises(ValueError, match=r"side .* wanted 0.005 to 5; give metres"):
        align(reconstruction, sightings, sides_m=side_m, rng=rng())


def test_the_prediction_follows_the_covariance():
    """Worlds drawn from the covariance are off by as much as is predicted."""
    reconstruction, sightings, _ = capture(rng(10), codes=wall_codes(1))
    alignment = dataclasses.replace(
        align(reconstruction, sightings, sides_m=SIDE_M, rng=rng()),
        bend_per_metre=0.0,
        groups=10**6,
    )
    drawn = rng().multivariate_normal(np.zeros(7), alignment.covariance, 4000)
    off = np.stack(
        [PLACES @ rotation_from_vector(d[:3]).T * np.exp(d[6]) + d[3:6] - PLACES for d in drawn]
    )
    lengths = np.linalg.norm(off, axis=2)
    np.testing.assert_allclose(
        np.sqrt((lengths**2).mean(axis=0)), alignment.predicted_error_m(PLACES), rtol=0.06
    )
    inside = (lengths < alignment.predicted_error_m(PLACES, bound=0.95)).mean(axis=0)
    np.testing.assert_allclose(inside, 0.95, atol=0.015)
