"""The one likelihood, on filmed meshes: it prefers what is true, and ignores what is hidden."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenes.pose import Pose
from tracking.evidence.observation import observation_of, observe
from tracking.kernels.native import PoseLikelihood
from tracking.likelihood import pose_likelihood
from tracking.likelihood.drawn_object import claim, draw_object
from tracking.likelihood.pixel_model import EXACTLY, FOREIGN, NOT_IN_VIEW, ROUGHLY, for_native
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.misfit import MAX_MISFIT
from tracking.model.relighting import LIGHT_SIGMA


def support(table, scene, name, pose, **changed):
    """Support of a pose in its own window, of an observation with some fields changed."""
    observation = observe(scene, table.evidence(scene, name, pose))
    observation = replace(observation, **{k: f(observation) for k, f in changed.items()})
    return pose_support(observation, table.models[name], pose, table.renderer)


@pytest.mark.parametrize("name", ["book-1", "mug-1", "box-1"])
def test_the_true_pose_is_likelier_than_absence_and_than_poses_beside_it(table, as_scanned, name):
    true = table.poses[name]
    right = support(table, as_scanned, name, true)
    assert right.nats > 3.0
    assert right.open_fraction > 0.95
    radius_m = table.models[name].radius_m
    for x, y in ((0.5, 0.0), (0.0, 0.5), (-0.5, 0.0)):
        beside = Pose(true.rotation, true.translation + radius_m * np.array([x, y, 0.0]))
        assert support(table, as_scanned, name, beside).nats < right.nats - 2.0


def test_what_a_near_pose_may_cover_is_no_surroundings(table, as_scanned):
    """A chair's shadow passed for something unknown in front of it, but not 20 cm nearer."""
    model, true, renderer = table.models["box-1"], table.poses["box-1"], table.renderer
    seen = observe(as_scanned, table.evidence(as_scanned, "box-1", true))
    reach_m = 0.3 * model.radius_m
    claimed = claim(seen, model, world_from_object=true, renderer=renderer, reach_m=reach_m)
    near = claimed.claimed > 0.5
    drawn = draw_object(seen, model, true, renderer)
    assert near[drawn.part].sum() > 1.3 * drawn.colours.alpha.sum() / drawn.finer**2
    assert not near.all()
    # Something beside it, no farther, and no edge between.
    shade = {"live": np.full_like(seen.live, 0.3), "foreground": near.astype(np.float32)}
    alone, among = (
        pose_support(replace(window, **shade), model, true, renderer).unknown_fraction
        for window in (seen, claimed)
    )
    assert among < 0.1 < 0.4 < alone


def test_a_printed_book_is_likelier_at_its_yaw_than_turned_by_half(table, as_scanned):
    true = table.poses["book-1"]
    turned = Pose.from_yaw(true.yaw() + math.pi, true.translation)
    right, wrong = (support(table, as_scanned, "book-1", pose) for pose in (true, turned))
    assert right.nats > wrong.nats + 5.0


def test_where_the_empty_room_shows_an_object_is_unlikely(table, no_mug):
    gone = support(table, no_mug, "mug-1", table.poses["mug-1"])
    assert gone.nats < -3.0


def test_what_a_nearer_surface_of_the_room_hides_says_nothing(table, no_mug):
    true = table.poses["mug-1"]
    near = support(table, no_mug, "mug-1", true, range_m=lambda o: np.full_like(o.range_m, 0.1))
    assert near.nats == pytest.approx(0.0, abs=0.1)
    assert near.open_fraction == pytest.approx(0.0, abs=0.01)
    hidden = support(table, no_mug, "mug-1", true, hidden=lambda o: np.ones_like(o.hidden))
    assert hidden.nats == 0.0


def test_a_flat_patch_of_something_unknown_is_little_evidence(table, no_mug):
    """A plain object in front of a plain passer-by: any colour could be the passer-by's own."""

    def flat(observation):
        return np.full_like(observation.live, 0.4)

    def changed(observation):
        return np.ones_like(observation.changed)

    def unlike_room(observation):
        return np.full_like(observation.room_misfit, MAX_MISFIT)

    def smooth(observation):
        return np.zeros_like(observation.foreign_misfit)

    passer_by = support(
        table,
        no_mug,
        "mug-1",
        table.poses["mug-1"],
        live=flat,
        changed=changed,
        foreground=changed,
        room_misfit=unlike_room,
        foreign_misfit=smooth,
    )
    assert passer_by.nats < -math.log(FOREIGN) * passer_by.samples


def in_shade(observation, shade):
    """An observation whose live picture is darker by (H, W) factors, which nobody expected."""
    live = (observation.live * shade[..., None]).astype(np.float32)
    return observation_of(
        live,
        observation.empty,
        observation.expected,
        np.clip(observation.changed + (shade < 0.9), 0.0, 1.0).astype(np.float32),
        hidden=observation.hidden,
        range_m=observation.range_m,
        camera=observation.camera,
        world_from_camera=observation.world_from_camera,
        lens_px=observation.lens_px,
        in_any_light=True,
    )


def test_a_shade_is_no_object_unless_it_has_its_shape(table, no_mug):
    """A plain object may be in any light, so it fits any shade; but so does the room."""
    model, true = table.models["mug-1"], table.poses["mug-1"]
    observation = observe(no_mug, table.evidence(no_mug, "mug-1", true))
    drawn = draw_object(observation, model, true, table.renderer)
    height, width = (side.stop - side.start for side in drawn.part)
    outline = np.zeros(observation.changed.shape, np.float32)
    outline[drawn.part] = cv2.resize(drawn.colours.alpha, (width, height)) > 0.5
    everywhere, shaped = (
        pose_support(in_shade(observation, shade), model, true, table.renderer).nats
        for shade in (np.full(outline.shape, 0.55), 1.0 - 0.45 * outline)
    )
    assert everywhere < 0.1
    assert shaped > everywhere + 0.3


def test_nats_are_those_of_independent_samples(table, as_scanned, monkeypatch):
    true = table.poses["book-1"]
    once = support(table, as_scanned, "book-1", true)
    monkeypatch.setattr(pose_likelihood, "SHARED_PX", 0.0)
    monkeypatch.setattr(pose_likelihood, "SHARED_M", 2.0 * pose_likelihood.SHARED_M)
    other = support(table, as_scanned, "book-1", true)
    assert once.samples != other.samples
    assert once.nats / once.samples == pytest.approx(other.nats / other.samples, rel=0.25)


def test_a_light_that_no_room_has_costs_its_prior(table, as_scanned, monkeypatch):
    true = table.poses["book-1"]
    free = support(table, as_scanned, "book-1", true)
    firm = {**for_native(), "light_sigma": tuple(0.01 * s for s in LIGHT_SIGMA)}
    monkeypatch.setattr(pose_likelihood, "LIKELIHOOD", PoseLikelihood(firm))
    held = support(table, as_scanned, "book-1", true)
    assert held.nats < free.nats


def test_the_rough_likelihood_forgives_what_the_exact_one_does_not(table, as_scanned):
    true = table.poses["book-1"]
    off = Pose.from_yaw(true.yaw() + 0.15, true.translation + np.array([0.02, 0.01, 0.0]))
    observation = observe(as_scanned, table.evidence(as_scanned, "book-1", true))
    model = table.models["book-1"]
    share = []
    for tolerance in (EXACTLY, ROUGHLY):
        right, rough = (
            pose_support(observation, model, pose, table.renderer, tolerance=tolerance).nats
            for pose in (true, off)
        )
        share.append(rough / right)
    assert share[1] > share[0]


def test_a_pose_outside_the_window_is_not_in_view(table, as_scanned):
    observation = observe(as_scanned, table.evidence(as_scanned, "mug-1", table.poses["mug-1"]))
    far = Pose.from_yaw(0.0, (30.0, 30.0, 0.0))
    assert pose_support(observation, table.models["mug-1"], far, table.renderer) == NOT_IN_VIEW
