"""Hypotheses tried if an object was not found as expected."""

from types import SimpleNamespace

import numpy as np

import tracking.follow.local_search
from scenes.pose import Pose
from scenes.state import TrackState
from tracking.evidence.observation import observe
from tracking.follow.belief import weigh_measurement
from tracking.follow.local_search import climb_beside
from tracking.hypotheses.budget import NOMINAL_COSTS
from tracking.hypotheses.refinement import fit_at
from tracking.solve.gauss_newton import Prior


def test_the_likeliest_hypothesis_is_tried_in_every_frame_and_all_others_in_turn():
    prior = Prior(np.zeros(4), np.full(4, 0.1))
    tried = []
    for seq in range(12):
        frame = SimpleNamespace(t_ns=33_000_000 * (seq + 1), seq=seq)
        task = SimpleNamespace(
            costs=NOMINAL_COSTS,
            model=SimpleNamespace(symmetry=1),
            scene=SimpleNamespace(frame=frame),
            interval_ns=33_000_000,
        )
        poor = SimpleNamespace(
            textured=False, contour_score=0.1, visible_fraction=0.9, colour_correlation=0.0
        )
        hypotheses = tracking.follow.local_search._hypotheses(task, [prior], Pose.identity(), poor)
        first = hypotheses[0].start_world_from_object
        assert first.yaw() == 0.0
        assert first.translation[2] == 0.0
        tried += [
            (round(g.start_world_from_object.yaw(), 2), g.start_world_from_object.translation[2])
            for g in hypotheses
        ]
    assert len(set(tried)) == 6


def test_a_measurement_that_went_astray_is_taken_back_and_a_right_one_stays(table, as_scanned):
    """A solver follows the edges of a shadow, and of who carries the object, too."""
    model, true = table.models["book-1"], table.poses["book-1"]
    task = table.task(as_scanned, "book-1", state=TrackState.TRACKED, usual_rate=1.2)

    def found(pose):
        evidence = table.evidence(as_scanned, "book-1", pose)
        fit = fit_at(as_scanned, model, evidence, pose)
        belief = weigh_measurement(task, observe(as_scanned, evidence), fit)
        return belief, climb_beside(
            task, belief, evidence=evidence, predicted_world_from_object=pose
        )

    right, kept = found(true)
    assert kept is right
    aside_m = 0.3 * model.radius_m
    astray, back = found(Pose(true.rotation, true.translation + np.array([aside_m, 0.0, 0.0])))
    assert back.found.nats > astray.found.nats
    apart = back.fit.world_from_object.translation - true.translation
    assert np.linalg.norm(apart) < 0.4 * aside_m
