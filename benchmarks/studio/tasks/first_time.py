"""First-time tasks: what a stranger wants on the first day, by mouse and keys, every click counted.

Nothing is read but the words on buttons, menus and tabs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog

from benchmarks.studio.process import measured
from benchmarks.studio.shown import has_picture, shown_window
from benchmarks.studio.tasks.clicking import DeadEndError, Hand
from studio.console.rows import Row, at_most

if TYPE_CHECKING:  # imports of the window come with it
    from studio.app.model.documents.document import Document

CLICKS_BAR = 8
"""Clicks that a task may take."""

CEILING_M = 2.6
"""Of the room that is brought, known to who brings it."""

FORK_AT_S = 1.0
"""Instant at which the run of three seconds is forked."""


def task_rows() -> list[Row]:
    """Clicks of every task, and how many had a dead end; in a process of its own."""
    import sys
    import tempfile

    with tempfile.TemporaryDirectory(prefix="nexus-tasks-") as folder:
        found = measured("tasks", folder)
    for words in found["dead_ends"]:
        print(words, file=sys.stderr)
    return [
        *(
            at_most(f"studio.tasks.{name}.clicks", clicks, "", bar=CLICKS_BAR)
            for name, clicks in found["clicks"].items()
        ),
        at_most("studio.tasks.dead_ends", len(found["dead_ends"]), "", bar=0),
    ]


def first_time(folder: str) -> dict[str, Any]:
    """Do all tasks; clicks by task, and where one could not be done, in words."""
    from benchmarks.studio.tasks.crate import crate_marks, crate_scene
    from scenes.package import save_package
    from studio.app.model.documents.document import Document

    where = Path(folder)
    own, crate = where / "own.ply", where / "crate.gnx"
    own_splats(own)
    save_package(crate_scene(), crate)
    mark = crate_marks(crate_scene())[0]
    assert mark.box is not None
    runs: list[Path] = []
    clicks: dict[str, int] = {}
    dead_ends: list[str] = []
    stories: tuple[tuple[Document, Mapping[str, Callable[[Hand], object]]], ...] = (
        (Document("desk"), {"open_own_splats": partial(open_own_splats, path=own)}),
        (
            Document(str(crate)),
            {"cut": partial(cut, view=mark.view, box_px=mark.box, name="Crate")},
        ),
        (
            Document("lab", scenario_name="lab-short"),
            {
                "arrange": partial(arrange, name="Chair 1"),
                "rehearse": lambda hand: runs.append(rehearse(hand)),
                "rehearse_again": lambda hand: runs.append(rehearse(hand)),
                "find_first_run": lambda hand: find_the_first_run(hand, runs[0]),
                "fork_and_compare": partial(fork_and_compare, at_s=FORK_AT_S),
                "share": share,
            },
        ),
    )
    for document, tasks in stories:
        window, wait = shown_window(document, home=where / "home")
        window.run.out = where / "sessions"
        wait(lambda shown=window: shown.is_filled and has_picture(shown))
        window.bench.set(has_started=True)
        QApplication.setActiveWindow(window)  # where no window manager would
        for name, task in tasks.items():
            hand = Hand(window, wait)
            try:
                task(hand)
            except DeadEndError as error:
                dead_ends.append(f"{name}: {error}")
                break
            finally:
                clicks[name] = hand.clicks
        window.close()
    return {"clicks": clicks, "dead_ends": dead_ends}


# --- the tasks ------------------------------------------------------------------------------------


def open_own_splats(hand: Hand, path: Path) -> None:
    """A splat file of another program becomes a room that people can walk in."""
    bench = hand.window.bench
    hand.will_choose(path)
    hand.button("Open", hand.window.menus.toolbar)
    hand.until(lambda: bench.document.scene == str(path) and bench.scene is not None, "own splats")
    hand.button("Make a room of it")
    page = hand.window.content("preparation").room
    hand.type(page.ceiling, f"{CEILING_M:g}")
    hand.button("Prepare", page)
    hand.until(
        lambda: bench.document.scene.endswith(".gnx") and bench.scene is not None, "a room of it"
    )


def cut(hand: Hand, view: str, box_px: tuple[float, float, float, float], name: str) -> None:
    """An object of the scan becomes movable.

    Args:
        hand: that does it.
        view: one in which the object is seen.
        box_px: left, top, right, bottom around it there.
        name: what it is to be called.
    """
    bench = hand.window.bench
    hand.tab("Preparation")
    hand.tab("Objects")
    page = hand.window.content("preparation").cut
    hand.button("Show views", page)
    hand.until(lambda: page.views.count() > 0, "views to mark in")
    if page.views.currentText() != view:
        hand.clicks += 2  # the list of views, and one of them
        page.views.setCurrentText(view)
    area, image = page.marker._area(), page.marker._image
    scale = area.width() / image.width()
    low, high = (area.topLeft().toPoint() + QPoint(*_px(scale, box_px[k : k + 2])) for k in (0, 2))
    hand.drag(page.marker, low, high)
    hand.type(page.name, name)
    hand.button("Cut out", page)
    hand.until(lambda: bench.scene is not None and bool(bench.scene.objects), "a movable object")


def arrange(hand: Hand, name: str) -> None:
    """An object is moved by hand, and a box is put beside it."""
    window, bench = hand.window, hand.window.bench
    hand.tab("Twin")
    dock = window.content("twin")
    rows = dock.tree.findItems(name, Qt.MatchFlag.MatchExactly | Qt.MatchFlag.MatchRecursive)
    hand.press(dock.tree.viewport(), dock.tree.visualItemRect(rows[0]).center())
    item = bench.selection
    QTest.keyClick(window, Qt.Key.Key_2)  # the tool that moves
    view = window.view.active
    hand.until(lambda: view._handles().gizmo is not None, "arrows to drag")
    start, end = (QPoint(*map(round, at)) for at in view._handles().gizmo.lines()["x"])
    hand.drag(view, start + (end - start) * 0.7, start + (end - start) * 1.3)
    hand.until(lambda: item in bench.document.twin.poses, "what was dragged has moved")


def rehearse(hand: Hand) -> Path:
    """A session is played and recorded; gives its recording."""
    window, bench = hand.window, hand.window.bench
    before = bench.recording
    hand.button("Rehearse", window.menus.toolbar)
    hand.until(
        lambda: bench.recording not in (None, before) and not window.run.is_busy, "a session"
    )
    timeline = window.content("timeline")
    hand.until(lambda: timeline.is_open, "its recording")
    return bench.recording


def find_the_first_run(hand: Hand, first: Path) -> None:
    """The session before the last is opened again."""
    bench = hand.window.bench
    hand.tab("Sessions")
    dock = hand.window.content("sessions")
    row = dock.table.topLevelItem(dock.table.topLevelItemCount() - 1)
    hand.press(dock.table.viewport(), dock.table.visualItemRect(row).center())
    hand.button("Open", dock)
    hand.until(lambda: bench.recording == first, "the first run")


def fork_and_compare(hand: Hand, at_s: float) -> None:
    """From an instant on things go another way, and both ways are looked at."""
    window = hand.window
    timeline = window.content("timeline")
    hand.until(lambda: timeline.is_open, "the recording")
    hand.tab("Scenario")
    hand.tab("Faults")
    knobs = window.content("scenario").knobs
    row = knobs._rows["blur", 0]
    hand.press(row.box, QPoint(8, row.box.height() // 2))
    tracks = timeline.tracks
    hand.press(tracks, QPoint(round(tracks.x_of(round(at_s * 1e9))), 10))
    hand.button("Fork here", timeline)
    hand.until(lambda: timeline.comparison is not None and timeline.view.isVisible(), "A and B")


def share(hand: Hand) -> None:
    """Film, viewer and sheet are made, and shown in their folder."""
    window = hand.window
    hand.button("Share", window.menus.toolbar)
    asked = [each for each in window.findChildren(QDialog) if each.isVisible()]
    if asked:  # where to, and what of it
        hand.button("Share", asked[0])
    hand.until(lambda: not window.run.is_sharing, "what can be shared")
    hand.until(lambda: "hared" in window.line or "hared" in window.problem.text, "where it is")


def _px(scale: float, place: tuple[float, ...]) -> tuple[int, int]:
    return round(scale * place[0]), round(scale * place[1])


# --- what is brought ------------------------------------------------------------------------------
ROOM_M = np.array([4.0, 3.2, CEILING_M])
CRATE_LOW_M, CRATE_HIGH_M = np.array([2.6, 1.9, 0.0]), np.array([3.0, 2.3, 0.5])
"""Corners of the crate in the room that is brought, metres from one of its corners."""


def own_splats(path: Path, *, splats: int = 30_000, units_per_m: float = 1.7) -> None:
    """Write a splat file as other programs do: a room with a crate, y down, of an unknown unit."""
    from scenes.formats.ply import write_ply
    from scenes.frames import WORLD_FROM_FORWARD_CAMERA
    from scenes.harmonics import turned
    from scenes.splats import SplatCloud

    rng = np.random.default_rng(0)
    walls, wall_sides = _on_sides(rng, np.zeros(3), ROOM_M, splats)
    crate, crate_sides = _on_sides(rng, CRATE_LOW_M, CRATE_HIGH_M, splats // 12)
    means = np.concatenate([walls, crate]) * units_per_m
    scales = np.full((len(means), 3), 0.025 * units_per_m, np.float32)
    scales[np.arange(len(means)), np.concatenate([wall_sides, crate_sides])] *= 0.1
    colours = np.concatenate(
        [0.55 + 0.3 * (walls / ROOM_M), np.tile([0.15, 0.3, 0.7], (len(crate), 1))]
    )
    count = len(means)
    cloud = SplatCloud(
        means.astype(np.float32),
        scales,
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.95, np.float32),
        ((colours - 0.5) / 0.2820948)[:, None].astype(np.float32),
    )
    write_ply(path, turned(cloud, WORLD_FROM_FORWARD_CAMERA.inverse()))


def _on_sides(
    rng: np.random.Generator, low: NDArray[np.float64], high: NDArray[np.float64], count: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points on the six sides of a box, as many on each as it is large, and across which axis."""
    size = high - low
    areas = np.array([size[1] * size[2], size[0] * size[2], size[0] * size[1]])
    points = rng.uniform(low, high, (count, 3))
    side = rng.choice(3, count, p=areas / areas.sum())
    rows = np.arange(count)
    points[rows, side] = np.where(rng.random(count) < 0.5, low[side], high[side])
    return points, side
