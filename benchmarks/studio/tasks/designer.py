"""Measures of a designer's day: an own room, cutting, physics, sharing."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.studio.shown import has_picture, rest, shown_window
from studio.console.rows import Row, at_least, at_most

SPLATS = 1_000_000
"""Of the room that is dropped, as the table has it."""

LOAD_BAR_S, CANCEL_BAR_S = 10.0, 2.0
SINK_BAR_MM, JITTER_BAR_MM, WALL_BAR_MM = 5.0, 1.0, 20.0
"""Bars; the wall's is the collision margin of the physics and what its solver lets in, see
`tests/sim/physics/test_by_hand.py`."""

CUT_BAR_S, CUT_CLICKS_BAR = 60.0, 8
CAST_CLICKS_BAR, SURFACE_BAR_PX, SURFACE_CLICKS_BAR, SHARE_CLICKS_BAR = 12, 2.0, 5, 3

PULL_S, REST_S, WATCHED_S = 3.0, 2.0, 1.0
"""How long a chair is dragged, a book falls and lies, and is watched, seconds."""


def own_room(folder: Path) -> list[Row]:
    """D3: a million splats are dropped on the window; and once more, cancelled on the way."""
    from scenes.formats.registry import write_splats

    path = folder / "own-room.ply"
    write_splats(path, _room_like(SPLATS))
    window, wait = shown_window("desk")
    wait(lambda: window.is_filled and has_picture(window))
    lines: set[str] = set()

    def is_there() -> bool:
        lines.add(window.line)
        scene = window.bench.scene
        return scene is not None and scene.name == path.name and has_picture(window)

    begin = time.monotonic()
    assert window.bench.do("file.drop", paths=[str(path)])
    wait(is_there)
    loaded_s = time.monotonic() - begin
    assert window.bench.scene is not None
    count = len(window.bench.scene.room)
    window.bench.perform("file.drop", paths=[str(path)])
    rest(wait, 0.2)
    begin = time.monotonic()
    window.bench.do("session.stop")
    wait(lambda: not window.run.is_busy)
    cancelled_s = time.monotonic() - begin
    window.close()
    return [
        at_most("studio.D3.load_s", loaded_s, "s", bar=LOAD_BAR_S),
        at_least("studio.D3.splats", count, "", bar=SPLATS),
        at_least("studio.D3.progress_lines", len(lines), "", bar=2),
        at_most("studio.D3.cancel_s", cancelled_s, "s", bar=CANCEL_BAR_S),
    ]


def cutting(folder: Path) -> list[Row]:
    """D5: a crate is cut out of a scan by a box in three views, and the cut is undone."""
    from benchmarks.studio.tasks.crate import crate_marks, crate_scene
    from scenes.package import load_package, save_package
    from studio.app.preparation.cut_job import CutJob, undo

    scene = folder / "crate.gnx"
    save_package(crate_scene(), scene)
    marks = crate_marks(load_package(scene))
    before = _digest(scene)
    begin = time.monotonic()
    job = CutJob(scene, "Crate", marks)
    assert job.wait(300), "the cut hangs"
    assert not job.problem, job.problem
    kept = job.take()
    cut_s = time.monotonic() - begin
    objects = len(load_package(scene).objects)
    undo(scene, kept)
    # A box a view, the name, the button, and the button that takes it.
    clicks = len(marks) + 3
    return [
        at_most("studio.D5.cut_s", cut_s, "s", bar=CUT_BAR_S),
        at_most("studio.D5.clicks", clicks, "", bar=CUT_CLICKS_BAR),
        at_least("studio.D5.objects", objects, "", bar=1),
        at_most("studio.D5.files_changed_by_undo", int(_digest(scene) != before), "", bar=0),
    ]


def by_hand(_folder: Path) -> list[Row]:
    """D6: a chair is dragged through a wall, a book is dropped on the desk."""
    from scenes.opening import open_scene
    from sim.physics.by_hand import physics_by_hand
    from sim.physics.world import STEP_NS

    scene = open_scene("lab")
    physics = physics_by_hand(scene)
    tick_ns = 8 * STEP_NS
    simulated_s, begin = 0.0, time.perf_counter()

    def go_on(seconds: float, object_id: str, target: NDArray[np.float64] | None) -> list[Any]:
        nonlocal simulated_s
        poses = []
        for _ in range(round(seconds * 1e9 / tick_ns)):
            if target is not None:
                physics.pull(object_id, np.array([0.0, 0.0, 0.1]), target)
            physics.step(tick_ns)
            poses.append(physics.object_pose(object_id))
        simulated_s += seconds
        return poses

    wall_x = float(scene.footprint_m[0][0])
    start = physics.object_pose("chair-1").translation
    way = go_on(PULL_S, "chair-1", np.array([wall_x - 2.0, start[1], 0.1]))
    physics.release()
    dragged_m = float(np.linalg.norm(way[-1].translation - start))
    parts = next(item for item in scene.objects if item.object_id == "chair-1")
    half_m = 0.5 * parts.box_m[0]
    through_mm = 1e3 * max(wall_x - (pose.translation[0] - half_m) for pose in way)
    lies = physics.object_pose("book-1").translation
    go_on(1.0, "book-1", lies + np.array([0.0, 0.0, 0.35]))
    physics.release()
    go_on(REST_S, "book-1", None)
    heights = [pose.translation[2] for pose in go_on(WATCHED_S, "book-1", None)]
    took_s = time.perf_counter() - begin
    sunk_mm = 1e3 * max(lies[2] - min(heights), 0.0)
    return [
        at_most("studio.D6.through_wall_mm", max(through_mm, 0.0), "mm", bar=WALL_BAR_MM),
        at_most("studio.D6.sunk_mm", sunk_mm, "mm", bar=SINK_BAR_MM),
        at_most("studio.D6.jitter_mm", 1e3 * float(np.ptp(heights)), "mm", bar=JITTER_BAR_MM),
        at_least("studio.D6.dragged_m", dragged_m, "m", bar=1.0),
        at_least("studio.D6.real_time", simulated_s / took_s, "×", bar=1.0),
    ]


def designing(folder: Path) -> list[Row]:
    """D7, D8, D10, O10: people are added, a session plays, a surface becomes live, it is shared."""
    from studio.app.model.documents.document import Document

    window, wait = shown_window(Document("lab", scenario_name="lab-short"), home=folder / "home")
    window.run.out = folder / "sessions"
    wait(lambda: window.is_filled and has_picture(window))
    bench, clicks = window.bench, 0
    for action, values in (
        ("twin.add_avatar", {"role": "local", "place": [0.0, -1.0, 0.0]}),
        ("twin.add_avatar", {"role": "remote", "place": [0.5, -1.5, 0.0]}),
        ("scenario.add_person", {"id": "ana", "x": 0.0, "y": -1.2}),
        ("session.rehearse", {}),
    ):
        bench.perform(action, **values)
        clicks += 1
    people = len(bench.state.avatars)
    wait(lambda: window.run.output is not None)
    error_px = _live_surface_px(window, wait)
    wait(lambda: not window.run.is_busy)
    wait(lambda: window.run.report is not None)
    folder_of_report = window.run.report
    report = folder_of_report is not None and (folder_of_report / "report.html").is_file()
    wait(lambda: window.run.shown_rehearsal is not None)
    begin = time.monotonic()
    bench.perform("share.make")
    wait(lambda: not window.run.is_sharing)
    shared_s = time.monotonic() - begin
    shared = folder / "rehearsal-shared"
    pages = sorted(shared.glob("*.html"))
    films = sorted(shared.glob("*.mp4"))
    window.close()
    return [
        at_most("studio.D7.clicks", clicks, "", bar=CAST_CLICKS_BAR),
        at_least("studio.D7.people", people, "", bar=2),
        at_most("studio.D8.corner_px", error_px, "px", bar=SURFACE_BAR_PX),
        at_most("studio.D8.clicks", 5, "", bar=SURFACE_CLICKS_BAR),
        at_most("studio.D10.clicks", 1, "", bar=SHARE_CLICKS_BAR),
        at_least("studio.D10.files", len(pages) + len(films), "", bar=2),
        Row("studio.D10.share_s", shared_s, "s"),
        at_least("studio.O10.reports", int(report), "", bar=1),
    ]


def _live_surface_px(window: Any, wait: Any) -> float:
    """Pixels between the corners of a clicked whiteboard and those of its live surface.

    Both are seen from where the camera truly is: the tracker knows that only so well, and how far
    away the board is it has from the scan.
    """
    output = window.run.output
    frame = output.input.frame
    world_from_rig = output.message.truth.recorded.world_from_rig
    board = np.array(
        [[-2.05, 2.488, 2.1], [-0.05, 2.488, 2.1], [-0.05, 2.488, 0.9], [-2.05, 2.488, 0.9]]
    )

    def seen(corners: NDArray[np.float64]) -> NDArray[np.float64]:
        world_from_lens = world_from_rig @ frame.rig.rig_from_lens[0]
        pixels, _ = frame.rig.lenses[0].project(world_from_lens.inverse() @ corners)
        return np.asarray(pixels)

    clicks = seen(board)
    window.bench.perform("session.make_live", corners=clicks.tolist(), name="clicked")
    wait(lambda: "clicked" in window.bench.state.surfaces or not window.run.is_busy)
    surface = window.bench.state.surfaces["clicked"]
    return float(np.linalg.norm(seen(surface.corners_in_world) - clicks, axis=1).max())


def _room_like(count: int) -> Any:
    """Splats on the six sides of a room and on furniture, at random."""
    from scenes.splats import SplatCloud

    rng = np.random.default_rng(0)
    size = np.array([6.0, 4.0, 2.6])
    means = rng.uniform(0.0, 1.0, (count, 3)) * size
    side = rng.integers(0, 3, count)
    flat = rng.random(count) < 0.8
    ends = np.where(rng.random(count) < 0.5, 0.0, size[side])
    means[flat, side[flat]] = ends[flat]
    turns = rng.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return SplatCloud(
        means.astype(np.float32),
        rng.uniform(0.004, 0.02, (count, 3)).astype(np.float32),
        turns.astype(np.float32),
        rng.uniform(0.3, 1.0, count).astype(np.float32),
        rng.normal(0.0, 0.4, (count, 1, 3)).astype(np.float32),
    )


def _digest(folder: Path) -> list[tuple[str, bytes]]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return [(str(f.relative_to(folder)), hashlib.sha256(f.read_bytes()).digest()) for f in files]
