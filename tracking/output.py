"""Input and output common to all tracking methods, so that they can be exchanged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Protocol, TypeVar, runtime_checkable

from devices.messages import Frame
from scenes.pose import Pose
from scenes.state import TrackedObject
from tracking.options import TrackerOptions

Stopwatch = Callable[[], int]
"""Returns nanoseconds from any origin; only differences are used, and no pose depends on them."""


STAGES = ("rectify", "detect", "pose", "smooth")
"""Names of the timed stages, in the order they run."""


class CameraMoment(StrEnum):
    """What happened to the camera's pose."""

    BUMPED = "bumped"
    FOUND = "found"
    NOT_FOUND = "not-found"


@dataclass(frozen=True, slots=True)
class CameraNotice:
    """A moment of which somebody who watches must know.

    From `BUMPED` to `FOUND` objects keep the poses that they had. After `NOT_FOUND` they keep them,
    too, while the camera is looked for near its old place; moved farther, it must be located anew.

    Attributes:
        moment: what happened.
        turned_deg: by how much the camera turned; None if that is not known.
        shifted_cm: likewise how far it was shifted.
        since_s: time since the bump was noticed, seconds.
    """

    moment: CameraMoment
    turned_deg: float | None = None
    shifted_cm: float | None = None
    since_s: float = 0.0

    def described(self) -> str:
        """One line for a log."""
        by = "by an unknown amount"
        if self.turned_deg is not None and self.shifted_cm is not None:
            by = f"by {self.turned_deg:.2f}° and {self.shifted_cm:.1f} cm"
        match self.moment:
            case CameraMoment.BUMPED:
                return f"the camera was moved {by}; objects are held"
            case CameraMoment.FOUND:
                return f"the camera's pose is known again after {self.since_s:.1f} s: moved {by}"
            case CameraMoment.NOT_FOUND:
                return "the camera was moved and is not found near its old place; objects are held"


@dataclass(frozen=True, slots=True, eq=False)
class TrackOutput:
    """Result of one frame.

    Attributes:
        objects: every object of the scene, in the scene's order, whether it moved or not.
        stage_ns: duration of each stage of `STAGES` in ns, measured with the injected stopwatch.
        world_from_rig: camera pose that the method used; None if it had none.
        camera: a line that says whether and how far the camera's pose was refined, or why not;
            empty if the method does not refine it.
        notice: what this frame says of the camera's standing; None while nothing changes.
    """

    objects: tuple[TrackedObject, ...]
    stage_ns: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    world_from_rig: Pose | None = None
    camera: str = ""
    notice: CameraNotice | None = None


State = TypeVar("State")


class TrackingMethod(Protocol[State]):
    """A method that tracks the objects of one scene: a pure step over an immutable state."""

    def start(self) -> State:
        """The state before the first frame."""
        ...

    def step(self, state: State, frame: Frame, now_ns: int) -> tuple[State, TrackOutput]:
        """Process one frame; frames come in order of time."""
        ...


@runtime_checkable
class Adjustable(Protocol[State]):
    """A tracking method whose settings may change while it runs."""

    def adjusted(self, state: State, options: TrackerOptions) -> State:
        """The state with other settings, which hold from the next frame on."""
        ...


def no_stopwatch() -> int:
    """A stopwatch that stands still: every stage takes 0 ns."""
    return 0
