"""The ground truth of a frame: for recordings, scores and reports, never for a tracker."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.recording_codec import RecordedTruth
from scenes.pose import Pose
from sim.bodies import Body

MOVED_M = 0.01
"""Distance from which an object counts as moved, metres: an error of a good tracker is less."""

MOVED_RAD = math.radians(2.0)
"""Turn from which it does, radians."""

Masks = Mapping[str, tuple[NDArray[np.bool_], ...]]
"""Per body id one (H, W) bool mask per lens: the pixels in which the lens sees the body."""


@dataclass(frozen=True, slots=True, eq=False)
class PersonTruth:
    """A person as drawn: the body, and `world_from_part` of each of its parts."""

    body: Body
    world_from_part: tuple[Pose, ...]


@dataclass(frozen=True, slots=True, eq=False)
class GroundTruth:
    """Ground truth of a frame. Rides beside the frame, past every stage.

    Recordings, scores and stand-ins for trained networks read it; no tracker does.

    Attributes:
        recorded: true poses and visible fractions, as a recording keeps them.
        masks: where the lenses see each body; None where that was not kept, as in a recording.
        people: every person in the room, by id; empty in a recording.
    """

    recorded: RecordedTruth
    masks: Masks | None = None
    people: Mapping[str, PersonTruth] = field(default_factory=dict[str, PersonTruth])


class IdMasks(Mapping[str, tuple[NDArray[np.bool_], ...]]):
    """Masks kept as one image of body numbers per lens; each mask is computed when it is read.

    Args:
        ids: (H, W) uint8 body numbers per lens; 0 is the room.
        numbers: number of each body, by body id.
    """

    def __init__(self, ids: Sequence[NDArray[np.uint8]], numbers: Mapping[str, int]) -> None:
        self._ids = tuple(ids)
        self._numbers = dict(numbers)

    def __getitem__(self, body_id: str) -> tuple[NDArray[np.bool_], ...]:
        """One (H, W) bool mask per lens of one body."""
        number = self._numbers[body_id]
        return tuple(ids == number for ids in self._ids)

    def __iter__(self) -> Iterator[str]:
        """The body ids."""
        return iter(self._numbers)

    def __len__(self) -> int:
        """Number of bodies."""
        return len(self._numbers)


def has_moved(world_from_first: Pose, world_from_now: Pose) -> bool:
    """Whether an object is elsewhere than at first, or turned."""
    turned = math.acos(
        np.clip(
            0.5 * (np.trace(world_from_first.rotation.T @ world_from_now.rotation) - 1.0), -1.0, 1.0
        )
    )
    return (
        float(np.linalg.norm(world_from_now.translation - world_from_first.translation)) > MOVED_M
        or turned > MOVED_RAD
    )
