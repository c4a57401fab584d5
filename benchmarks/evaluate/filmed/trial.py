"""Methods on a take: what each said of every frame, beside what was true."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.filming import FilmSet, Shot
from devices.recording_codec import RecordedTruth
from scenes.package import ScenePackage
from scenes.pose import Pose, rotation_angle
from scenes.state import TrackedObject
from sim.rehearsal import off_by
from studio.evaluate.metrics import PoseError, pose_error
from studio.evaluate.perfect_detector import PerfectDetector
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.session.pipeline import SessionMessage
from studio.session.trackers.methods import make_method
from tracking.output import TrackingMethod, TrackOutput


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """One method's answer on one frame.

    Attributes:
        seq: frame counter.
        t_ns: capture time.
        tracks: by object id.
        world_from_rig: the camera's pose that the method worked with, or None.
        truth: what was the case.
    """

    seq: int
    t_ns: int
    tracks: Mapping[str, TrackedObject]
    world_from_rig: Pose | None
    truth: RecordedTruth

    def error(self, object_id: str, *, kind: str = "") -> PoseError:
        """How far one object's pose is off."""
        return pose_error(
            self.tracks[object_id].world_from_object,
            self.truth.world_from_object[object_id],
            symmetry=SYMMETRY_OF_KIND.get(kind, 1),
        )

    def camera_left(self) -> tuple[float, float]:
        """Return the remaining error of the camera's pose: degrees and millimetres."""
        if self.world_from_rig is None:
            return float("nan"), float("nan")
        apart = self.truth.world_from_rig.inverse() @ self.world_from_rig
        return (
            float(np.degrees(rotation_angle(apart.rotation))),
            1000.0 * float(np.linalg.norm(apart.translation)),
        )


class Trial:
    """The methods that are judged, on one scene. Takes are independent of each other.

    Args:
        scene: splats of the room and of its objects, with the poses they were last known in.
        methods: names of `studio.session.trackers.methods.METHODS`.
    """

    def __init__(self, scene: ScenePackage, methods: Sequence[str]) -> None:
        self.scene = scene
        self._detector = PerfectDetector()
        self._methods: dict[str, TrackingMethod[Any]] = {
            name: make_method(name, scene, self._detector) for name in methods
        }

    @property
    def methods(self) -> tuple[str, ...]:
        """Their names, in the order given."""
        return tuple(self._methods)

    def start(self) -> Mapping[str, Any]:
        """The states before the first frame, by method."""
        return {name: method.start() for name, method in self._methods.items()}

    def step(
        self, states: Mapping[str, Any], message: SessionMessage
    ) -> tuple[Mapping[str, Any], Mapping[str, Answer]]:
        """All methods on one frame; states are values, so that a take can be continued twice.

        Raises:
            ValueError: the frame has no truth.
        """
        if message.truth is None:
            raise ValueError(f"frame {message.frame.seq}: without truth it cannot be judged")
        if message.truth.masks is not None:
            self._detector.see(message.frame, message.truth)
        following: dict[str, Any] = {}
        answers: dict[str, Answer] = {}
        for name, method in self._methods.items():
            following[name], output = method.step(
                states[name], message.frame, message.frame.received_ns
            )
            answers[name] = _answer(message, message.truth.recorded, output)
        return following, answers

    def run(
        self, messages: Iterable[SessionMessage], done: Callable[[int], None] | None = None
    ) -> Iterator[Mapping[str, Answer]]:
        """All methods on all frames of a take, from the start; yields frame by frame."""
        states = self.start()
        for count, message in enumerate(messages, 1):
            states, answers = self.step(states, message)
            if done is not None:
                done(count)
            yield answers


def marker_pose(true_world_from_rig: Pose, conditions: Conditions, *, seed: int) -> Pose:
    """`world_from_rig` as a marker would give it: off by as much as the conditions say."""
    return off_by(
        true_world_from_rig,
        np.random.default_rng([seed, 360]),
        conditions.pose_error_deg,
        conditions.pose_error_cm,
    )


def _answer(message: SessionMessage, truth: RecordedTruth, output: TrackOutput) -> Answer:
    tracks = {track.object_id: track for track in output.objects}
    frame = message.frame
    return Answer(frame.seq, frame.t_ns, tracks, output.world_from_rig, truth)


def performed(
    film_set: FilmSet, trial: Trial, taken: Sequence[Shot], asked: Asked, *, seed: int, what: str
) -> Iterator[Mapping[str, Answer]]:
    """Film a take (or fetch it) and run all methods on it, frame by frame.

    Args:
        film_set: the room.
        trial: the methods.
        taken: the pictures.
        asked: the conditions.
        seed: of noise, drift and the camera pose's error.
        what: names it where progress is shown.
    """
    messages = film_messages(film_set, taken, asked, seed=seed, what=what)
    progress = asked.progress
    progress.begin(f"tracking {what}, seed {seed}")
    yield from trial.run(messages, done=lambda count: progress.advance(count / len(taken)))
    progress.finish()


def last_of(answers: Iterable[Mapping[str, Answer]]) -> Mapping[str, Answer]:
    """Return every method's answer on the last frame.

    Raises:
        ValueError: there is no frame.
    """
    last = deque(answers, maxlen=1)
    if not last:
        raise ValueError("a take without a single frame cannot be judged")
    return last[0]


def film_messages(
    film_set: FilmSet, taken: Sequence[Shot], asked: Asked, *, seed: int, what: str
) -> Iterator[SessionMessage]:
    """The frames of a take, filmed or fetched, with the camera pose that a marker would give."""
    asked.progress.begin(f"filming {what}, seed {seed}")
    take = film_set.film(taken, asked.conditions, seed=seed, advance=asked.progress.advance)
    asked.progress.finish()
    known = marker_pose(film_set.room.world_from_rig, asked.conditions, seed=seed)
    return take.play(known, with_masks="paper" in asked.methods)
