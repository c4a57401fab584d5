"""Hypotheses tried if an object was not found as expected."""

from types import SimpleNamespace

import numpy as np

import tracking.follow.local_search
from scenes.pose import Pose
from tracking.hypotheses.budget import NOMINAL_COSTS
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
