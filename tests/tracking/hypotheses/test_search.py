"""Proposals, their screening and refinement, and the prior, in filmed meshes."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.background.images import LensExposures
from tracking.evidence.observation import observe
from tracking.hypotheses.budget import BudgetExhausted, FrameBudget
from tracking.hypotheses.hypothesis import apart
from tracking.hypotheses.lens_look import look_through
from tracking.hypotheses.prior import (
    LIKE_BEFORE,
    MOVED,
    UNSEEN,
    distinguishable_places,
    moved_log_prior,
    stayed_log_prior,
)
from tracking.hypotheses.proposals import (
    MIN_RADIUS_PX,
    cuts_at,
    likeliest_at_each,
    places_on,
    proposed,
)
from tracking.hypotheses.refinement import align, coarse, refine
from tracking.hypotheses.screening import (
    ALIGNED_AT_A_PLACE,
    Rough,
    of_all_places,
    ranked_both_ways,
)
from tracking.hypotheses.search import (
    TURNED,
    align_in_window,
    best_places,
    less_shade,
    search,
    window_about,
    worth_turning,
)
from tracking.hypotheses.yaws import likeliest_yaws
from tracking.model.support_planes import EVERYWHERE_M
from tracking.model.templates import Cuts, compare

HEIGHTS = (0.74,)


def off(pose, true):
    """Metres and degrees."""
    return apart(pose, true), abs(math.degrees(wrap_angle(pose.yaw() - true.yaw())))


@pytest.fixture(scope="module")
def look(table, mug_elsewhere):
    scene, _ = mug_elsewhere
    return look_through(scene, 0, table.models["mug-1"], table.neighbours("mug-1"))


def test_places_are_on_the_plane_in_view_and_large_enough_to_be_seen(table, mug_elsewhere, look):
    scene, now = mug_elsewhere
    model = table.models["mug-1"]
    (places,) = places_on(scene, [look], model, HEIGHTS)
    assert set(places[:, 2]) == {0.74}
    assert np.linalg.norm(places - now.translation, axis=1).min() < 0.06
    eye = look.world_from_lens.translation
    distance = np.linalg.norm(places + model.centre_m - eye, axis=1)
    assert (look.camera.f_px * model.radius_m / distance >= MIN_RADIUS_PX).all()
    tiny = replace(model, radius_m=0.001)
    assert len(places_on(scene, [look], tiny, HEIGHTS)[0]) == 0


def test_where_nothing_changed_no_place_is_proposed(table, mug_elsewhere, look):
    scene, _ = mug_elsewhere
    same = np.zeros_like(look.picture)
    (places,) = places_on(scene, [replace(look, picture=same)], table.models["mug-1"], HEIGHTS)
    assert len(places) == 0


def test_the_true_place_is_proposed(table, mug_elsewhere, look):
    scene, now = mug_elsewhere
    model = table.models["mug-1"]
    (places,) = places_on(scene, [look], model, HEIGHTS)
    halves = [cuts_at(look, model, half) for half in np.array_split(places, 2)]
    whole = Cuts.joined(halves)
    np.testing.assert_array_equal(whole.own, cuts_at(look, model, places).own)
    similar = compare(whole, model.templates)
    poses = proposed(look, model, places, whole, similar)
    assert min(apart(pose, now) for pose in poses) < 0.06
    everywhere = likeliest_at_each(model, places, whole, similar)
    assert {tuple(pose.translation) for pose in everywhere} == {tuple(place) for place in places}
    assert len(everywhere) == 2 * len(places)
    none = whole.some(np.zeros(0, np.intp))
    assert proposed(look, model, places[:0], none, compare(none, model.templates)) == []


def test_an_alignment_and_a_refinement_come_to_the_true_pose(table, as_scanned):
    true = table.poses["book-1"]
    model = table.models["book-1"]
    start = Pose.from_yaw(true.yaw() + 0.15, true.translation + np.array([0.025, -0.02, 0.0]))
    evidence = table.evidence(as_scanned, "book-1", start)
    observation = observe(as_scanned, evidence)
    rough = align(coarse(observation, model, start), model, start, as_scanned)
    assert apart(rough, true) < 0.6 * apart(start, true)
    found = refine(as_scanned, model, start, evidence, observation)
    metres, degrees = off(found.world_from_object, true)
    assert metres < 0.01
    assert degrees < 2.0
    assert found.support.nats > 10.0


def test_the_right_yaw_is_among_the_likeliest(table, as_scanned):
    true = table.poses["book-1"]
    turned = Pose.from_yaw(true.yaw() + 2.0, true.translation)
    evidence = table.evidence(as_scanned, "book-1", turned)
    yaws = likeliest_yaws(table.models["book-1"], evidence, turned)
    assert 1 <= len(yaws) <= 4
    assert min(off(pose, true)[1] for pose in yaws) < 16.0


def test_a_book_beside_its_place_is_found_with_large_odds(table):
    true = Pose.from_yaw(table.poses["book-1"].yaw() + 0.8, (-0.37, 0.37, 0.74))
    task = table.task(table.scene({"book-1": true}), "book-1", state=TrackState.LOST)
    budget = FrameBudget()
    found = search(
        task.scene,
        task.model,
        task.neighbours,
        support_heights_m=table.support_planes.heights_m,
        world_from_last=table.poses["book-1"],
        budget=budget,
    )
    metres, degrees = off(found[0].world_from_object, true)
    assert metres < 0.015
    assert degrees < 3.0
    assert found[0].log_odds > 5.0
    assert all(a.log_odds >= b.log_odds for a, b in pairwise(found))


def test_a_search_waits_where_its_budget_ends(table, mug_elsewhere):
    scene, _ = mug_elsewhere
    task = table.task(scene, "mug-1", state=TrackState.LOST)
    budget = FrameBudget(1.0)
    with pytest.raises(BudgetExhausted):
        search(
            scene,
            task.model,
            task.neighbours,
            support_heights_m=HEIGHTS,
            world_from_last=table.poses["mug-1"],
            budget=budget,
        )
    assert len(budget.done()) == 1


def test_the_prior_shares_what_moved_among_all_places(table, as_scanned):
    book, mug = table.models["book-1"], table.models["mug-1"]
    heights = table.support_planes.heights_m
    here = table.poses["book-1"]
    many = distinguishable_places(as_scanned, mug, heights)
    few = distinguishable_places(as_scanned, book, heights)
    ratio = (book.radius_m / mug.radius_m) ** 2
    assert many == pytest.approx(ratio * few, rel=1e-6)
    above = distinguishable_places(as_scanned, book, [h for h in heights if h > EVERYWHERE_M])
    near = moved_log_prior(as_scanned, book, heights, world_from_last=here, world_from_now=here)
    assert near == pytest.approx(math.log(LIKE_BEFORE * MOVED / UNSEEN) - math.log(above))
    below = Pose(here.rotation, here.translation * [1.0, 1.0, 0.0])
    on_floor = moved_log_prior(
        as_scanned, book, heights, world_from_last=below, world_from_now=below
    )
    assert on_floor == pytest.approx(
        math.log((1.0 - LIKE_BEFORE) * MOVED / UNSEEN) - math.log(few - above)
    )
    far = Pose(here.rotation, here.translation + np.array([2.0, 0.0, 0.0]))
    assert (
        moved_log_prior(as_scanned, book, heights, world_from_last=here, world_from_now=far) < near
    )
    assert stayed_log_prior() > 0.0


def test_many_good_poses_of_one_place_do_not_crowd_out_another(table):
    model = table.models["mug-1"]
    # A wrong place with a large silhouette has many rough poses, all likelier than the right one.
    crowd = [Rough(50.0 - k, Pose.from_yaw(0.3 * k, (0.0, 0.0, 0.74)), 0, 0.5) for k in range(20)]
    right = Rough(20.0, Pose.from_yaw(0.0, (1.0, 0.0, 0.74)), 0, 0.5)
    chosen = of_all_places(model, [*crowd, right])
    assert right in chosen
    assert len(chosen) == ALIGNED_AT_A_PLACE + 1
    assert chosen[0] == crowd[0]
    # However unlikely it roughly is, its place is compared by the likelihood itself.
    assert best_places(model, chosen) == [crowd[0].world_from_object, right.world_from_object]


def test_what_shows_all_of_a_small_object_ranks_beside_what_shows_half_of_a_large_one():
    shades = [Rough(60.0 - k, Pose.identity(), 0, 0.7) for k in range(4)]
    right = Rough(15.0, Pose.from_yaw(1.0, (1.0, 0.0, 0.0)), 0, 1.2)
    assert ranked_both_ways([*shades, right])[:2] == [shades[0], right]
    assert len(ranked_both_ways([*shades, right])) == 5


@pytest.mark.parametrize("times", [0.6, 1.4])
def test_other_light_on_a_table_accounts_for_a_place_and_not_for_a_mug_there(
    table, no_mug, mug_elsewhere, times
):
    scene, now = mug_elsewhere
    model, beside = table.models["mug-1"], table.neighbours("mug-1")
    frame, images = no_mug.frame, []
    for rig_from_lens, lens, image in zip(
        frame.rig.rig_from_lens, frame.rig.lenses, frame.images, strict=True
    ):
        centre = (no_mug.world_from_rig @ rig_from_lens).inverse() @ model.centre_at(now)[None]
        (pixel,), (is_seen,) = lens.project(centre)
        y, x = np.mgrid[: image.shape[0], : image.shape[1]]
        is_lit = (np.hypot(x - pixel[0], y - pixel[1]) < 60) & is_seen
        images.append(np.where(is_lit[..., None], np.clip(times * image, 0, 255), image))
    lit_images = tuple(image.astype(np.uint8) for image in images)
    lit = replace(
        no_mug,
        frame=replace(frame, images=lit_images),
        exposures=LensExposures(lit_images, table.background),
    )

    def aligned_in(scene):
        window = window_about(scene, model, beside, now)
        return less_shade(scene, model, aligned=align_in_window(scene, model, window, now))

    (mug_nats, _, mug), (light_nats, _, light) = aligned_in(scene), aligned_in(lit)
    assert mug_nats > 4.0 * mug.shade_nats
    assert light_nats < 0.0
    assert light.shade_nats > 3.0


@pytest.mark.parametrize(
    ("nats", "turned"),
    [
        # The chair at another yaw, then slivers behind a curtain.
        ((-20.0, 3.3, 1.2, 2.0, -4.0), [1, 3, 0]),
        ((27.0, 3.0, 22.0, -8.0, 1.0), [0, 2]),
        ((2.0, 27.0, 1.0), [1, 0]),
        ((-3.0,), [0]),
    ],
)
def test_all_yaws_are_compared_at_the_place_that_shows_most_roughly(nats, turned):
    compared = [(value, None, None) for value in nats]
    chosen = worth_turning(compared)
    assert [compared.index(item) for item in chosen] == turned
    assert len(chosen) <= TURNED
