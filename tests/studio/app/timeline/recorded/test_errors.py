import math
from dataclasses import replace

import numpy as np
import pytest

from devices.session_info import ScenarioChange
from scenes.pose import Pose
from studio.app.timeline.opening import open_recording
from studio.app.timeline.recorded.columns import pose_row
from studio.app.timeline.recorded.errors import error_curves, first_failure, symmetries
from studio.app.timeline.recorded.spans import fault_spans, state_spans
from studio.evaluate.metrics import pose_error, pose_errors

SCENARIO = """room = "lab"
duration_s = 1.2
[faults]
[[faults.blur]]
px = 4.0
from_s = 0.3
to_s = 0.6
"""


@pytest.mark.parametrize("symmetry", [0, 1, 2, 4])
def test_many_errors_are_those_of_each(symmetry):
    rng = np.random.default_rng(1)
    yaws = rng.uniform(-math.pi, math.pi, (30, 2))
    poses = [[Pose.from_yaw(yaw, rng.normal(size=3)) for yaw in pair] for pair in yaws]
    cm, degrees = pose_errors(
        np.array([pose_row(a) for a, _ in poses]),
        np.array([pose_row(b) for _, b in poses]),
        symmetry=symmetry,
    )
    each = [pose_error(a, b, symmetry=symmetry) for a, b in poses]
    assert cm == pytest.approx([error.world_cm for error in each])
    assert degrees == pytest.approx([error.yaw_deg for error in each])


def test_curves_know_the_tracker_s_error_and_the_stool_s_symmetry(index, tiny):
    curves = error_curves(index, symmetries(tiny.scene.objects))
    assert curves["chair-1"].world_cm == pytest.approx([3.0] * tiny.frames)
    assert curves["chair-1"].yaw_deg == pytest.approx([math.degrees(0.02)] * tiny.frames)
    assert curves["stool-1"].yaw_deg == pytest.approx([0.0] * tiny.frames)
    assert curves["chair-1"].counts.tolist() == [n >= tiny.starts for n in range(tiny.frames)]
    assert not curves["stool-1"].counts.any()


def test_the_first_failure_is_of_what_has_moved(index, tiny):
    curves = error_curves(index, symmetries(tiny.scene.objects))
    assert first_failure(index, curves) is None
    off = replace(curves["chair-1"], world_cm=curves["chair-1"].world_cm * 4)
    failure = first_failure(index, {**curves, "chair-1": off})
    assert (failure.t_ns, failure.object_id) == (tiny.starts * 10**8, "chair-1")
    assert "12.0 cm" in failure.text


def test_states_are_spans(index, tiny):
    spans = state_spans(index.tracks["chair-1"], end_ns=index.end_ns)
    assert [(s.from_ns // 10**8, s.to_ns // 10**8, s.state.value) for s in spans] == [
        (0, 6, "tracked"),
        (6, 9, "occluded"),
        (9, 11, "tracked"),
    ]


def test_faults_are_those_of_the_scenario(index):
    session = replace(index.session, scenario=SCENARIO)
    found = fault_spans(replace(index, session=session))
    assert [(s.name, s.from_ns, s.to_ns) for s in found] == [("blur", 3 * 10**8, 6 * 10**8)]


def test_a_fork_s_faults_are_those_of_its_new_scenario(index):
    none = ScenarioChange(4 * 10**8, SCENARIO.split("[[")[0], "calm")
    session = replace(index.session, scenario=SCENARIO, changes=(none,))
    found = fault_spans(replace(index, session=session))
    assert [(s.name, s.from_ns, s.to_ns) for s in found] == [("blur", 3 * 10**8, 4 * 10**8)]


def test_a_recording_of_another_scene_says_so(index, tiny):
    assert open_recording(index, tiny.scene).stranger == ""
    other = replace(tiny.scene, name="other", objects=tiny.scene.objects[:1])
    assert "recorded in scene 'tiny', open is 'other'" in open_recording(index, other).stranger
