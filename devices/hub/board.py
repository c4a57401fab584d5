"""Lines and surfaces of everybody, and undo for each person."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.hub.messages import Do, OpError
from devices.hub.roles import Op
from scenes.frames import WORLD_FROM_GLTF
from scenes.state import Annotation, LiveSurface, SceneState

MAX_LINES = 2000
"""Lines at the same time; chosen: an hour of drawing."""

MAX_POINTS_IN_ALL = 50_000
"""Points of all lines together: about 1.5 MB of text for whoever joins."""

MAX_SURFACES = 32
"""Surfaces that people have made, at the same time; each is a video."""

MAX_UNDO = 100
"""Operations that a person can undo."""

DECIMALS = 4
"""Places after the point on the wire: a tenth of a millimetre."""

STEADY_NS = 10**9
"""Pause after which moving the same surface again is another operation to undo: one second."""

SURFACE_PX = 1024
"""Longer side of the rectified picture that a new surface asks for, pixels."""

GLTF_FROM_WORLD = WORLD_FROM_GLTF.inverse()
"""From the session's axes to those of the wire."""

ROOM = "room"
"""Author of what the session itself has drawn."""

NOTHING = np.zeros((0, 3))
"""Points of what is erased."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A line or a surface as it is on the wire.

    Attributes:
        op: line or surface.
        key: unique in the session.
        by: person who made it, or "room".
        points: (N, 3) metres, y up; none where it is erased.
        colour: of a line.
    """

    op: Op
    key: str
    by: str
    points: NDArray[np.float64]
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def entry(self) -> dict[str, Any]:
        """Return its fields in the log."""
        points = np.round(self.points, DECIMALS).tolist()
        if self.op is Op.SURFACE:
            return {"by": self.by, "op": "surface", "surface": self.key, "corners": points}
        colour = [round(part, DECIMALS) for part in self.colour]
        return {
            "by": self.by,
            "op": "line",
            "line": self.key,
            "points": points,
            "colour": colour,
        }

    def annotation(self) -> Annotation:
        """Return a line in the session's axes."""
        return Annotation(self.key, self.by, WORLD_FROM_GLTF @ self.points, self.colour)

    def surface(self) -> LiveSurface:
        """Return a surface in the session's axes, its picture as large as its shape asks for."""
        corners = WORLD_FROM_GLTF @ self.points
        size_px = (SURFACE_PX, SURFACE_PX)
        if len(corners):
            sides = np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)
            width, height = float(sides[0] + sides[2]), float(sides[1] + sides[3])
            scale = SURFACE_PX / max(width, height, 1e-6)
            size_px = (max(16, round(scale * width)), max(16, round(scale * height)))
        return LiveSurface(self.key, corners, size_px, "")


def drawn_by_room(
    before: SceneState, state: SceneState, *, is_known: Callable[[Annotation | LiveSurface], bool]
) -> Iterator[Drawn]:
    """Yield lines and surfaces in which two states differ; one that is gone without points.

    Args:
        before: the state before.
        state: the next one.
        is_known: whether a value has come from the people themselves.
    """
    if state.annotations is not before.annotations:
        for key, line in state.annotations.items():
            if before.annotations.get(key) is not line and not is_known(line):
                yield drawn_line(line, by=ROOM)
        for key in before.annotations.keys() - state.annotations.keys():
            yield Drawn(Op.LINE, key, ROOM, NOTHING)
    if state.surfaces is not before.surfaces:
        for key, surface in state.surfaces.items():
            if before.surfaces.get(key) is not surface and not is_known(surface):
                yield drawn_surface(surface, by=ROOM)
        for key in before.surfaces.keys() - state.surfaces.keys():
            yield Drawn(Op.SURFACE, key, ROOM, NOTHING)


def drawn_line(annotation: Annotation, *, by: str) -> Drawn:
    """Return a line of the session as it is on the wire."""
    points = GLTF_FROM_WORLD @ np.asarray(annotation.points_in_world, dtype=np.float64)
    red, green, blue = (float(part) for part in annotation.colour)
    return Drawn(Op.LINE, annotation.annotation_id, by, points.reshape(-1, 3), (red, green, blue))


def drawn_surface(surface: LiveSurface, *, by: str) -> Drawn:
    """Return a surface of the session as it is on the wire."""
    corners = GLTF_FROM_WORLD @ np.asarray(surface.corners_in_world, dtype=np.float64)
    return Drawn(Op.SURFACE, surface.surface_id, by, corners.reshape(-1, 3))


@dataclass(slots=True, eq=False)
class _Step:
    """A line or surface before the operations that one undo takes back.

    Attributes:
        before: as it was.
        t_ns: of the newest operation that is taken back with it.
    """

    before: Drawn
    t_ns: int
    is_open: bool


@dataclass(slots=True)
class Board:
    """Everything drawn and placed that is there now."""

    _lines: dict[str, Drawn] = field(default_factory=dict[str, Drawn])
    _surfaces: dict[str, Drawn] = field(default_factory=dict[str, Drawn])
    _points: int = 0
    _steps: dict[str, deque[_Step]] = field(default_factory=dict[str, "deque[_Step]"])

    def whole(self) -> dict[str, Any]:
        """Return lines and surfaces for whoever joins, by name."""
        return {
            "surfaces": {
                key: {"by": it.by, "corners": it.entry()["corners"]}
                for key, it in self._surfaces.items()
            },
            "lines": {
                key: {name: it.entry()[name] for name in ("by", "points", "colour")}
                for key, it in self._lines.items()
            },
        }

    def do(self, person_id: str, do: Do, *, now_ns: int) -> Drawn:
        """Do what a person asks for; return what has become of the line or surface.

        Raises:
            OpError: there is nothing to undo, or too much is there.
        """
        if do.op is Op.UNDO:
            steps = self._steps.get(person_id)
            if not steps:
                raise OpError("there is nothing to undo", op_id=do.op_id)
            before = steps[-1].before
            self._check_room(before, do)
            steps.pop()
            self.put(before)
            return before
        key = own_key(person_id, do.key)
        changed = Drawn(do.op, key, person_id, do.points, do.colour)
        self._check_room(changed, do)
        before = self._of(do.op).get(key) or Drawn(do.op, key, person_id, NOTHING, do.colour)
        self._remember(before, changed, now_ns=now_ns)
        self.put(changed)
        return changed

    def put(self, drawn: Drawn) -> bool:
        """Replace a line or surface, one without points goes; return whether that is a change."""
        there = self._of(drawn.op)
        old = there.pop(drawn.key, None)
        if len(drawn.points):
            there[drawn.key] = drawn
        if drawn.op is Op.LINE:
            self._points += len(drawn.points) - (0 if old is None else len(old.points))
        return old is not None or len(drawn.points) > 0

    def forget(self, person_id: str) -> None:
        """Keep no operations to undo of somebody who does not come back."""
        self._steps.pop(person_id, None)

    def _of(self, op: Op) -> dict[str, Drawn]:
        return self._surfaces if op is Op.SURFACE else self._lines

    def _check_room(self, drawn: Drawn, do: Do) -> None:
        there = self._of(drawn.op)
        old = there.get(drawn.key)
        if not len(drawn.points):
            return
        limit = MAX_SURFACES if drawn.op is Op.SURFACE else MAX_LINES
        if old is None and len(there) >= limit:
            raise OpError(f"{len(there)} {drawn.op}s are there, erase some", op_id=do.op_id)
        more = len(drawn.points) - (0 if old is None else len(old.points))
        if drawn.op is Op.LINE and self._points + more > MAX_POINTS_IN_ALL:
            raise OpError(f"lines of {self._points} points are there, erase some", op_id=do.op_id)

    def _remember(self, before: Drawn, changed: Drawn, *, now_ns: int) -> None:
        """Let a line that grows, or a surface that is carried, be taken back as one."""
        steps = self._steps.setdefault(changed.by, deque(maxlen=MAX_UNDO))
        newest = steps[-1] if steps else None
        is_there = len(changed.points) > 0
        if newest is not None and newest.is_open and is_there:
            is_same = (newest.before.op, newest.before.key) == (changed.op, changed.key)
            is_steady = changed.op is Op.LINE or now_ns - newest.t_ns < STEADY_NS
            if is_same and is_steady:
                newest.t_ns = now_ns
                return
        if not is_there and not len(before.points):
            return
        steps.append(_Step(before, now_ns, is_there))


def own_key(person_id: str, key: str) -> str:
    """Return a person's line or surface by its name in the session.

    Raises:
        OpError: it is somebody else's.
    """
    owner, slash, name = key.partition("/")
    if not slash:
        return f"{person_id}/{key}"
    if owner != person_id:
        raise OpError(f"{key} belongs to somebody else")
    return f"{person_id}/{name}"
