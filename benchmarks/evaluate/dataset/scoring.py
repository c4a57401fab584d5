"""The figures of a dataset: what was found, kept, left alone, and how well it was known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.evaluate.answers import (
    MIN_VISIBLE,
    REST_BAR_CM,
    Answer,
    calibration_error,
    flips,
    is_asked,
    is_right,
    is_unflagged,
    mean_world_cm,
    mean_yaw_deg,
    rest_moved_cm,
)
from benchmarks.evaluate.dataset.layout import Dataset
from benchmarks.evaluate.dataset.preparing import PreparedDataset
from benchmarks.evaluate.dataset.tracking import Tracked
from scenes.state import TrackState
from studio.console.rows import Row, at_least, at_most

STILL_BARS = {
    "room": {"world_cm.mean": 1.5, "yaw_deg.mean": 1.0, "flips": 0.0},
    "table": {"world_cm.mean": 0.6, "yaw_deg.mean": 0.6, "flips": 0.0},
}


def preparation_rows(prepared: PreparedDataset, *, quality: str) -> list[Row]:
    """Return the figures of the preparation and the cuts."""
    psnr_bar = {"default": 31.0, "fine": 34.0}.get(quality)
    wall_bar = 6.0 if quality == "default" else None
    rows = [
        at_most("dataset.prepare.wall_min", prepared.wall_min, "min", bar=wall_bar),
        at_least("dataset.prepare.psnr_db", prepared.psnr_db, "dB", bar=psnr_bar),
        Row("dataset.prepare.placed", prepared.placed, ""),
        Row("dataset.alignment_mm", prepared.alignment_mm, "mm"),
        at_least("dataset.cut.iou.min", min(c.iou for c in prepared.cuts), "", bar=0.93),
        at_most("dataset.cut.box_cm.max", max(c.box_cm for c in prepared.cuts), "cm", bar=2.0),
        at_most("dataset.cut.seconds.max", max(c.seconds for c in prepared.cuts), "s", bar=15.0),
    ]
    for cut in prepared.cuts:
        rows.append(Row(f"dataset.cut.{cut.object_id}.iou", cut.iou, ""))
        rows.append(Row(f"dataset.cut.{cut.object_id}.box_cm", cut.box_cm, "cm"))
    return rows


def tracking_rows(dataset: Dataset, tracked: Tracked) -> list[Row]:
    """Return the tracker's figures against the truth."""
    rows: list[Row] = []
    for name, pictures in dataset.sets.items():
        for session in (name,) if name == "sequence" else (name, f"{name}_chained"):
            asked = [
                answer
                for answer in tracked.answers
                if answer.session == session and answer.object_id in pictures.moving
            ]
            rows += _sequence_rows(asked) if name == "sequence" else _still_rows(session, asked)
    return [*rows, *_cold_rows(tracked.answers), *_whole_rows(tracked)]


def _still_rows(session: str, asked: Sequence[Answer]) -> list[Row]:
    bars = STILL_BARS.get(session, {})
    prefix = f"dataset.{session}"
    return [
        Row(f"{prefix}.right", float(sum(map(is_right, asked))), ""),
        Row(f"{prefix}.of", float(len(asked)), ""),
        at_most(
            f"{prefix}.world_cm.mean", mean_world_cm(asked), "cm", bar=bars.get("world_cm.mean")
        ),
        at_most(f"{prefix}.yaw_deg.mean", mean_yaw_deg(asked), "deg", bar=bars.get("yaw_deg.mean")),
        at_most(f"{prefix}.flips", float(flips(asked)), "", bar=bars.get("flips")),
    ]


def _sequence_rows(asked: Sequence[Answer]) -> list[Row]:
    """Of the objects that move in it, where they are seen: frames lost, and the error."""
    seen = [answer for answer in asked if answer.seen.fraction >= MIN_VISIBLE]
    lost = sum(answer.state in (None, TrackState.LOST) for answer in seen)
    return [
        at_most("dataset.sequence.lost_frames", float(lost), "", bar=3.0),
        at_most("dataset.sequence.world_cm.mean", mean_world_cm(seen), "cm", bar=1.5),
        *(
            Row(
                f"dataset.sequence.{name}.world_cm.mean",
                mean_world_cm([answer for answer in seen if answer.object_id == name]),
                "cm",
            )
            for name in sorted({answer.object_id for answer in seen})
        ),
    ]


def _cold_rows(answers: Sequence[Answer]) -> list[Row]:
    """Every object that a still shows well enough, each still a session of its own."""
    asked = [a for a in answers if a.session in STILL_BARS and is_asked(a)]
    right = 100.0 * sum(map(is_right, asked)) / max(len(asked), 1)
    unflagged = sum(is_unflagged(answer) and not is_right(answer) for answer in asked)
    ece = calibration_error(asked)
    return [
        at_least("dataset.cold.right_percent", right, "%", bar=95.0),
        Row("dataset.cold.of", float(len(asked)), ""),
        at_most("dataset.wrong_unflagged", float(unflagged), "", bar=0.01 * len(asked)),
        at_most("dataset.confidence.ece", ece, "", bar=0.05),
    ]


def _whole_rows(tracked: Tracked) -> list[Row]:
    """Rest, camera and durations, over all sessions."""
    moved, too_far = rest_moved_cm(tracked.answers)
    rows = [
        at_most("dataset.rest.moved_cm.max", moved, "cm", bar=REST_BAR_CM),
        Row("dataset.rest.moved", float(too_far), ""),
    ]
    if tracked.cameras:
        degrees = float(np.median([left.degrees for left in tracked.cameras]))
        millimetres = float(np.median([left.millimetres for left in tracked.cameras]))
        rows.append(at_most("dataset.camera.left_deg", degrees, "deg", bar=0.1))
        rows.append(at_most("dataset.camera.left_mm", millimetres, "mm", bar=5.0))
    for percent, bar in ((50, None), (95, 60.0)):
        value = float(np.percentile(tracked.step_ms or [0.0], percent))
        rows.append(at_most(f"dataset.step_ms.p{percent}", value, "ms", bar=bar))
    first = float(np.median(tracked.first_ms or [0.0]))
    return [*rows, Row("dataset.first_step_ms.p50", first, "ms")]
