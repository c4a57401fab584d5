"""The composition root: `open_session` puts adapters, clock, executor and recorder together."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from devices.clock import Clock, ManualClock, WallClock
from devices.recording import read_session
from devices.session_info import SessionInfo
from scenes.package import ScenePackage
from studio.session.pipeline import (
    ExactExecutor,
    PacedExecutor,
    SessionMessage,
    recorded_messages,
    simulated_messages,
)
from studio.session.plan import Pace, SessionPlan
from studio.session.records.recorded_scene import recorded_scene, with_camera
from studio.session.session import Session
from studio.session.trackers.methods import METHODS, TruthDetector, make_method
from studio.session.trackers.pacing import AsRecorded, InFrames, Live, Pacing
from tracking.hypotheses.budget import MeasuredCosts
from tracking.output import TrackingMethod


def open_session(plan: SessionPlan, *, truth_detector: TruthDetector | None = None) -> Session:
    """Choose adapters, clock, executor and recorder, and put them together.

    Args:
        plan: what to play.
        truth_detector: finds the objects for the paper's method in a simulation; without one, the
            method finds what differs from the empty room.

    Raises:
        ValueError: the scene, scenario or recording is bad, or a method is unknown.
        OSError: a file cannot be opened.
    """
    known = (*METHODS, *plan.more_methods)
    unknown = [name for name in plan.methods if name not in known]
    if unknown or not plan.methods:
        raise ValueError(f"tracking method {unknown}: wanted some of {', '.join(known)}")
    if plan.pace is Pace.LIVE:
        raise ValueError("a live session is opened with its camera: open_live_session")
    clock: Clock = ManualClock() if plan.pace is Pace.EXACT else WallClock()
    executor = ExactExecutor(clock) if plan.pace is Pace.EXACT else PacedExecutor(clock)
    made = _recorded(plan) if plan.recording is not None else _simulated(plan)
    scene, info, messages, duration_ns = made
    # A live recording says how its searches went; what else must repeat is nominal.
    pacing: Pacing = InFrames()
    if plan.pace is Pace.PACED:
        pacing = InFrames(MeasuredCosts(time.perf_counter_ns))
    elif plan.recording is not None and info.stream is not None:
        pacing = AsRecorded()
    return Session(
        plan,
        scene,
        info,
        messages,
        _methods(plan, scene, truth_detector, pacing),
        duration_ns=duration_ns,
        clock=clock,
        executor=executor,
        truth_detector=truth_detector,
        pacing=pacing,
    )


def open_live_session(
    plan: SessionPlan,
    scene: ScenePackage,
    info: SessionInfo,
    messages: Callable[[], Iterator[SessionMessage]],
    clock: Clock,
) -> Session:
    """A session on a live camera: what enters is tracked, what is tracked can be replayed.

    Args:
        plan: of pace `LIVE`.
        scene: where the camera stands.
        info: how it is recorded.
        messages: of the camera, the newest each time one is taken.
        clock: session time, which the camera's receiver keeps, too.
    """
    # One thread: a picture is taken when the tracker is ready for it. Those in between are replaced
    # in the receiver.
    pacing = Live()
    return Session(
        plan,
        scene,
        info,
        messages,
        _methods(plan, scene, None, pacing),
        duration_ns=0,
        clock=clock,
        executor=ExactExecutor(clock),
        pacing=pacing,
    )


def _methods(
    plan: SessionPlan,
    scene: ScenePackage,
    truth_detector: TruthDetector | None,
    pacing: Pacing,
) -> dict[str, TrackingMethod[Any]]:
    return {
        name: make_method(
            name,
            scene,
            truth_detector,
            stopwatch=time.perf_counter_ns,
            costs=pacing.costs,
            searches=pacing.searches,
            looks=pacing.looks,
            more=plan.more_methods,
        )
        for name in plan.methods
    }


def scene_hash(scene: ScenePackage) -> str:
    """A digest of everything the tracker takes from a scene: splats, poses, boxes."""
    digest = hashlib.sha256()
    clouds = [("room", scene.room), *((o.object_id, o.splats) for o in scene.objects)]
    for name, cloud in clouds:
        digest.update(name.encode())
        for array in (cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh):
            digest.update(array.tobytes())
    for item in scene.objects:
        numbers = [*item.box_m, item.support_z_m]
        digest.update(np.array(numbers, dtype=np.float64).tobytes())
        digest.update(item.world_from_object.matrix().tobytes())
    return digest.hexdigest()


Made = tuple[ScenePackage, SessionInfo, Callable[[], Iterator[SessionMessage]], int]


def _simulated(plan: SessionPlan) -> Made:
    from sim.camera.camera360 import default_rig
    from sim.scenarios.arrangement import arranged_scene
    from studio.session.records.provenance import library_versions
    from studio.session.staging import staging_of

    fork = plan.fork
    staging = staging_of(
        plan.scene, plan.scenario, fork, more_faults=plan.more_faults, arranged=plan.arranged
    )
    scenario = staging.scenario
    scene = with_camera(staging.scene, scenario.camera.world_from_rig)
    scene = arranged_scene(scene, scenario.arrangement)
    then = () if fork is None else fork.then
    info = SessionInfo(
        scene=plan.scene,
        scene_hash=scene_hash(scene),
        seed=plan.seed,
        scenario=staging.scenario_text,
        scenario_name=scenario.name,
        mode=str(plan.pace),
        methods=plan.methods,
        versions=library_versions(),
        rig=default_rig(scenario.camera.lens_size_px),
        fps=scenario.camera.fps,
        changes=() if fork is None else fork.changes,
        fork=None if fork is None else fork.origin,
        reality=staging.reality,
    )
    if fork is not None:
        fork.check_scene(info.scene_hash)
    steps = staging.steps(plan.seed, then)
    corners = {item.surface_id: np.array(item.corners_in_world) for item in scenario.surfaces}
    duration_ns = round((then[-1].scenario if then else scenario).duration_s * 1e9)

    def messages() -> Iterator[SessionMessage]:
        simulated = simulated_messages(steps(), corners)
        return simulated if fork is None else fork.proven(simulated)

    return scene, info, messages, duration_ns


def _recorded(plan: SessionPlan) -> Made:
    path = plan.recording
    assert path is not None
    if "paper" in plan.methods:
        raise ValueError(
            f"{path}: the paper's method cannot be replayed: it works on the simulator's masks, "
            "which a recording does not hold; rehearse again with the same seed"
        )
    info = read_session(path)
    scene = recorded_scene(info)
    found = scene_hash(scene)
    if found != info.scene_hash:
        raise ValueError(
            f"{path}: recorded with another version of scene {info.scene!r} "
            f"({info.scene_hash[:12]}, here {found[:12]}); tracks cannot be compared"
        )
    # What is recorded now is what is tracked now: every frame, by these methods.
    info = replace(info, methods=plan.methods, mode=str(plan.pace))
    return scene, info, partial(recorded_messages, path, info), 0
