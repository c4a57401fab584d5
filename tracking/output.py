"""Input and output common to all tracking methods, so that they can be exchanged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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


@dataclass(frozen=True, slots=True, eq=False)
class TrackOutput:
    """Result of one frame.

    Attributes:
        objects: every object of the scene, in the scene's order, whether it moved or not.
        stage_ns: duration of each stage of `STAGES` in ns, measured with the injected stopwatch.
        world_from_rig: camera pose that the method used; None if it had none.
        camera: a line that says whether and how far the camera's pose was refined, or why not;
            empty if the method does not refine it.
    """

    objects: tuple[TrackedObject, ...]
    stage_ns: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    world_from_rig: Pose | None = None
    camera: str = ""


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
