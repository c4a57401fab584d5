"""The JSON records of a scene package: objects, codes, views, stages; what they say is checked."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenes.cameras import Fisheye, Pinhole, camera_from_json, camera_to_json
from scenes.mesh import QrCode
from scenes.package_files import numbers, text
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel

OBJECT_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
"""An object's id is the name of its file."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of a scene's making: what was done, in words, and how long it took in seconds."""

    name: str
    detail: str = ""
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class ViewPoint:
    """Where the room was photographed from; the photo itself is not kept.

    Attributes:
        name: of the photo.
        camera: its lens, free of distortion.
        world_from_camera: its pose.
    """

    name: str
    camera: Pinhole | Fisheye
    world_from_camera: Pose


def object_to_json(item: ObjectModel) -> dict[str, Any]:
    """Everything of an object but its splats."""
    return {
        "id": item.object_id,
        "name": item.name,
        "kind": item.kind,
        "box_m": list(item.box_m),
        "support_z_m": item.support_z_m,
        "world_from_object": pose_to_json(item.world_from_object),
    }


def object_from_json(values: Mapping[str, Any], splats: SplatCloud) -> ObjectModel:
    """Inverse of `object_to_json`.

    Raises:
        KeyError, TypeError, ValueError: a field is missing or has a value that no object can have.
    """
    x, y, z = numbers(values["box_m"], 3, "box_m", least=0.0)
    return ObjectModel(
        object_id=object_id_of(values),
        name=text(values["name"], "name"),
        kind=text(values["kind"], "kind"),
        splats=splats,
        box_m=(x, y, z),
        support_z_m=numbers([values["support_z_m"]], 1, "support_z_m")[0],
        world_from_object=pose_from_json(values["world_from_object"]),
    )


def object_id_of(values: Mapping[str, Any]) -> str:
    """The id in an object's record.

    Raises:
        ValueError: it is unfit for a file name.
    """
    object_id = values["id"]
    if not isinstance(object_id, str) or not OBJECT_ID.fullmatch(object_id):
        raise ValueError(f"object id {object_id!r} is unfit for a file name")
    return object_id


def stage_to_json(stage: Stage) -> dict[str, Any]:
    """A stage as plain values."""
    return {"name": stage.name, "detail": stage.detail, "seconds": stage.seconds}


def stage_from_json(values: Mapping[str, Any]) -> Stage:
    """Inverse of `stage_to_json`; raises as `object_from_json`."""
    seconds = values["seconds"]
    return Stage(
        text(values["name"], "stage name"),
        text(values["detail"], "stage detail"),
        None if seconds is None else numbers([seconds], 1, "stage seconds", least=0.0)[0],
    )


def code_to_json(code: QrCode) -> dict[str, Any]:
    """A printed code as plain values."""
    pose = pose_to_json(code.world_from_code)
    return {"payload": code.payload, "side_m": code.side_m, "world_from_code": pose}


def code_from_json(values: Mapping[str, Any]) -> QrCode:
    """Inverse of `code_to_json`; raises as `object_from_json`."""
    side_m = numbers([values["side_m"]], 1, "side_m", least=0.0)[0]
    return QrCode(
        text(values["payload"], "payload"), side_m, pose_from_json(values["world_from_code"])
    )


def view_to_json(view: ViewPoint) -> dict[str, Any]:
    """A viewpoint as plain values."""
    return {
        "name": view.name,
        "camera": camera_to_json(view.camera),
        "world_from_camera": pose_to_json(view.world_from_camera),
    }


def view_from_json(values: Mapping[str, Any]) -> ViewPoint:
    """Inverse of `view_to_json`; raises as `object_from_json`."""
    return ViewPoint(
        text(values["name"], "view name"),
        camera_from_json(dict(values["camera"])),
        pose_from_json(values["world_from_camera"]),
    )


def pose_to_json(world_from_thing: Pose) -> dict[str, Any]:
    """A pose as plain values."""
    return {
        "wxyz": world_from_thing.quaternion().tolist(),
        "translation_m": world_from_thing.translation.tolist(),
    }


def pose_from_json(values: Mapping[str, Any]) -> Pose:
    """Inverse of `pose_to_json`; raises as `object_from_json`."""
    return Pose.from_quaternion(
        numbers(values["wxyz"], 4, "wxyz"), numbers(values["translation_m"], 3, "translation_m")
    )
