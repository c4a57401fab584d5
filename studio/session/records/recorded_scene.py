"""The scene of a recorded session, with its camera where the session's scenario put it."""

from __future__ import annotations

from dataclasses import replace

from devices.session_info import SessionInfo
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from sim.scenarios.scenario import recorded_camera
from sim.tables import ScenarioError


def recorded_scene(info: SessionInfo) -> ScenePackage:
    """The scene that a session took place in.

    Raises:
        PackageError, FormatError: it is gone or damaged.
    """
    return with_camera(open_scene(info.scene), _placed(info))


def with_camera(scene: ScenePackage, world_from_rig: Pose | None) -> ScenePackage:
    """The scene with its camera elsewhere; None leaves it."""
    return scene if world_from_rig is None else replace(scene, world_from_rig=world_from_rig)


def _placed(info: SessionInfo) -> Pose | None:
    if not info.scenario:
        return None
    try:
        return recorded_camera(info.scenario, source=info.scenario_name).world_from_rig
    except ScenarioError:
        # Of another version of the program: what was recorded plays all the same.
        return None
