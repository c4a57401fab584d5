"""Rooms captured, cut and judged, one after the other."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.evaluate.cuts.captures import Capture, read_dataset_room, read_room
from benchmarks.evaluate.cuts.capturing import Notes, capture_dataset, capture_room
from benchmarks.evaluate.cuts.cases import cases_of, scores_of, scores_without_marks
from benchmarks.evaluate.cuts.cutting import Cut, cut_by_product
from benchmarks.evaluate.cuts.marking import WAYS
from benchmarks.evaluate.cuts.scores import CutScore
from benchmarks.evaluate.dataset.layout import read_dataset
from studio.console.progress import Progress
from studio.console.rows import Row, at_least, at_most

UNMARKED = "unmarked"
"""Stands for the ways that need no mark: proposals, and the truth's labels."""

OFF_BAR_MM = 10.0
"""Codes whose places are known make the prepared world the true one to so much."""


def captures_of(
    seeds: Sequence[int], datasets: Sequence[Path], *, folder: Path, progress: Progress
) -> Iterator[tuple[Notes, Capture]]:
    """How each room's capture came about, and the capture; made where it is not in the folder.

    Raises:
        ValueError: a folder is no dataset, or a room cannot be prepared.
    """
    # What may be wrong with a folder is said before hours of work.
    described = [read_dataset(path) for path in datasets]
    for seed in seeds:
        own = folder / f"random-{seed}"
        notes = capture_room(seed, own, progress=progress, clock=time.monotonic)
        yield notes, read_room(seed, own)
    for dataset in described:
        own = folder / dataset.folder.name
        notes = capture_dataset(dataset, own, progress=progress, clock=time.monotonic)
        yield notes, read_dataset_room(dataset, own)


def judged(
    capture: Capture,
    *,
    ways: Sequence[str] = (*WAYS, UNMARKED),
    cut: Cut = cut_by_product,
    progress: Progress,
) -> list[CutScore]:
    """Scores of every object of a capture, cut in some ways.

    Args:
        capture: the room.
        ways: of `WAYS`, and `UNMARKED`.
        cut: how it is cut.
        progress: shows what is under way.
    """
    name = capture.folder.name
    progress.begin(f"{name}: truth and marks")
    cases = cases_of(capture)
    marked = sum(bool(case.views["one_box"]) for case in cases)
    progress.finish(f"{marked} of {len(cases)} objects are in the photos")
    progress.begin(f"{name}: cutting")
    scores: list[CutScore] = []
    for number, case in enumerate(cases):
        progress.advance(number / len(cases), case.object_id)
        scores += scores_of(case, cut, ways=[way for way in ways if way != UNMARKED])
    if UNMARKED in ways:
        scores += scores_without_marks(cases)
    progress.finish(f"{len(scores)} cuts")
    return scores


def capture_rows(made: Sequence[tuple[Notes, float]]) -> list[Row]:
    """How the rooms came about.

    Args:
        made: by room, and how far its world is from the true one, metres.
    """
    failed = sum(bool(notes.refused) for notes, _ in made)
    worst_mm = max((1000.0 * off_m for _, off_m in made), default=float("nan"))
    placed = 100.0 * min((notes.placed for notes, _ in made), default=float("nan"))
    return [
        Row("cuts.rooms", float(len(made)), ""),
        at_most("cuts.rooms_without_poses", float(failed), "", bar=0.0),
        at_least("cuts.photos_placed_percent.min", placed, "%"),
        at_most("cuts.world_off_mm.max", worst_mm, "mm", bar=OFF_BAR_MM),
    ]
