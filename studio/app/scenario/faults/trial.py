"""Short rehearsals in the background: what a fault does to the tracker, soon after it is set."""

from __future__ import annotations

import math
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.workers.latest import Latest
from studio.app.scenario.text.edits import with_camera, with_duration

if TYPE_CHECKING:  # a session takes a second to import
    from sim.faults.fault import Fault
    from studio.evaluate.scores import ScoreBoard
    from studio.session.session import SessionOutput

LENS_PX = 480
"""Side of each lens picture of a trial: a ninth of the usual work, errors a little larger."""


@dataclass(frozen=True, slots=True)
class ObjectError:
    """How one object was tracked in a trial.

    Attributes:
        position_cm: mean distance from the truth.
        yaw_deg: mean error of the yaw.
        lost: share of the frames in which the tracker had lost it.
        has_moved: whether it did.
    """

    position_cm: float
    yaw_deg: float
    lost: float
    has_moved: bool


@dataclass(frozen=True, slots=True, eq=False)
class TrialResult:
    """Result of a trial so far.

    Attributes:
        errors: by object.
        share: of the trial that is done, 0..1.
        problem: why it ended early; empty if it did not.
    """

    errors: Mapping[str, ObjectError]
    share: float
    problem: str = ""

    @property
    def is_done(self) -> bool:
        """Whether nothing more comes."""
        return self.share >= 1.0 or bool(self.problem)


@dataclass(frozen=True, slots=True)
class TrialPlan:
    """Plan of a trial.

    Attributes:
        scene: name or path.
        text: of the scenario.
        seed: of everything random.
        seconds: how much of it is played.
        more_faults: kinds of plug-ins that it may have.
        arranged: tables of what was arranged by hand.
    """

    scene: str
    text: str
    seed: int
    seconds: float
    more_faults: tuple[type[Fault], ...] = ()
    arranged: str = ""


class Trials:
    """Plays trials one at a time; a newer one cancels the one that plays."""

    def __init__(self) -> None:
        self.results: Slot[TrialResult] = Slot()
        self._is_open = True
        self._player: Latest[TrialPlan] | None = None

    @property
    def is_busy(self) -> bool:
        """Whether one plays or waits."""
        return self._player is not None and self._player.is_busy

    def start(self, plan: TrialPlan) -> None:
        """Play this one as soon as the one that plays has stopped."""
        if not self._is_open:
            return
        if self._player is None:
            self._player = Latest("trials", self._play)
        self._player.ask(plan)

    def cancel(self) -> None:
        """Stop what plays."""
        if self._player is not None:
            self._player.cancel()

    def close(self) -> None:
        """Stop and wait: the window closes."""
        self._is_open = False
        if self._player is not None:
            self._player.close()

    def _play(self, plan: TrialPlan, stale: threading.Event) -> None:
        from studio.session.pipeline import CancelledError

        try:
            with tempfile.TemporaryDirectory(prefix="nexus-trial-") as folder:
                path = Path(folder) / "trial.toml"
                path.write_text(trial_text(plan), encoding="utf-8")
                self._rehearse(plan, path, stale)
        except CancelledError:
            return
        except Exception as error:  # noqa: BLE001 - said beside the bars; the window goes on
            self.results.put(TrialResult({}, 0.0, str(error) or type(error).__name__))

    def _rehearse(self, plan: TrialPlan, path: Path, stale: threading.Event) -> None:
        from studio.evaluate.scores import ScoreBoard
        from studio.session.opening import open_session
        from studio.session.plan import SessionPlan
        from studio.session.trackers.methods import METHODS

        session = open_session(
            SessionPlan(
                plan.scene,
                str(path),
                plan.seed,
                methods=METHODS[:1],
                more_faults=plan.more_faults,
                arranged=plan.arranged,
            )
        )
        board = ScoreBoard(session.scene.objects)

        def watch(output: SessionOutput) -> None:
            truth = output.message.truth
            if truth is None:
                return
            board.add(output.shown.objects, truth.recorded)
            share = min(0.99, output.input.frame.t_ns / max(session.duration_ns, 1))
            self.results.put(TrialResult(errors_of(board), share))

        session.run(watch, cancelled=stale)
        self.results.put(TrialResult(errors_of(board), 1.0))


def trial_text(plan: TrialPlan) -> str:
    """The scenario of a trial: its beginning, filmed with small lenses."""
    from sim.scenarios.scenario import parse_scenario

    scenario = parse_scenario(plan.text, source="scenario", more_faults=plan.more_faults)
    text = with_duration(plan.text, min(plan.seconds, scenario.duration_s))
    return with_camera(text, lens_size_px=min(LENS_PX, scenario.camera.lens_size_px))


def errors_of(board: ScoreBoard) -> dict[str, ObjectError]:
    """Mean errors by object: from when it moved if it did, else of all frames."""
    from scenes.state import TrackState

    found: dict[str, ObjectError] = {}
    for object_id in board.object_ids():
        samples = board.samples(object_id)
        moved = [sample for sample in samples if sample.counted]
        counted = moved or list(samples)
        if not counted:
            continue
        count = len(counted)
        lost = sum(sample.state is TrackState.LOST for sample in counted) / count
        found[object_id] = ObjectError(
            math.fsum(sample.error.world_cm for sample in counted) / count,
            math.fsum(sample.error.yaw_deg for sample in counted) / count,
            lost,
            bool(moved),
        )
    return found
