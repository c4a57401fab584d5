"""A thread that draws all small pictures, one after the other, in a bounded share of the time."""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

from devices.clock import Clock, WallClock
from devices.streams import Slot, StreamClosedError
from scenes.workers.task import Task
from studio.app.viewport.drawing.pacing import Grade
from studio.app.viewport.drawing.painter import Painted
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.view_picture import View, draw_view

T = TypeVar("T")

SHARE = 1 / 3
"""Of the time that drawing all small pictures takes at most, whatever their number. Measured with
two people walking through 300 k splats on two cores, other work beside it: at 1/5 the view in the
middle is as fast as without any and two small pictures come 4.0 times a second each; at 1/3 it
loses 17 % (38.6 to 32.2 pictures/s) and they come 7.0 times (`insets` in
`studio/app/measure/child.py`)."""


class Turns(Generic[T]):
    """The latest request of each key; the one that was drawn longest ago has its turn."""

    def __init__(self) -> None:
        self._wanted: dict[str, T] = {}
        self._drawn: list[str] = []

    def ask(self, key: str, value: T) -> None:
        """Replace what was asked for by that key."""
        self._wanted[key] = value

    def forget(self, key: str) -> None:
        """The key wants nothing more."""
        self._wanted.pop(key, None)
        if key in self._drawn:
            self._drawn.remove(key)

    def next(self) -> tuple[str, T] | None:
        """Key and request whose turn it is, which are taken; None if nothing was asked for."""
        if not self._wanted:
            return None
        key = min(self._wanted, key=self._place)
        if key in self._drawn:
            self._drawn.remove(key)
        self._drawn.append(key)
        return key, self._wanted.pop(key)

    def _place(self, key: str) -> int:
        """Behind how many others it was drawn: never drawn comes first."""
        return self._drawn.index(key) if key in self._drawn else -1


def rest_s(took_s: float, share: float = SHARE) -> float:
    """How long to rest after a picture, so that drawing takes no more than a share of the time."""
    return took_s * (1.0 / share - 1.0)


GRADE = Grade(1.0, thinned=True)
"""Small pictures have fewer pixels than the thinned room has splats: more are not seen in them."""


class InsetPainter:
    """Draws what was asked for last under each key, each in its turn; see `turns`.

    Args:
        drawing: of the scene, shared with the views.
        clock: says what time it is.
    """

    def __init__(self, drawing: SceneDrawing, clock: Clock | None = None) -> None:
        self._drawing = drawing
        self._clock = clock or WallClock()
        self._turns: Turns[View] = Turns()
        self._pictures: dict[str, Slot[Painted]] = {}
        self._changed = threading.Condition()
        self._task = Task("inset painter", self._run)
        self._task.start()

    def show(self, key: str, view: View) -> None:
        """Ask for a picture; an older request of that key that was not begun is forgotten."""
        with self._changed:
            self._pictures.setdefault(key, Slot())
            self._turns.ask(key, view)
            self._changed.notify_all()

    def take(self, key: str) -> Painted | None:
        """The newest picture of a key, once; None if there is no new one."""
        with self._changed:
            slot = self._pictures.get(key)
        return None if slot is None else slot.take()

    def forget(self, key: str) -> None:
        """The key wants no more pictures."""
        with self._changed:
            self._turns.forget(key)
            slot = self._pictures.pop(key, None)
        if slot is not None:
            slot.close()

    def stop(self) -> None:
        """Finish the picture in hand and end."""
        self._task.cancel()
        with self._changed:
            self._changed.notify_all()
        self._task.join()

    def _run(self, task: Task[None]) -> None:
        while (turn := self._next()) is not None:
            key, view = turn
            # Whoever comes first prepares what all views draw with: it takes a second, once.
            self._drawing.prepare()
            begun_ns = self._clock.now_ns()
            picture, depth = draw_view(self._drawing, view, grade=GRADE)
            took_ns = self._clock.now_ns() - begun_ns
            with self._changed:
                slot = self._pictures.get(key)
            if slot is not None:
                try:
                    slot.put(Painted(picture, depth, view, GRADE, took_ns))
                except StreamClosedError:
                    continue  # closed meanwhile
            task.pause(rest_s(took_ns / 1e9))

    def _next(self) -> tuple[str, View] | None:
        with self._changed:
            while not self._task.is_cancelled:
                turn = self._turns.next()
                if turn is not None:
                    return turn
                self._changed.wait()
        return None
