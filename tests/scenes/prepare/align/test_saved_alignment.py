import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.align.alignment import Alignment, Anchor
from scenes.prepare.align.gravity import Gravity
from scenes.prepare.align.saved_alignment import FILE, load_alignment, save_alignment
from scenes.prepare.align.similarity import Similarity


def alignment(gravity):
    rng = np.random.default_rng(0)
    half = rng.normal(size=(7, 7))
    pose = Pose.from_yaw(0.3, (1.0, 2.0, 1.5))
    anchor = Anchor("room:1", 0.2, pose, rng.normal(size=(4, 3)), 0.1, 0.2, 0.3, ("a.jpg", "b.jpg"))
    return Alignment(
        Similarity(2.3, pose.rotation, rng.normal(size=3)),
        half @ half.T,
        (anchor,),
        gravity,
        17,
        rng.normal(size=(2, 3)),
        0.001,
        ("Mind the gap.",),
    )


@pytest.mark.parametrize(
    "gravity",
    [
        None,
        Gravity(np.array([0.0, 0.6, 0.8]), -1.2, 0.1, 0.01, 90),
        Gravity(np.eye(3)[2], 0.0, 3.0, np.inf, 0),
    ],
)
def test_it_comes_back_to_the_same_bits(gravity, tmp_path):
    saved = alignment(gravity)
    save_alignment(saved, tmp_path)
    back = load_alignment(tmp_path)
    a, b = saved.world_from_reconstruction, back.world_from_reconstruction
    assert a.scale == b.scale
    assert np.array_equal(a.matrix(), b.matrix())
    assert np.array_equal(saved.covariance, back.covariance)
    assert np.array_equal(saved.references_m, back.references_m)
    assert (saved.groups, saved.bend_per_metre, saved.warnings) == (
        back.groups,
        back.bend_per_metre,
        back.warnings,
    )
    (first,), (second,) = saved.anchors, back.anchors
    assert np.array_equal(first.world_from_code.matrix(), second.world_from_code.matrix())
    assert np.array_equal(first.corners_m, second.corners_m)
    assert (first.payload, first.side_m, first.views) == (
        second.payload,
        second.side_m,
        second.views,
    )
    assert (first.residual_px, first.residual_mm, first.corner_mm) == (
        second.residual_px,
        second.residual_mm,
        second.corner_mm,
    )
    if gravity is None:
        assert back.gravity is None
    else:
        assert back.gravity is not None
        assert np.array_equal(back.gravity.up, gravity.up)
        assert back.gravity.floor_sigma == gravity.floor_sigma
    points = np.random.default_rng(1).normal(size=(9, 3))
    assert np.array_equal(
        saved.predicted_error_m(points, bound=0.95), back.predicted_error_m(points, bound=0.95)
    )


@pytest.mark.parametrize("text", [None, "", "{", "[]", '{"anchors": 3}'])
def test_a_damaged_file_is_refused(text, tmp_path):
    if text is not None:
        (tmp_path / FILE).write_text(text)
    with pytest.raises(ValueError, match="no saved alignment"):
        load_alignment(tmp_path)
