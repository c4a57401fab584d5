# pyright: standard
"""The JSON records of a scene package: objects, codes, views, stages; what they say is checked."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole, camera_from_json, camera_to_json
from scenes.coverage.record import Coverage
from scenes.mesh import BoxPart
from scenes.package.coverage import sides_to_json
from scenes.package.files import numbers, text
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.splats import SplatCloud
from scenes.state import ObjectModel

OBJECT_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
"""An object's id is the name of its file."""
MIN_MASS_KG = 1e-6
MIN_HALF_SIZE_M = 1e-6
"""Physics takes no body without mass and no box without volume."""
QUATERNION_DIGITS = 14
"""Of a quaternion's values, behind the point: ten times what a matrix of doubles leaves open."""
MAX_PARTS = 1000
"""Of one object; more are a damaged file."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of a scene's making: what was done, in words, and how long it took in seconds."""

    name: str
    detail: str = ""
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class ViewPoint:
    """Camera and pose of a photo of the room; the photo itself is not kept.

    Attributes:
        name: of the photo.
        camera: its lens, free of distortion.
        world_from_camera: its pose.
    """

    name: str
    camera: Pinhole | Fisheye
    world_from_camera: Pose


def object_to_json(item: ObjectModel) -> dict[str, Any]:
    """Everything of an object but its splats, and what photos saw of each."""
    seen = item.coverage
    return {
        "id": item.object_id,
        "name": item.name,
        "kind": item.kind,
        "box_m": list(item.box_m),
        "support_z_m": item.support_z_m,
        "world_from_object": pose_to_json(item.world_from_object),
        "parts": [part_to_json(part) for part in item.parts],
        "guessed_mass_kg": item.guessed_mass_kg,
        **({} if seen is None else {"seen_sides": sides_to_json(seen)}),
    }


def object_from_json(
    values: Mapping[str, Any], splats: SplatCloud, *, coverage: Coverage | None = None
) -> ObjectModel:
    """Inverse of `object_to_json`.

    Raises:
        KeyError, TypeError, ValueError: a field is missing or has a value that no object can have.
    """
    x, y, z = numbers(values["box_m"], 3, "box_m", least=0.0)
    # Scenes that were saved before objects had parts and a mass have neither field.
    mass = values.get("guessed_mass_kg")
    return ObjectModel(
        object_id=object_id_of(values),
        name=text(values["name"], "name"),
        kind=text(values["kind"], "kind"),
        splats=splats,
        box_m=(x, y, z),
        support_z_m=numbers([values["support_z_m"]], 1, "support_z_m")[0],
        world_from_object=pose_from_json(values["world_from_object"]),
        parts=tuple(part_from_json(part) for part in _list(values.get("parts", []), "parts")),
        guessed_mass_kg=None
        if mass is None
        else numbers([mass], 1, "guessed_mass_kg", least=MIN_MASS_KG)[0],
        coverage=coverage,
    )


def part_to_json(part: BoxPart) -> dict[str, Any]:
    """A solid box of an object as plain values."""
    return {
        "half_size_m": list(part.half_size_m),
        "object_from_box": pose_to_json(part.object_from_box),
    }


def part_from_json(values: Mapping[str, Any]) -> BoxPart:
    """Inverse of `part_to_json`; raises as `object_from_json`."""
    x, y, z = numbers(values["half_size_m"], 3, "half_size_m", least=MIN_HALF_SIZE_M)
    return BoxPart(pose_from_json(values["object_from_box"]), (x, y, z))


def _list(values: object, what: str) -> list[Mapping[str, Any]]:
    if not isinstance(values, list) or not all(isinstance(item, dict) for item in values):
        raise ValueError(f"{what}: {values!r}, wanted a list of objects")
    if len(values) > MAX_PARTS:
        raise ValueError(f"{what}: {len(values)}, wanted at most {MAX_PARTS}")
    return values


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
    """A pose as plain values, the same ones whenever it is read and written again."""
    return {
        "wxyz": _steady(world_from_thing.quaternion()).tolist(),
        "translation_m": world_from_thing.translation.tolist(),
    }


def _steady(wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """A unit quaternion whose values do not change when it becomes a matrix and comes back.

    Three numbers are rounded, far above what a matrix leaves uncertain, and the largest follows
    from them: so the norm is 1 to the last bit, and nothing moves when it is normalised.
    """
    largest = int(np.argmax(np.round(np.abs(wxyz), 6)))
    steady = np.round(wxyz, QUATERNION_DIGITS)
    steady[largest] = 0.0
    steady[largest] = math.copysign(math.sqrt(1.0 - float(steady @ steady)), wxyz[largest])
    first = steady[np.flatnonzero(steady)[0]]
    # Half a turn has two quaternions, and noise would choose between them.
    return (steady if first > 0 else -steady) + 0.0


def pose_from_json(values: Mapping[str, Any]) -> Pose:
    """Inverse of `pose_to_json`; raises as `object_from_json`."""
    return Pose.from_quaternion(
        numbers(values["wxyz"], 4, "wxyz"), numbers(values["translation_m"], 3, "translation_m")
    )
