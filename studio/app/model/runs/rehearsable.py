"""What the open room lacks to be rehearsed in, in words, with a button that mends it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from studio.app.model.topics import Notice
from studio.app.model.workbench import Workbench

MAKE_ROOM, MEASURE, TRAIN, PREPARE = (
    "Make a room of it",
    "Measure something",
    "Train it from the photos",
    "Prepare photos",
)
"""Words on the buttons."""

SPLATS_ONLY = (
    "{name} is a splat file: it can be looked at, but has no floor and walls that stop people and "
    "objects. A room is made of it once you say how high it is, or how long one of its units is"
)
NOTHING_STANDS_FOR = (
    "{name} has objects to track, but nothing yet that stands for the real room: a camera that saw "
    "the scan itself would show the tracker its own model. A second reconstruction is trained from "
    "the photos, once, in a few minutes"
)
PHOTOS_ARE_GONE = (
    "{name} has objects to track, but nothing that stands for the real room, and the photos it "
    "could be made of are not in {work}. Undo the cut to rehearse with people alone, or prepare "
    "the photos again and cut there"
)
NO_SURFACE = (
    "{name} has no floor and walls that stop people and objects: its splats show no surface that "
    "the photos agree about. Prepare it from photos that overlap more"
)


def missing_to_rehearse(bench: Workbench) -> Notice | None:
    """What is missing and what mends it; None if nothing is, or no room is open."""
    scene, path = bench.scene, Path(bench.document.scene)
    if scene is None or scene.physical is not None or not path.exists():
        return None
    if not (path / "scene.json").is_file():
        ways = {MAKE_ROOM: _doing(bench, "preparation.room_of", path=str(path))}
        return Notice(SPLATS_ONLY.format(name=path.name), ways, "warning")
    to_photos = {PREPARE: _doing(bench, "dock.preparation")}
    if scene.objects and scene.reality is None:
        work = path.with_name(f"{path.name}.prepare")
        if not (work / "training").is_dir():
            words = PHOTOS_ARE_GONE.format(name=path.name, work=work.name)
            undo = {"Undo the cut": _doing(bench, "preparation.undo_cut")}
            return Notice(words, {**undo, **to_photos}, "warning")
        ways = {TRAIN: _doing(bench, "preparation.train_reality")}
        return Notice(NOTHING_STANDS_FOR.format(name=path.name), ways, "warning")
    if scene.collision is None:
        return Notice(NO_SURFACE.format(name=path.name), to_photos, "warning")
    return None


def _doing(bench: Workbench, action_id: str, **values: str) -> Callable[[], object]:
    return lambda: bench.do(action_id, **values)
