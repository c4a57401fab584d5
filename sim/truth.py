"""What really is the case at a frame: for reports, never for the tracker."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose

Masks = Mapping[str, tuple[NDArray[np.bool_], ...]]
"""Per body id one (H, W) bool mask per lens: where the body is seen."""


@dataclass(frozen=True, slots=True, eq=False)
class TruthFrame:
    """The truth of one frame.

    Attributes:
        seq: of the frame.
        t_ns: its capture time.
        world_from_object: every object's pose.
        visible_fraction: per object, 0..1 of its picture (over all lenses) that nothing hides.
        moved: objects that are not where the session began, by more than a hair.
        world_from_rig: where the camera really stands.
        masks: where each object is seen, or None where it was not kept.
    """

    seq: int
    t_ns: int
    world_from_object: Mapping[str, Pose]
    visible_fraction: Mapping[str, float]
    moved: frozenset[str]
    world_from_rig: Pose
    masks: Masks | None


class IdMasks(Mapping[str, tuple[NDArray[np.bool_], ...]]):
    """Masks kept as one picture of body numbers per lens and cut out when asked for.

    Args:
        ids: (H, W) uint8 per lens; 0 is the room.
        numbers: the number of each body.
    """

    def __init__(self, ids: Sequence[NDArray[np.uint8]], numbers: Mapping[str, int]) -> None:
        self._ids = tuple(ids)
        self._numbers = dict(numbers)

    def __getitem__(self, body_id: str) -> tuple[NDArray[np.bool_], ...]:
        """The masks of one body, one per lens."""
        number = self._numbers[body_id]
        return tuple(ids == number for ids in self._ids)

    def __iter__(self) -> Iterator[str]:
        """The body ids."""
        return iter(self._numbers)

    def __len__(self) -> int:
        """How many bodies there are."""
        return len(self._numbers)
