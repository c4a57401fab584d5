"""Doings of a simulated person: lines, shapes, proposals and carried pictures, as a page sends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Message = dict[str, Any]

SIDE_M = 0.2
"""Side of a box that is put, metres."""

PICTURE_M = (0.5, 0.3)
"""Width and height of a surface that is made live, metres."""

CARRIED_M = 0.6
"""How far its picture is carried from it, metres."""

PROPOSES_EVERY, PICTURES_EVERY = 4, 16
"""One in so many people proposes, and makes surfaces live, chosen: a room takes 16 of each, and a
surface some 5 ms of every frame."""

COLOUR = (0.2, 0.6, 1.0)
"""Of what is drawn and put."""


class Doing(Protocol):
    """One thing that a person does with a hand, from its first touch until it is taken away."""

    op: str

    def step(self, tip: Array) -> Message:
        """Return what is asked for with the fingertip at a place (3,), metres, y up."""
        ...

    def end(self) -> Message:
        """Return what takes it away again."""
        ...


@dataclass(slots=True)
class Line:
    """A line that grows."""

    name: str
    op: str = "line"
    _points: list[list[float]] = field(default_factory=list[list[float]])

    def step(self, tip: Array) -> Message:
        """See `Doing`."""
        self._points.append(_rounded(tip))
        return {"op": self.op, "line": self.name, "points": self._points, "colour": list(COLOUR)}

    def end(self) -> Message:
        """See `Doing`."""
        return {"op": self.op, "line": self.name, "points": []}


@dataclass(slots=True)
class Box:
    """A box that is put and carried in one drag; one undo takes it back, or somebody gets it."""

    name: str
    op: str = "primitive"

    def step(self, tip: Array) -> Message:
        """See `Doing`."""
        return {
            "op": self.op,
            "primitive": self.name,
            "shape": "box",
            "size": [SIDE_M] * 3,
            "colour": list(COLOUR),
            "pose": [*_rounded(tip), 0.0, 0.0, 0.0, 1.0],
            "drag": self.name,
        }

    def end(self) -> Message:
        """See `Doing`."""
        return {"op": "undo"}

    def given(self, to: str) -> Message:
        """Return what hands it to somebody."""
        return {"op": "give", "primitive": self.name, "to": to}


@dataclass(slots=True)
class Copy:
    """A copy of an object that slides on the floor below the hand."""

    name: str
    object_id: str
    op: str = "propose"

    def step(self, tip: Array) -> Message:
        """See `Doing`."""
        x, _, z = _rounded(tip)
        pose = [x, 0.0, z, 0.0, 0.0, 0.0, 1.0]
        thing = {"proposal": self.name, "object": self.object_id, "pose": pose}
        return {"op": self.op, **thing, "drag": self.name}

    def end(self) -> Message:
        """See `Doing`."""
        return {"op": self.op, "proposal": self.name}


@dataclass(slots=True)
class Picture:
    """A surface that is made live where the hand is first, and carried as a picture afterwards."""

    name: str
    op: str = "surface"
    _corners: list[list[float]] = field(default_factory=list[list[float]])
    _steps: int = 0

    def step(self, tip: Array) -> Message:
        """See `Doing`."""
        self._steps += 1
        if not self._corners:
            width, height = PICTURE_M
            around = ((-1, 1), (1, 1), (1, -1), (-1, -1))
            self._corners = [
                _rounded(tip + 0.5 * np.array([a * width, b * height, 0.0])) for a, b in around
            ]
            return {"op": self.op, "surface": self.name, "corners": self._corners}
        way = np.array([0.0, min(1.0, 0.1 * self._steps) * CARRIED_M, 0.0])
        seen = [_rounded(np.array(corner) + way) for corner in self._corners]
        thing = {"surface": self.name, "corners": self._corners, "seen": seen}
        return {"op": self.op, **thing, "drag": self.name}

    def end(self) -> Message:
        """See `Doing`."""
        return {"op": self.op, "surface": self.name, "corners": []}


def erased(key: str) -> Message:
    """Return what takes a shape away, by its name in full."""
    return {"op": "primitive", "primitive": key}


def doings(rights: Sequence[str], objects: Sequence[str], *, seed: int) -> Iterator[Doing]:
    """Yield one doing after the other that a person's rights allow, without end; none if none is.

    Args:
        rights: operations that the person may ask for.
        objects: ids of those that are followed.
        seed: which doing comes first, and which object is proposed.
    """
    kinds = [kind for kind in ("line", "primitive", "propose", "surface") if kind in rights]
    if not objects or seed % PROPOSES_EVERY:
        kinds = [kind for kind in kinds if kind != "propose"]
    if seed % PICTURES_EVERY:
        kinds = [kind for kind in kinds if kind != "surface"]
    if "undo" not in rights:
        kinds = [kind for kind in kinds if kind != "primitive"]
    first = seed % max(len(kinds), 1)
    for number, kind in enumerate(cycle(kinds[first:] + kinds[:first])):
        name = f"{kind}-{number}"
        if kind == "primitive":
            yield Box(name)
        elif kind == "propose":
            yield Copy(name, objects[(seed + number) % len(objects)])
        elif kind == "surface":
            yield Picture(name)
        else:
            yield Line(name)


def _rounded(place: Array) -> list[float]:
    return [round(float(part), 4) for part in place]
