"""One measurement in a process of its own: `python -m benchmarks.studio.child WHAT`, JSON out."""

from __future__ import annotations

import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.studio.process import BEGIN
from benchmarks.studio.shown import asked_for_answers, has_picture, resident_mb, rest, shown_window
from scenes.memory import give_back_memory

ORBIT_S, INPUT_S = 6.0, 12.0
"""How long is orbited and clicked: some hundred pictures and answers."""

INSET_ROUNDS = 3
"""How often each number of small pictures is measured; the median counts."""

SPLATS = 300_000
"""Of the room that is orbited, as the bar has it."""


def main() -> None:
    """Measure what the command line names, and print one JSON line."""
    what, *rest = sys.argv[1:]
    print(json.dumps(MEASURES[what](*rest)), flush=True)


def opening() -> dict[str, Any]:
    """Seconds from the process's start to the window, and to the first picture of the lab."""
    window, wait = shown_window("lab")
    shown = _since_begin()
    wait(lambda: has_picture(window))
    picture = _since_begin()
    window.close()
    return {"window_s": shown, "first_picture_s": picture}


def orbiting() -> dict[str, Any]:
    """Pictures a second while orbiting 300 k splats at 960 × 540, and the time to a full one."""
    window, wait, view = _dense_window()
    fps = _orbited_fps(window, wait, view)
    stopped = time.monotonic()
    wait(lambda: view.painted.is_full)
    refined = time.monotonic() - stopped
    window.close()
    return {"fps": fps, "refined_ms": 1e3 * refined}


def insets() -> dict[str, Any]:
    """Pictures a second of the same view with 0, 1, 2 and 3 small pictures, and of those.

    The people walk meanwhile: the small pictures change with every state. All numbers of small
    pictures are measured in turn, so that other work on the machine spoils none more than others.
    """
    window, wait, view = _dense_window()
    bench, grid = window.bench, window.view
    sources = ("ana", "ben", "chair-1")
    main: dict[int, list[float]] = {count: [] for count in range(len(sources) + 1)}
    small: dict[int, list[float]] = {count: [] for count in range(len(sources) + 1)}
    for _ in range(INSET_ROUNDS):
        for count in main:
            grid.insets.close_all()
            for source in sources[:count]:
                bench.perform("view.inset", source=source)
            rest(wait, 0.5)
            before = sum(inset.drawn for inset in grid.insets.pictures)
            begin = time.monotonic()
            main[count].append(_orbited_fps(window, wait, view, walks=True))
            drawn = sum(inset.drawn for inset in grid.insets.pictures) - before
            small[count].append(drawn / (time.monotonic() - begin) / max(count, 1))
    window.close()
    return {
        "fps": {count: float(np.median(found)) for count, found in main.items()},
        "all_fps": main,
        "inset_fps": {count: float(np.median(found)) for count, found in small.items()},
    }


def _dense_window() -> tuple[Any, Any, Any]:
    """A window on the lab with 300 k splats and two people, what waits for it, its view."""
    window, wait = shown_window("lab")
    wait(lambda: has_picture(window))
    bench, scene = window.bench, window.bench.scene
    assert scene is not None
    bench.show_scene(replace(scene, room=_denser(scene.room, SPLATS)))
    _people_at(bench, 0.0)
    grid: Any = window.view
    view = grid.active
    view.setFixedSize(960, 540)
    wait(lambda: view.painted is not None and view.painted.is_full)
    rest(wait, 4.0)  # the thinned room is made meanwhile
    return window, wait, view


def _people_at(bench: Any, shift_m: float) -> None:
    """Ana and Ben, so far from where they were first."""
    from scenes.frames import look_at
    from scenes.state import Avatar, SceneState

    avatars: dict[str, Avatar] = {}
    for name, x in (("ana", 0.5), ("ben", -0.5)):
        head = look_at(np.array([x, 1.0 - shift_m, 1.65]), np.array([0.0, 0.0, 1.0]))
        avatars[name] = Avatar(name, "remote", head)
    bench.show_state(SceneState(avatars=avatars))


def _orbited_fps(window: Any, wait: Any, view: Any, *, walks: bool = False) -> float:
    """Pictures a second while the view turns, and people walk if they are to."""
    pictures, begin = [], time.monotonic()
    while time.monotonic() - begin < ORBIT_S:
        before = view.painted
        if walks:
            _people_at(window.bench, 0.5 * (time.monotonic() - begin) / ORBIT_S)
        window.bench.do("view.orbit", yaw_deg=0.6)
        wait(lambda before=before: view.painted is not before)
        pictures.append(time.monotonic())
    return len(pictures) / (pictures[-1] - begin)


def answering() -> dict[str, Any]:
    """Milliseconds until the window has answered an input while a session plays."""
    window, wait = shown_window("lab")
    wait(lambda: window.is_filled and has_picture(window))
    window.bench.perform("session.rehearse")
    wait(lambda: window.run.output is not None)
    took: list[float] = []
    with asked_for_answers(window, took.append):
        rest(wait, INPUT_S)
    window.close()
    return {"input_ms": took}


def open_close(rounds: str) -> dict[str, Any]:
    """Resident memory after each round of open, rehearse, close; in MB."""
    from studio.app.model.documents.document import Document
    from studio.app.window import dispose

    resident: list[float] = []
    scenario = SHORT.read_text(encoding="utf-8")
    for _ in range(int(rounds)):
        document = Document("lab", scenario_name="short", scenario=scenario)
        window, wait = shown_window(document)
        wait(lambda window=window: window.is_filled and has_picture(window))
        window.bench.perform("session.rehearse")
        wait(lambda window=window: not window.run.is_busy)
        window.close()
        dispose(window)
        rest(wait, 0.3)
        del window, wait
        give_back_memory()  # what is free is no leak
        resident.append(resident_mb())
    return {"resident_mb": resident}


def editing(home: str) -> dict[str, Any]:
    """Edit without end, see `killing.edit_for_ever`."""
    from benchmarks.studio.killing import edit_for_ever

    edit_for_ever(Path(home))
    return {}


def soaking(seconds: str, folder: str) -> dict[str, Any]:
    """One window in sessions for so long; samples go to `soak.csv` in the folder."""
    from benchmarks.studio.soaking import OVERTIME, SESSION_S, SETTLED_S, Sampler, scenario_of
    from studio.app.model.documents.document import Document

    where, end_s = Path(folder), time.monotonic() + float(seconds)
    scenario = scenario_of(min(float(seconds), SESSION_S))
    document = Document("lab", scenario_name="soak", scenario=scenario)
    window, wait = shown_window(document, home=where / "home")
    window.run.out = where / "session"
    wait(lambda: window.is_filled and has_picture(window))

    def tracking_ms(frames: int) -> float:
        session = None if window.run.job is None else window.run.job.session
        stages = () if session is None or not frames else session.latencies.stages(last=frames)
        return next((stage.p95_ms for stage in stages if stage.name == "track"), math.nan)

    sampler = Sampler(
        where / "soak.csv",
        resident_mb=resident_mb,
        threads=threading.active_count,
        frame_ms=tracking_ms,
    )
    seen: object = None

    def is_over() -> bool:
        nonlocal seen
        output = window.run.output
        if output is not None and output is not seen:
            seen = output
            sampler.late(1e-6 * (output.now_ns - output.input.frame.t_ns))
        sampler.tick()
        return not window.run.is_playing

    failure = ""
    with asked_for_answers(window, sampler.answered):
        while not failure and time.monotonic() < end_s - 1.0:
            window.bench.perform("session.rehearse", paced=True)
            late_s = OVERTIME * float(seconds) + SETTLED_S
            try:
                wait(is_over, limit_s=end_s + late_s - time.monotonic())
            except TimeoutError:
                window.run.stop()
                failure = f"{late_s:.0f} s late: the machine does not keep up with the session"
            job = window.run.job
            if not failure and job is not None and job.failure is not None:
                failure = str(job.failure)
    ended_mb = resident_mb()
    window.close()
    return {"failure": failure, "ended_mb": ended_mb}


def using(seconds: str, folder: str) -> dict[str, Any]:
    """One window that opens, plays, films and closes for so long, see `using.used`."""
    from benchmarks.studio.using import used

    return {"resident_mb": used(float(seconds), Path(folder))}


def step(name: str, folder: str) -> dict[str, Any]:
    """Figures of the steps that one measurement gives, see `steps.MEASUREMENTS`."""
    from benchmarks.studio.tasks import designer, operator, scaling, tester

    for module in (designer, scaling, operator, tester):
        measure = getattr(module, name, None)
        if measure is not None:
            return {"rows": [asdict(row) for row in measure(Path(folder))]}
    raise ValueError(f"no measurement {name!r}")


def tasks(folder: str) -> dict[str, Any]:
    """Clicks of the first-time tasks, see `first_time.first_time`."""
    from benchmarks.studio.tasks.first_time import first_time

    return first_time(folder)


SHORT = Path(__file__).with_name("short.toml")
"""A rehearsal of a second: what is repeated fifty times."""

MEASURES: dict[str, Callable[..., dict[str, Any]]] = {
    "opening": opening,
    "orbiting": orbiting,
    "insets": insets,
    "answering": answering,
    "open_close": open_close,
    "editing": editing,
    "soaking": soaking,
    "step": step,
    "using": using,
    "tasks": tasks,
}


def _denser(room: Any, count: int) -> Any:
    """The room with its splats repeated to so many, each repeat moved by millimetres."""
    from scenes.splats import SplatCloud

    rng = np.random.default_rng(0)
    chosen = np.arange(count) % len(room)
    jitter = rng.normal(0.0, 0.004, (count, 3)).astype(np.float32)
    return SplatCloud(
        room.means[chosen] + jitter,
        room.scales[chosen],
        room.rotations[chosen],
        room.opacities[chosen],
        room.sh[chosen],
    )


def _since_begin() -> float:
    return time.monotonic() - float(os.environ[BEGIN])


if __name__ == "__main__":
    main()
