"""Tracks against the truth: what a rehearsal is judged by.

An object counts from the frame of its first true motion to the end, hidden spans included. Objects
that never moved are not scored: a tracker that does nothing would be right about them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from devices.recording_codec import RecordedTruth
from scenes.state import ObjectModel, TrackedObject
from studio.console.rows import Row, at_most
from studio.evaluate.metrics import PoseError, Spread, error_table, pose_error
from studio.evaluate.samples import Sample, SampleRows
from tracking.model.symmetry import ROUND

VISIBLE_FRACTION = 0.5
"""An object counts as visible when the camera sees at least this share of it."""

SYMMETRY_OF_KIND: Mapping[str, int] = {"stool": ROUND}
"""Kinds that look the same at several yaws; the yaw of a round stool is not scored."""

ROOM_BAR_CM, ROOM_BAR_DEG = 9.9, 5.7
"""The paper's mean errors at room scale (table 1)."""


class ScoreBoard:
    """Collects samples of one method, by object.

    Args:
        objects: all movable objects of the scene.
    """

    def __init__(self, objects: Sequence[ObjectModel]) -> None:
        self._models = {model.object_id: model for model in objects}
        self._samples = {model.object_id: SampleRows() for model in objects}
        self._moved: set[str] = set()

    def add(self, tracks: Iterable[TrackedObject], truth: RecordedTruth) -> None:
        """Take one frame."""
        self._moved |= truth.moved
        for track in tracks:
            true_world_from_object = truth.world_from_object.get(track.object_id)
            model = self._models.get(track.object_id)
            if true_world_from_object is None or model is None:
                continue
            symmetry = SYMMETRY_OF_KIND.get(model.kind, 1)
            self._samples[track.object_id].add(
                Sample(
                    t_ns=track.t_ns,
                    estimated_world_from_object=track.world_from_object,
                    true_world_from_object=true_world_from_object,
                    visible=truth.visible_fraction.get(track.object_id, 1.0),
                    state=track.state,
                    counted=track.object_id in self._moved,
                    error=pose_error(
                        track.world_from_object, true_world_from_object, symmetry=symmetry
                    ),
                )
            )

    def object_ids(self) -> tuple[str, ...]:
        """All movable objects of the scene."""
        return tuple(self._models)

    def samples(self, object_id: str) -> tuple[Sample, ...]:
        """Every frame of one object."""
        return tuple(self._samples[object_id].samples())

    def moved(self) -> tuple[ObjectModel, ...]:
        """The objects that moved, in the order of the scene."""
        return tuple(m for m in self._models.values() if m.object_id in self._moved)

    def score(self, *, kind: str | None = None, hidden: bool | None = None) -> Score | None:
        """Errors over all moved objects.

        Args:
            kind: only objects of this kind.
            hidden: only frames in which they were (True) or were not (False) mostly hidden.

        Returns:
            The score, or None where there is no such frame.
        """
        models = [m for m in self.moved() if kind is None or m.kind == kind]
        return self._score([m.object_id for m in models], hidden)

    def object_score(self, object_id: str, *, hidden: bool | None = None) -> Score | None:
        """Errors of one object; None if it never moved."""
        return self._score([object_id], hidden)

    def has_yaw(self, object_id: str) -> bool:
        """Whether the object's yaw can be seen at all."""
        return SYMMETRY_OF_KIND.get(self._models[object_id].kind, 1) != ROUND

    def _score(self, object_ids: Sequence[str], hidden: bool | None) -> Score | None:
        errors: list[PoseError] = []
        yaw_errors: list[PoseError] = []
        for object_id in object_ids:
            chosen = self._samples[object_id].errors(hidden=hidden, below=VISIBLE_FRACTION)
            errors += chosen
            yaw_errors += chosen if self.has_yaw(object_id) else []
        if not errors:
            return None
        return Score(
            error_table(errors), error_table(yaw_errors)["yaw_deg"] if yaw_errors else None
        )


@dataclass(frozen=True, slots=True)
class Score:
    """Errors over some frames.

    Attributes:
        columns: x_cm, y_cm, z_cm, world_cm (see `studio.evaluate.metrics.error_table`).
        yaw_deg: over objects whose yaw can be seen; None if there is none.
    """

    columns: Mapping[str, Spread]
    yaw_deg: Spread | None

    @property
    def world_cm(self) -> Spread:
        """Distance between tracked and true position."""
        return self.columns["world_cm"]


def accuracy_rows(board: ScoreBoard, *, prefix: str = "rehearse", bars: bool = True) -> list[Row]:
    """The figures of one method; with `bars`, the paper's means are the limits."""
    bar_cm, bar_deg = (ROOM_BAR_CM, ROOM_BAR_DEG) if bars else (None, None)
    rows: list[Row] = []
    chairs = board.score(kind="chair")
    if chairs is not None:
        rows.append(_row(f"{prefix}.chairs.world_cm.mean", chairs.world_cm, "cm", bar_cm))
        if chairs.yaw_deg is not None:
            rows.append(_row(f"{prefix}.chairs.yaw_deg.mean", chairs.yaw_deg, "deg", bar_deg))
    every = board.score()
    if every is None:
        return [Row(f"{prefix}.objects.world_cm.mean", None, "cm", bar_cm)]
    rows.append(_row(f"{prefix}.objects.world_cm.mean", every.world_cm, "cm", bar_cm))
    rows.append(Row(f"{prefix}.objects.world_cm.p95", every.world_cm.p95, "cm"))
    if every.yaw_deg is not None:
        rows.append(_row(f"{prefix}.objects.yaw_deg.mean", every.yaw_deg, "deg", None))
    for name, hidden in (("visible", False), ("hidden", True)):
        part = board.score(hidden=hidden)
        if part is not None:
            rows.append(_row(f"{prefix}.{name}.world_cm.mean", part.world_cm, "cm", None))
    for model in board.moved():
        score = board.object_score(model.object_id)
        if score is None:
            continue
        base = f"{prefix}.object.{model.object_id}"
        rows.append(_row(f"{base}.world_cm.mean", score.world_cm, "cm", None))
        rows.append(Row(f"{base}.world_cm.p95", score.world_cm.p95, "cm"))
        if score.yaw_deg is not None:
            rows.append(_row(f"{base}.yaw_deg.mean", score.yaw_deg, "deg", None))
            rows.append(Row(f"{base}.yaw_deg.p95", score.yaw_deg.p95, "deg"))
    return rows


def _row(name: str, spread: Spread, unit: str, bar: float | None) -> Row:
    return at_most(name, spread.mean, unit, bar=bar, spread=spread.std)
