"""The scene of a recorded session, with its camera where the session's scenario put it."""

from __future__ import annotations

from dataclasses import replace

from devices.session_info import SessionInfo
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from sim.scenarios.arrangement import Arrangement, arranged_scene
from sim.scenarios.scenario import recorded_arrangement, recorded_camera
from sim.tables import ScenarioError


def recorded_scene(info: SessionInfo) -> ScenePackage:
    """The scene that a session took place in.

    Raises:
        PackageError, FormatError: it is gone or damaged.
    """
    return as_recorded(open_scene(info.scene), info)


def as_recorded(scene: ScenePackage, info: SessionInfo) -> ScenePackage:
    """A scene with camera and objects where the session's scenario put them."""
    return arranged_scene(with_camera(scene, _placed(info)), _arranged(info))


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


def _arranged(info: SessionInfo) -> Arrangement:
    if not info.scenario:
        return Arrangement()
    try:
        return recorded_arrangement(info.scenario, source=info.scenario_name)
    except ScenarioError:
        return Arrangement()  # as for the camera
