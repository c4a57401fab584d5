"""Channels to everybody: the newest state, the log in order, the newest bodies. No socket here."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from devices.hub.entities.board import Board
from devices.hub.entities.drawn import DECIMALS, GLTF_FROM_WORLD
from devices.hub.protocol.wire import pack_item
from devices.hub.roles import SPEAK, Pen, Person, can_have_shapes, may_speak
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject

MAX_LOG_ENTRIES = 2000
"""Entries that are kept for whoever comes back."""

MAX_LOG_BYTES = 4 * 1024 * 1024
"""Their text together."""

MAX_OBJECTS = 10_000
"""Objects whose names are remembered when they are gone; chosen: far above any room's."""


def to_text(fields: Mapping[str, Any]) -> str:
    """Return a message as it is sent, without blanks."""
    return json.dumps(fields, separators=(",", ":"), allow_nan=False)


CAMERA_M = 0.02
"""Way of the 360° camera that is said; its pose is refined by less all the time."""


@dataclass(slots=True)
class StateChannel:
    """Objects of the newest state, each with the version in which it changed last.

    The 360° camera's middle is among them as `camera`, by which somebody may lay the room on the
    real one.
    """

    version: int = 0
    t_us: int = 0
    _camera: tuple[int, list[float]] | None = None
    _texts: dict[str, str] = field(default_factory=dict[str, str])
    _changed: dict[str, int] = field(default_factory=dict[str, int])
    _objects: Mapping[str, TrackedObject] = field(default_factory=dict[str, TrackedObject])
    _made: tuple[int, int, str] = (-1, -1, "")

    def take(self, state: SceneState) -> bool:
        """Take the next state; return whether any object differs."""
        moved = self._moved_camera(state.world_from_rig)
        if state.objects is self._objects and moved is None:
            return False
        changed: dict[str, str] = {}
        for name, tracked in state.objects.items():
            if self._objects.get(name) is not tracked:
                text = _object_text(tracked)
                if text != self._texts.get(name):
                    changed[name] = text
        changed |= {n: "null" for n in self._objects if n not in state.objects}
        self._objects = state.objects
        if not changed and moved is None:
            return False
        self.version += 1
        if moved is not None:
            self._camera = self.version, moved
        self.t_us = state.t_ns // 1000
        self._texts |= changed
        self._changed |= dict.fromkeys(changed, self.version)
        self._forget_gone()
        return True

    def message_since(self, version: int) -> str:
        """Return the message that brings somebody who has that version up to the newest."""
        if self._made[:2] != (version, self.version):
            changed = {n: self._texts[n] for n, v in self._changed.items() if v > version}
            text = (
                f'{{"kind":"state","version":{self.version},"t_us":{self.t_us},'
                f'{self.camera_since(version)}"objects":{_joined(changed)}}}'
            )
            self._made = (version, self.version, text)
        return self._made[2]

    def whole(self) -> str:
        """Return all objects that are there, as JSON."""
        return _joined({n: text for n, text in self._texts.items() if text != "null"})

    def camera_since(self, version: int) -> str:
        """Return the camera's field, with a comma, where it has moved after a version."""
        if self._camera is None or self._camera[0] <= version:
            return ""
        return f'"camera":{to_list(list[Any](self._camera[1]))},'

    def _moved_camera(self, world_from_rig: Pose | None) -> list[float] | None:
        """Return where the camera is, y up, if that is worth saying."""
        if world_from_rig is None or not np.isfinite(world_from_rig.translation).all():
            return None
        place = (GLTF_FROM_WORLD @ world_from_rig.translation).tolist()
        if self._camera is not None and math.dist(place, self._camera[1]) < CAMERA_M:
            return None
        return [round(number, DECIMALS) for number in place]

    def _forget_gone(self) -> None:
        gone = [n for n, text in self._texts.items() if text == "null"]
        for name in gone[: max(0, len(self._texts) - MAX_OBJECTS)]:
            del self._texts[name], self._changed[name]


@dataclass(slots=True)
class LogChannel:
    """Operations in the order in which they count, the newest of them kept."""

    seq: int = 0
    _entries: deque[tuple[int, str]] = field(default_factory=deque[tuple[int, str]])
    _bytes: int = 0

    def add(self, fields: Mapping[str, Any]) -> str:
        """Return the next entry as it is sent."""
        self.seq += 1
        text = to_text({"kind": "log", "seq": self.seq, **fields})
        self._entries.append((self.seq, text))
        self._bytes += len(text)
        while len(self._entries) > MAX_LOG_ENTRIES or self._bytes > MAX_LOG_BYTES:
            self._bytes -= len(self._entries.popleft()[1])
        return text

    def since(self, seq: int) -> list[str] | None:
        """Return entries after that one; None where some of them are not kept or never were."""
        if not self.seq - len(self._entries) <= seq <= self.seq:
            return None
        return [text for number, text in self._entries if number > seq]


@dataclass(slots=True)
class BodyChannel:
    """Newest body of everybody, packed once for all who get it."""

    counter: int = 0
    _newest: dict[int, tuple[int, int, bytes]] = field(
        default_factory=dict[int, "tuple[int, int, bytes]"]
    )

    def put(self, index: int, data: bytes) -> None:
        """Take the newest body of a person."""
        self.counter += 1
        of_person = self._newest.get(index, (0, 0, b""))[1] + 1
        self._newest[index] = (self.counter, of_person, pack_item(index, data))

    def drop(self, index: int) -> None:
        """Forget somebody's body."""
        self._newest.pop(index, None)

    def since(self, counter: int, *, but: int) -> list[tuple[int, int, bytes]]:
        """Return index, number and packed body of all but one whose body is newer than that."""
        return [
            (index, of_person, item)
            for index, (number, of_person, item) in self._newest.items()
            if number > counter and index != but
        ]


@dataclass(slots=True)
class PictureChannel:
    """Newest picture of each live surface, as it is sent."""

    counter: int = 0
    _newest: dict[str, tuple[int, bytes]] = field(default_factory=dict[str, "tuple[int, bytes]"])

    def put(self, surface_id: str, message: bytes) -> None:
        """Take the newest picture of a surface."""
        self.counter += 1
        self._newest[surface_id] = (self.counter, message)

    def keep(self, surfaces: Collection[str]) -> None:
        """Forget pictures of all other surfaces."""
        for gone in self._newest.keys() - surfaces:
            del self._newest[gone]

    def next_after(self, counter: int, *, but: Collection[str] = ()) -> tuple[int, bytes] | None:
        """Return the number and message of the oldest newer picture; None if there is none.

        Args:
            counter: of the newest one that was sent.
            but: surfaces of which none is wanted.
        """
        wanted = (each for name, each in self._newest.items() if name not in but)
        return min((each for each in wanted if each[0] > counter), default=None)


def _object_text(tracked: TrackedObject) -> str:
    """Return place, turn, state and confidence of an object; room and object both with y up.

    An object that stands as it was scanned has no turn but its yaw, as a node of glTF.
    """
    pose = GLTF_FROM_WORLD @ tracked.world_from_object @ WORLD_FROM_GLTF
    w, x, y, z = pose.quaternion().tolist()
    place = [round(number, DECIMALS) for number in pose.translation.tolist()]
    turn = [round(number, 6) for number in (x, y, z, w)]
    confidence = tracked.confidence if math.isfinite(tracked.confidence) else 0.0
    return to_list([*place, *turn, tracked.state.value, round(confidence, 3)])


def to_list(values: list[Any]) -> str:
    """Return a JSON list without blanks."""
    return json.dumps(values, separators=(",", ":"), allow_nan=False)


def _joined(texts: Mapping[str, str]) -> str:
    return "{" + ",".join(f"{json.dumps(name)}:{text}" for name, text in texts.items()) + "}"


def answer_fields(op_id: str | int | None, why: str = "") -> dict[str, Any]:
    """Return the message that an operation was done, or refused and why."""
    said = {"kind": "refused", "id": op_id, "why": why}
    return said if why else {"kind": "done", "id": op_id}


def rights_of(person: Person, pen: Pen) -> list[str]:
    """Return what somebody may do now, as they are told."""
    return [*pen.rights(person), *([SPEAK] if may_speak(person) else [])]


def rights_text(person: Person, pen: Pen) -> str:
    """Return the message by which somebody learns what they may do."""
    return to_text(
        {
            "kind": "rights",
            "role": person.role,
            "rights": rights_of(person, pen),
            "muted": person.is_muted,
        }
    )


def welcome_of(person: Person, people: Iterable[Person], *, pen: Pen) -> dict[str, Any]:
    """Return the fields of a welcome that are about people."""
    return {
        "kind": "welcome",
        "you": person.person_id,
        "index": person.index,
        "role": person.role,
        "name": person.name,
        "rights": rights_of(person, pen),
        "people": people_of(people, pen),
    }


def people_of(people: Iterable[Person], pen: Pen) -> list[dict[str, Any]]:
    """Return everybody, as everybody is told of them."""
    return [
        {
            "id": person.person_id,
            "index": person.index,
            "name": person.name,
            "role": person.role,
            "muted": person.is_muted,
            "pen": bool(pen.rights(person)),
            "microphone": person.has_microphone,
            "takes": can_have_shapes(person),
            "yields": person.is_yielding,
        }
        for person in people
    ]


def whole_text(fields: dict[str, Any], *, states: StateChannel, board: Board) -> str:
    """Return a message of fields and the whole state of the room."""
    state = (
        f'{{"version":{states.version},"t_us":{states.t_us},{states.camera_since(0)}'
        f'"objects":{states.whole()},'
        f"{to_text(board.whole())[1:]}"
    )
    return f'{to_text(fields)[:-1]},"state":{state}}}'
