"""A scenario's remote person with a headset: walks, looks, points and draws as the script says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from devices.hub.entities.drawn import on_the_wire
from devices.hub.protocol.wire import Body
from scenes.frames import OPENGL_FROM_OPENCV, WORLD_FROM_GLTF
from scenes.pose import Pose
from sim.people.remote import remote_annotations, remote_avatar
from sim.scenarios.scenario import RemoteProposal, RemoteSettings, Scenario

GLTF_FROM_WORLD = WORLD_FROM_GLTF.inverse()
"""Turn from the world's axes to upright ones, as they are on the wire."""

LOOKED_AT_M = np.array([0.0, 0.0, 1.0])
"""Looked at by somebody who points at nothing, chosen: the middle of a room, a metre up."""


@dataclass(frozen=True, slots=True)
class Script:
    """A person's part in a scenario. It is played once; at its end they stay where they are.

    Attributes:
        settings: path, what is pointed at, what is drawn.
        duration_s: of the scenario.
    """

    settings: RemoteSettings
    duration_s: float

    def person(self) -> ScriptedPerson:
        """Return somebody who plays the part from its beginning."""
        return ScriptedPerson(self)


class ScriptedPerson:
    """Somebody who plays a part in the room as the studio shows it.

    Args:
        script: the part.
    """

    def __init__(self, script: Script) -> None:
        self._settings, self._duration_s = script.settings, script.duration_s
        self._objects: dict[str, Pose] = {}
        self._drawn_s = -1.0

    def take_whole(self, objects: Mapping[str, Any]) -> None:
        """Take where everything is, as a hub's welcome says."""
        self._objects.clear()
        self.take(objects)

    def take(self, objects: Mapping[str, Any]) -> None:
        """Take where objects are that have moved.

        Args:
            objects: by id, x, y, z, qx, qy, qz, qw and more in upright axes; None for what is gone.
        """
        for name, values in objects.items():
            if values is None:
                self._objects.pop(name, None)
                continue
            room_from_object = Pose.from_quaternion(np.roll(values[3:7], 1), values[:3])
            self._objects[name] = WORLD_FROM_GLTF @ room_from_object @ GLTF_FROM_WORLD

    def body(self, t_s: float, *, seq: int, t_us: int) -> Body:
        """Return the body at a moment; what the studio does not show is not pointed at.

        Args:
            t_s: time since the person joined.
            seq: the body's number.
            t_us: device time that it is stamped with.
        """
        there = tuple(name for name in self._settings.points_at if name in self._objects)
        avatar = remote_avatar(
            replace(self._settings, points_at=there),
            min(t_s / self._duration_s, 1.0),
            self._objects,
            Pose(np.eye(3), LOOKED_AT_M),
            t_s=t_s,
        )
        head = GLTF_FROM_WORLD @ avatar.world_from_head @ OPENGL_FROM_OPENCV
        ray = None if avatar.ray is None else GLTF_FROM_WORLD @ avatar.ray
        return Body(seq, t_us, head, ray=ray)

    def new_things(self, t_s: float) -> list[dict[str, Any]]:
        """Return messages with lines that have grown, and what is proposed, since the last call."""
        since_s, self._drawn_s = self._drawn_s, t_s
        proposed = [
            self._proposed(number, proposal)
            for number, proposal in enumerate(self._settings.proposes)
            if since_s < proposal.from_s <= t_s and proposal.object_id in self._objects
        ]
        return proposed + [
            {
                "kind": "do",
                "id": 0,
                "op": "line",
                "line": line.annotation_id,
                "points": np.round(GLTF_FROM_WORLD @ line.points_in_world, 4).tolist(),
                "colour": list(line.colour),
            }
            for line in remote_annotations(self._settings, since_s=since_s, t_s=t_s)
        ]

    def _proposed(self, number: int, proposal: RemoteProposal) -> dict[str, Any]:
        here = self._objects[proposal.object_id]
        yaw = here.yaw() if proposal.yaw_rad is None else proposal.yaw_rad
        there = Pose.from_yaw(yaw, (*proposal.place_m, float(here.translation[2])))
        return {
            "kind": "do",
            "id": 0,
            "op": "propose",
            "proposal": f"proposal-{number}",
            "object": proposal.object_id,
            "pose": on_the_wire(GLTF_FROM_WORLD @ there @ WORLD_FROM_GLTF),
        }


def scripts_of(scenario: Scenario) -> tuple[Script, ...]:
    """Return the parts of a scenario's remote people.

    Raises:
        ValueError: it has none.
    """
    if not scenario.remote:
        raise ValueError(f"{scenario.source}: nobody watches from elsewhere; add [[remote]]")
    return tuple(Script(settings, scenario.duration_s) for settings in scenario.remote)
