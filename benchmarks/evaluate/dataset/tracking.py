"""A tracking method on a dataset's pictures: what it reported of every object, beside the truth.

Each still is tracked twice: as a session of its own (a cold start), and in one session in which
the objects are moved between stills.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.answers import Answer
from benchmarks.evaluate.dataset.layout import (
    Dataset,
    Still,
    StillSet,
    read_labels,
    read_rgb,
)
from benchmarks.evaluate.dataset.preparing import PreparedDataset
from devices.messages import Frame
from scenes.cameras import Rig
from scenes.pose import Pose, rotation_angle
from scenes.state import TrackedObject
from sim.rehearsal import off_by
from studio.evaluate.metrics import pose_error
from tracking.output import TrackingMethod

STREAM = "dataset"
CHAINED_FRAMES = 10
"""Pictures of each still in the chained session: one second of a ten-hertz stream, in which every
resting object has its turn to be measured. The last one is judged."""

CHAINED_FRAME_NS = 100_000_000
"""Time between those."""


Pictures = Callable[[StillSet, Still], NDArray[np.uint8]]
"""The picture that a still of a set shows, (H, W, 3) RGB."""


def filmed(pictures: StillSet, still: Still) -> NDArray[np.uint8]:
    """The picture that was taken.

    Raises:
        ValueError: it is missing, or of another size than the set's lens.
    """
    image, lens = read_rgb(still.picture), pictures.lens
    if image.shape[:2] != (lens.height_px, lens.width_px):
        raise ValueError(
            f"{still.picture}: {image.shape[1]} × {image.shape[0]} pixels, but the set's "
            f"truth.json says {lens.width_px} × {lens.height_px}"
        )
    return image


@dataclass(frozen=True, slots=True)
class CameraLeft:
    """Remaining error of the camera's pose after the method's own refinement."""

    degrees: float
    millimetres: float


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """Everything a method reported of a dataset.

    Attributes:
        answers: per session, picture and object.
        cameras: at the first picture of every session in which the method had a camera pose.
        step_ms: duration of each step after a session's first.
        first_ms: duration of each session's first step.
        camera_lines: what the method said of the camera's pose, once for each set of pictures.
    """

    answers: tuple[Answer, ...]
    cameras: tuple[CameraLeft, ...]
    step_ms: tuple[float, ...]
    first_ms: tuple[float, ...]
    camera_lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CameraError:
    """How far the camera's known pose is off, about a random axis and in a random direction."""

    degrees: float = 0.5
    centimetres: float = 1.0


Shown = Callable[[Frame, Mapping[str, tuple[NDArray[np.bool_], ...]]], None]
"""Hands a detector without errors the frame and each object's mask per lens before it is asked."""


def track_dataset(
    dataset: Dataset,
    prepared: PreparedDataset,
    method: TrackingMethod[Any],
    *,
    camera_error: CameraError,
    seed: int,
    stopwatch_ns: Callable[[], int],
    begin: Callable[[str], None],
    shown: Shown | None = None,
    picture_of: Pictures = filmed,
    chained: bool = True,
) -> Tracked:
    """Track every set of a dataset.

    Args:
        dataset: the pictures and the truth.
        prepared: the product's copy of the room, which the method tracks in.
        method: the tracker.
        camera_error: of the camera pose that the method is given.
        seed: decides that error's direction, another one in every session.
        stopwatch_ns: nanoseconds from any origin.
        begin: is called with the name of each session that begins.
        shown: for methods with a perfect detector; None for all others.
        picture_of: what the method sees of a still.
        chained: whether stills are also tracked in one session.

    Raises:
        ValueError: a picture is missing or of another size than its lens.
    """
    run = _Run(dataset, prepared, method, camera_error, seed, stopwatch_ns, shown, picture_of)
    answers: list[Answer] = []
    for name, pictures in dataset.sets.items():
        begin(name)
        if name == "sequence":
            answers += run.sequence(pictures)
        else:
            answers += run.cold(pictures)
            if not chained:
                continue
            begin(f"{name}, chained")
            answers += run.chained(pictures)
    lines = tuple(f"{name}: {line}" for name, line in run.camera_lines.items())
    return Tracked(
        tuple(answers), tuple(run.cameras), tuple(run.step_ms), tuple(run.first_ms), lines
    )


class _Run:
    """One method on one dataset; collects durations and camera poses beside the answers."""

    def __init__(
        self,
        dataset: Dataset,
        prepared: PreparedDataset,
        method: TrackingMethod[Any],
        camera_error: CameraError,
        seed: int,
        stopwatch_ns: Callable[[], int],
        shown: Shown | None,
        picture_of: Pictures,
    ) -> None:
        self._dataset = dataset
        self._prepared = prepared
        self._method = method
        self._camera_error = camera_error
        self._seed = seed
        self._stopwatch_ns = stopwatch_ns
        self._shown = shown
        self._picture_of = picture_of
        self._initial = {
            item.object_id: item.world_from_object for item in prepared.package.objects
        }
        self.cameras: list[CameraLeft] = []
        self.step_ms: list[float] = []
        self.first_ms: list[float] = []
        self.camera_lines: dict[str, str] = {}

    def cold(self, pictures: StillSet) -> Iterator[Answer]:
        """Every still as a session of its own."""
        for still in pictures.stills:
            session = f"{pictures.name}/{still.name}"
            state, tracks = self._step(session, self._method.start(), pictures, still, 0, 0)
            del state
            yield from self._answers(pictures.name, still, tracks)

    def chained(self, pictures: StillSet) -> Iterator[Answer]:
        """All stills in one session, each shown for a second."""
        session, state, seq = f"{pictures.name}_chained", self._method.start(), 0
        for still in pictures.stills:
            tracks: Mapping[str, TrackedObject] = {}
            for _ in range(CHAINED_FRAMES):
                t_ns = seq * CHAINED_FRAME_NS
                state, tracks = self._step(session, state, pictures, still, seq, t_ns)
                seq += 1
            yield from self._answers(session, still, tracks)

    def sequence(self, pictures: StillSet) -> Iterator[Answer]:
        """A video."""
        state = self._method.start()
        for seq, still in enumerate(pictures.stills):
            state, tracks = self._step(pictures.name, state, pictures, still, seq, still.t_ns)
            yield from self._answers(pictures.name, still, tracks)

    def _step(
        self, session: str, state: Any, pictures: StillSet, still: Still, seq: int, t_ns: int
    ) -> tuple[Any, Mapping[str, TrackedObject]]:
        """One picture; the camera's known pose is off in the same direction all session long."""
        package_from_true = self._prepared.true_from_package.inverse()
        true_rig = package_from_true @ pictures.world_from_camera
        image, lens = self._picture_of(pictures, still), pictures.lens
        known = off_by(
            true_rig,
            np.random.default_rng([self._seed, 360, *session.encode()]),
            self._camera_error.degrees,
            self._camera_error.centimetres,
        )
        rig = Rig((lens,), (Pose.identity(),))
        frame = Frame(STREAM, seq, t_ns, t_ns, (image,), rig, known)
        if self._shown is not None:
            self._shown(frame, self._masks(still, lens.width_px, lens.height_px))
        began = self._stopwatch_ns()
        state, output = self._method.step(state, frame, t_ns)
        durations = self.first_ms if seq == 0 else self.step_ms
        durations.append((self._stopwatch_ns() - began) / 1e6)
        if output.camera:
            self.camera_lines[pictures.name] = output.camera
        if seq == 0 and output.world_from_rig is not None:
            apart = true_rig.inverse() @ output.world_from_rig
            self.cameras.append(
                CameraLeft(
                    float(np.degrees(rotation_angle(apart.rotation))),
                    1000.0 * float(np.linalg.norm(apart.translation)),
                )
            )
        return state, {track.object_id: track for track in output.objects}

    def _masks(
        self, still: Still, width_px: int, height_px: int
    ) -> dict[str, tuple[NDArray[np.bool_], ...]]:
        labels = read_labels(still.labels)
        scale = width_px // labels.shape[1]
        full = labels.repeat(scale, axis=0).repeat(scale, axis=1)[:height_px, :width_px]
        return {name: (full == self._dataset.label_of[name],) for name in self._dataset.objects}

    def _answers(
        self, session: str, still: Still, tracks: Mapping[str, TrackedObject]
    ) -> Iterator[Answer]:
        true_from_package = self._prepared.true_from_package
        for name, item in self._dataset.objects.items():
            truth, start = still.world_from_object[name], item.world_from_object
            is_moved = not np.allclose(truth.matrix(), start.matrix(), atol=1e-4)
            seen, track = still.visible[name], tracks.get(name)
            if track is None:
                yield Answer(session, still.name, name, None, 0.0, 0.0, None, is_moved, seen)
                continue
            # A cut-out has a frame of its own: where it stood in the capture ties it to the true.
            true_from_cut = (true_from_package @ self._initial[name]).inverse() @ start
            reported = true_from_package @ track.world_from_object @ true_from_cut
            error = pose_error(reported, truth, symmetry=item.symmetry)
            moved_m = float(np.linalg.norm(reported.translation - start.translation))
            yield Answer(
                session,
                still.name,
                name,
                error,
                100.0 * moved_m,
                track.confidence,
                track.state,
                is_moved,
                seen,
            )
