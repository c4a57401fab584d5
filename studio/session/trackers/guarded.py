"""A tracker of somebody else in a session that goes on whatever the tracker does."""

from __future__ import annotations

import ctypes
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar, cast

import numpy as np

from devices.messages import Frame
from scenes.package import ScenePackage
from scenes.state import TrackedObject, TrackState
from scenes.workers.task import Task
from studio.session.trackers.methods import MethodMaker
from tracking.output import TrackingMethod, TrackOutput

FIRST_LIMIT_S = 30.0
"""Seconds that making a tracker, and its first frame, may take: ours needs some five of them."""

LIMIT_S = 5.0
"""Seconds that any later frame may take; what takes longer is taken to loop."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class GuardedState:
    """State of a guarded tracker.

    Attributes:
        inner: the tracker's own.
        is_first: whether it has seen no frame.
        is_out: whether it failed: it is not asked again.
        last: its last answer.
    """

    inner: Any
    is_first: bool = True
    is_out: bool = False
    last: tuple[TrackedObject, ...] = ()


class TrackerStoppedError(Exception):
    """Raised inside a tracker that does not end."""


@dataclass(slots=True)
class _Answer(Generic[T]):
    value: T | None = None
    problem: str = ""


class GuardedMethod:
    """Asks a tracker on a thread; one that raises, loops or answers wrongly is asked no more.

    From then on its objects stay where it had them, as lost, and the session goes on.

    Args:
        name: of the tracker, for messages.
        make: makes it.
        scene: that it is for.
        say: takes the one line that says what went wrong; called on the session's thread.
        first_limit_s: seconds for making it, and for its first frame.
        limit_s: seconds for any other frame.
    """

    def __init__(
        self,
        name: str,
        make: MethodMaker,
        scene: ScenePackage,
        *,
        say: Callable[[str], None],
        first_limit_s: float = FIRST_LIMIT_S,
        limit_s: float = LIMIT_S,
    ) -> None:
        self._name, self._scene, self._say = name, scene, say
        self._first_limit_s, self._limit_s = first_limit_s, limit_s
        self._method: TrackingMethod[Any] | None = self._ask(
            lambda: _whole(make(scene)), first_limit_s
        )

    def start(self) -> GuardedState:
        """See `TrackingMethod.start`."""
        method = self._method
        if method is None:
            return GuardedState(None, is_out=True)
        began = self._ask(lambda: (method.start(),), self._first_limit_s)
        return GuardedState(None, is_out=True) if began is None else GuardedState(began[0])

    def step(
        self, state: GuardedState, frame: Frame, now_ns: int
    ) -> tuple[GuardedState, TrackOutput]:
        """See `TrackingMethod.step`; never raises, and takes no longer than the limit."""
        method = self._method
        if state.is_out or method is None:
            return state, self._lost(state, frame)
        limit_s = self._first_limit_s if state.is_first else self._limit_s
        answer = self._ask(
            lambda: self._checked(method.step(state.inner, frame, now_ns), frame), limit_s
        )
        if answer is None:
            out = replace(state, is_out=True)
            return out, self._lost(out, frame)
        inner, output = answer
        return GuardedState(inner, is_first=False, last=output.objects), output

    def _ask(self, work: Callable[[], T], limit_s: float) -> T | None:
        """Return the tracker's answer; None if there is none, which has been said then."""
        answer: _Answer[T] = _Answer()

        def run(_task: Task[None]) -> None:
            try:
                answer.value = work()
            except BaseException as error:  # noqa: BLE001 - also sys.exit: the session goes on
                answer.problem = _words(error)

        task = Task(f"tracker {self._name}", run).start()
        if not task.join(limit_s):
            problem = f"{_place_of(task)}does not end ({limit_s:g} s a frame): is there a loop?"
            _stop(task)
        elif answer.problem:
            problem = answer.problem
        else:
            return answer.value
        self._say(
            f"tracker {self._name}: {problem} It is asked no more in this session, its objects "
            "stay where they were; mend its file, save it, and begin the session again."
        )
        return None

    def _checked(self, answer: object, frame: Frame) -> tuple[Any, TrackOutput]:
        """The answer, if it is one.

        Raises:
            TypeError, ValueError: it is not; says what is wrong with it.
        """
        if not isinstance(answer, tuple):
            raise TypeError(f"step gave {type(answer).__name__}, wanted (state, TrackOutput)")
        pair = cast(tuple[Any, ...], answer)
        if len(pair) != 2 or not isinstance(pair[1], TrackOutput):
            raise TypeError(f"step gave {len(pair)} values, wanted (state, TrackOutput)")
        output = pair[1]
        found = [track.object_id for track in output.objects]
        wanted = [item.object_id for item in self._scene.objects]
        if found != wanted:
            raise ValueError(
                f"frame {frame.seq}: tracks of {found}, wanted {wanted}, in that order"
            )
        for track in output.objects:
            if not np.isfinite(track.world_from_object.matrix()).all():
                raise ValueError(f"frame {frame.seq}: the pose of {track.object_id} is not finite")
        return pair[0], output

    def _lost(self, state: GuardedState, frame: Frame) -> TrackOutput:
        """Every object where it was last, as lost."""
        known = {track.object_id: track.world_from_object for track in state.last}
        tracks = tuple(
            TrackedObject(
                object_id=item.object_id,
                t_ns=frame.t_ns,
                world_from_object=known.get(item.object_id, item.world_from_object),
                covariance=np.eye(4),
                visible_fraction=0.0,
                state=TrackState.LOST,
                confidence=0.0,
                source_seq=frame.seq,
            )
            for item in self._scene.objects
        )
        return TrackOutput(tracks, world_from_rig=frame.world_from_rig)


def _whole(method: object) -> TrackingMethod[Any]:
    """Return the object, if it is a tracker.

    Raises:
        TypeError: it has no `start` or `step`.
    """
    missing = [name for name in ("start", "step") if not callable(getattr(method, name, None))]
    if missing:
        raise TypeError(f"a {type(method).__name__} was made, which has no {missing[0]}()")
    return cast(TrackingMethod[Any], method)


def _words(error: BaseException) -> str:
    """File, line and message of what a tracker raised."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename != __file__]
    place = f"{own[-1].filename}:{own[-1].lineno}: " if own else ""
    return f"{place}{type(error).__name__}: {' '.join(str(error).split())}."


def _place_of(task: Task[None]) -> str:
    """File and line that a task is at."""
    frame = sys._current_frames().get(task.thread_id or -1)
    return "" if frame is None else f"{frame.f_code.co_filename}:{frame.f_lineno}: "


def _stop(task: Task[None]) -> None:
    """Ask a task to end at its next line of Python: a loop there would cost a core for good."""
    number = ctypes.c_ulong(task.thread_id or 0)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(number, ctypes.py_object(TrackerStoppedError))
