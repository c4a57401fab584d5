"""How long what people move is reported wrongly, while it can be seen."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.evaluate.answers import MIN_VISIBLE, is_right
from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.evaluate.random_rooms.filming import RoomFilm
from benchmarks.evaluate.random_rooms.scanning import scan_of
from benchmarks.evaluate.random_rooms.staging import SEQUENCE, staged
from benchmarks.evaluate.random_rooms.tracking import CameraError, Judged, RoomTrial
from benchmarks.random_rooms.room import random_room
from studio.console.rows import Row, at_least, at_most
from studio.session.trackers.methods import make_method

FRAME_S = 0.1
"""Time between pictures of a sequence."""

RECOVERY_BAR_S, RIGHT_BAR = 0.5, 85.0
"""Seconds until an object is right again, 95th percentile; percent of frames that are right."""


def measure_recovery(seed: int) -> list[list[bool]]:
    """For each object that is moved, picture by picture while it is seen, whether it is right."""
    room = random_room(seed)
    play, scan = staged(room), scan_of(room)
    film = RoomFilm(room, play, cache=TakeCache(), advance=lambda share: None)
    method = make_method("own", scan)
    error = CameraError()
    trial = RoomTrial(room, scan, method, camera_error=error, stopwatch_ns=lambda: 0)
    right: dict[str, list[bool]] = {name: [] for name in play.moving}
    for judged in trial.session(SEQUENCE, film.sequence()):
        for name in play.moving:
            answer = _of(judged, name).answer
            if answer.is_moved and answer.seen.fraction >= MIN_VISIBLE:
                right[name].append(is_right(answer))
    return list(right.values())


def recovery_rows(objects: Iterable[Sequence[bool]]) -> list[Row]:
    """Figures over all objects that were moved."""
    objects = [list(right) for right in objects if right]
    runs = [count * FRAME_S for right in objects for count in wrong_runs(right)] or [0.0]
    frames = [is_frame_right for right in objects for is_frame_right in right] or [True]
    return [
        at_most("filter.recovery_s.p95", float(np.percentile(runs, 95)), "s", bar=RECOVERY_BAR_S),
        Row("filter.recovery_s.p50", float(np.median(runs)), "s"),
        Row("filter.losses", float(sum(len(wrong_runs(right)) for right in objects)), ""),
        at_least("filter.right_percent", 100.0 * float(np.mean(frames)), "%", bar=RIGHT_BAR),
        Row("filter.of", float(len(frames)), ""),
    ]


def wrong_runs(right: Sequence[bool]) -> list[int]:
    """Lengths of the runs of pictures in which an object is wrong."""
    runs: list[int] = []
    count = 0
    for is_frame_right in (*right, True):
        if is_frame_right and count:
            runs.append(count)
        count = 0 if is_frame_right else count + 1
    return runs


def _of(judged: Sequence[Judged], name: str) -> Judged:
    return next(item for item in judged if item.answer.object_id == name)
