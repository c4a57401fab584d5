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
    """Events of the camera's pose."""

    BUMPED = "bumped"
    FOUND = "found"
    NOT_FOUND = "not-found"


@dataclass(frozen=True, slots=True)
class CameraNotice:
    """A moment of which somebody who watches must know.

    A bump that the pictures explain is followed by `FOUND` at once, in the same frame. While they
    explain nothing, objects keep the poses that they had; `NOT_FOUND` says that the camera is not
    near its old place, or its view is blocked: it has to be freed or located anew. It is looked for
    on, and `FOUND` then says so.

    Attributes:
        moment: what happened.
        turned_deg: by how much the camera turned, degrees.
        shifted_cm: how far it was shifted, centimetres.
        since_s: for how long its pictures had explained nothing, seconds.
    """

    moment: CameraMoment
    turned_deg: float = 0.0
    shifted_cm: float = 0.0
    since_s: float = 0.0

    def described(self) -> str:
        """One line for a log."""
        by = f"by {self.turned_deg:.2f}° and {self.shifted_cm:.1f} cm"
        match self.moment:
            case CameraMoment.BUMPED:
                return f"the camera was moved {by}"
            case CameraMoment.FOUND:
                return f"the camera's pose is known, after {self.since_s:.1f} s"
            case CameraMoment.NOT_FOUND:
                return (
                    "the camera is not found near its old place, or its view is blocked; objects "
                    "keep their poses: free its view, or locate it anew"
                )


@dataclass(frozen=True, slots=True, eq=False)
class TrackOutput:
    """Result of one frame.

    Attributes:
        objects: every object of the scene, in the scene's order, whether it moved or not.
        stage_ns: duration of each stage of `STAGES` in ns, measured with the injected stopwatch.
        world_from_rig: camera pose that the method used; None if it had none.
        camera: a line that says whether and how far the camera's pose was refined, or why not;
            empty if the method does not refine it.
        notices: what this frame says of where the camera stands; nothing while it does not change.
    """

    objects: tuple[TrackedObject, ...]
    stage_ns: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    world_from_rig: Pose | None = None
    camera: str = ""
    notices: tuple[CameraNotice, ...] = ()


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
