"""Portraits: what a faulty scan lacks is taken from the picture of the object at rest."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import tracking.follow.follow
import tracking.follow.outcome
from scenes.pose import Pose
from scenes.state import ObjectModel
from tests.tracking.evidence.test_rendering import BOX_M, at, box, seen
from tests.tracking.evidence.test_rendering import model as model
from tests.tracking.evidence.test_rendering import renderer as renderer
from tracking.evidence.appearance_memory import applied_to, remember_appearance
from tracking.evidence.rendering import RenderingCache, draw
from tracking.model.object_model import make_model

REST = at(0.0, 0.2, 1.2)


@pytest.fixture(scope="module")
def faulty(renderer):
    """The same box with all colours wrong."""
    cloud = box()
    dull = replace(cloud, sh=-cloud.sh)
    return make_model(ObjectModel("b", "box", "", dull, BOX_M, 0.0, Pose.identity()), renderer)


@pytest.fixture(scope="module")
def appearance(model, faulty, renderer):
    """Of the real box, drawn by the faulty scan of it."""
    evidence = seen(model, REST)
    real = draw(model, REST, evidence, renderer)
    shown = replace(evidence, live=real.rgb, foreground=real.alpha)
    drawn = draw(faulty, REST, evidence, renderer)
    return remember_appearance(shown, drawn, REST, radius_m=faulty.radius_m)


def apart(appearance, model, faulty, renderer, pose):
    """Mean colour difference to the real box without and with its portrait."""
    evidence = seen(model, pose)
    real = draw(model, pose, evidence, renderer)
    plain = draw(faulty, pose, evidence, renderer)
    laid = RenderingCache(None, appearance).drawn(faulty, pose, evidence, renderer)
    inside = real.alpha > 0.9
    return [float(np.abs(picture.rgb - real.rgb)[inside].mean()) for picture in (plain, laid)]


@pytest.mark.parametrize(
    ("pose", "most"),
    [(REST, 0.3), (at(0.0, 0.2, 1.2, 8.0), 0.6), (at(0.15, 0.1, 1.3, -8.0), 0.6)],
)
def test_wrong_colours_are_put_right_while_the_object_is_seen_from_about_there(
    appearance, model, faulty, renderer, pose, most
):
    plain, laid = apart(appearance, model, faulty, renderer, pose)
    assert laid < most * plain


def test_an_appearance_memory_says_nothing_of_other_sides(appearance, model, faulty, renderer):
    evidence = seen(model, at(0.0, 0.2, 1.2, 60.0))
    pose = at(0.0, 0.2, 1.2, 60.0)
    laid = RenderingCache(None, appearance).drawn(faulty, pose, evidence, renderer)
    np.testing.assert_array_equal(laid.rgb, draw(faulty, pose, evidence, renderer).rgb)
    assert appearance.view_weight(appearance.camera_from_object) == 1.0
    turns = [
        appearance.view_weight(evidence_of(model, at(0.0, 0.2, 1.2, deg)))
        for deg in (0, 25, 35, 60)
    ]
    assert turns == sorted(turns, reverse=True)


@pytest.mark.parametrize("pose", [REST, at(0.0, 0.2, 1.2, 25.0), at(0.15, 0.1, 1.3, -8.0)])
@pytest.mark.parametrize("distortion", [(0.0,) * 4, (0.02, -0.01, 0.002, 0.0)])
def test_the_kernel_lays_on_what_its_twin_does(appearance, faulty, renderer, pose, distortion):
    evidence = seen(faulty, pose)
    camera = replace(evidence.camera, distortion=distortion)
    camera_from_object = evidence.world_from_camera.inverse() @ pose
    drawn = draw(faulty, pose, evidence, renderer)
    found = appearance.applied_to(drawn, camera, camera_from_object)
    wanted = applied_to(appearance, drawn, camera, camera_from_object)
    assert np.abs(wanted.rgb - drawn.rgb).max() > 0.1
    np.testing.assert_allclose(found.rgb, wanted.rgb, atol=2e-4)


def test_an_appearance_memory_of_another_size_than_its_lens_is_refused(
    appearance, faulty, renderer
):
    evidence = seen(faulty, REST)
    drawn = draw(faulty, REST, evidence, renderer)
    camera_from_object = evidence.world_from_camera.inverse() @ REST
    cut = replace(appearance, shown=np.ascontiguousarray(appearance.shown[1:]))
    with pytest.raises(ValueError, match="shown"):
        cut.applied_to(drawn, evidence.camera, camera_from_object)


def evidence_of(model, pose):
    return seen(model, pose).world_from_camera.inverse() @ pose


def test_what_covers_an_object_is_not_remembered_as_its_own(model, faulty, renderer):
    evidence = seen(model, REST)
    real = draw(model, REST, evidence, renderer)
    hidden = np.ones_like(real.alpha)
    shown = replace(evidence, live=real.rgb, foreground=real.alpha, hidden=hidden)
    drawn = draw(faulty, REST, evidence, renderer)
    appearance = remember_appearance(shown, drawn, REST, radius_m=faulty.radius_m)
    assert not appearance.shown[..., 3].any()


def test_a_reduced_rendering_of_another_appearance_memory_does_not_serve(
    appearance, faulty, renderer
):
    evidence = seen(faulty, REST)
    plain = RenderingCache().at(faulty, REST, evidence, renderer)
    laid = RenderingCache(plain, appearance).at(faulty, REST, evidence, renderer)
    assert laid is not plain
    assert laid.appearance is appearance
    assert RenderingCache(laid, appearance).at(faulty, REST, evidence, renderer) is laid
    assert np.abs(laid.colours - plain.colours).mean() > 0.05


@pytest.mark.parametrize(
    ("view_weight", "colour_correlation", "renewed"),
    [(1.0, 0.8, False), (0.6, 0.8, True), (0.6, 0.3, False), (0.0, 0.8, False)],
)
def test_an_appearance_memory_is_renewed_while_the_object_is_still_recognised_by_it(
    view_weight, colour_correlation, renewed
):
    reduced = SimpleNamespace(
        appearance=SimpleNamespace(view_weight=lambda _: view_weight), camera_from_object=None
    )
    fit = SimpleNamespace(reduced=reduced, colour_correlation=colour_correlation)
    assert tracking.follow.outcome._turns_away_from_memory(fit) == renewed


@pytest.mark.parametrize(("height_m", "taken_up"), [(0.74, False), (0.77, True), (1.2, True)])
def test_what_stood_and_hangs_in_the_air_was_taken_up(height_m, taken_up):
    task = SimpleNamespace(
        track=SimpleNamespace(world_from_object=Pose.from_yaw(0.0, (0.0, 0.0, 0.74))),
        support_heights_m=(0.0, 0.74),
    )
    fit = SimpleNamespace(world_from_object=Pose.from_yaw(0.0, (0.0, 0.0, height_m)))
    assert tracking.follow.follow._was_taken_up(task, fit) == taken_up


def test_what_rests_where_it_was_remembered_is_not_remembered_again(faulty, renderer):
    evidence = seen(faulty, REST)
    drawn = draw(faulty, REST, evidence, renderer)
    appearance = remember_appearance(evidence, drawn, REST, radius_m=faulty.radius_m)
    assert appearance.is_valid_at(REST @ Pose.from_yaw(0.001, (0.0004, 0.0, 0.0)))
    assert not appearance.is_valid_at(REST @ Pose.from_yaw(0.0, (0.003, 0.0, 0.0)))
    assert not appearance.is_valid_at(REST @ Pose.from_yaw(0.02))
    assert not replace(appearance, was_at_rest=False).is_valid_at(REST)
