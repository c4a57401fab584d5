"""One trial: a live session in which a participant does a task, which is judged as it goes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from devices.clock import Clock
from devices.hub.entry.tokens import Tokens
from devices.hub.server import Hub
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.state import SceneState
from sim.headset.scripted import scripts_of
from sim.scenarios.scenario import load_scenario
from studio.live.live import LiveSession
from studio.live.locating import RoomLocator
from studio.live.people.crowd import Crowd
from studio.live.people.hosting import Hosting, hosted, invitations_for, join_line
from studio.live.rehearsed import RehearsedLive, SimulatedFeed
from studio.live.report import live_rows, write_report
from studio.live.setup import LiveSetup
from studio.live.status import LiveResult
from studio.session.session import SessionOutput
from studio.study.asking import NOW, Asking, Step, StepKind, steps_of
from studio.study.folder import RECORDING, Answers, Ended, StudyFolder
from studio.study.goals import GoalWatch
from studio.study.order import Trial
from studio.study.people import StudyPeople
from studio.study.plan import Task, When

BEGUN, ENDED = "task-begun", "task-ended"
"""Kinds of the events by which a recording says when the task was done."""

GOODBYE_S = 2.0
"""Time that a participant has to read the last step before the session ends."""

FILM_SIZE, FILM_FPS = "1440x720", 10.0
"""Picture and rate of a rehearsed trial's camera, chosen: drawn in a minute on two cores."""

Say = Callable[[str], None]


def with_film(
    session: LiveSession, task: Task, *, target: Path, stack: ExitStack, say: Say
) -> None:
    """Let a simulated camera show what the people of a task's scenario do until the stack is left.

    Raises:
        ValueError: the camera has ended by itself, or takes too long.
    """
    seconds = load_scenario(task.scenario).duration_s
    feed = SimulatedFeed(task.scene, task.scenario, 0, seconds, size=FILM_SIZE, fps=FILM_FPS)
    rehearsed = RehearsedLive(session, feed, truth=target / "truth.jsonl", seconds=None)
    stack.enter_context(rehearsed).wait_for_stream(say)


class Films(Protocol):
    """Lets a camera show what a task's people do until the stack is left."""

    def __call__(
        self, session: LiveSession, task: Task, *, target: Path, stack: ExitStack, say: Say
    ) -> None:
        """Begin; the session's receiver is listening, or about to."""
        ...


@dataclass(frozen=True, slots=True)
class Stage:
    """Devices and people on which a trial is played.

    Attributes:
        setup: the devices.
        hosting: how people join.
        clock: session time.
        limit_s: in place of the task's own; None for that.
        is_rehearsed: whether a simulated camera and simulated people of the task's scenario do it.
        films: lets a camera show what the people of a rehearsed task's scenario do.
        opened: opens a scene by its name.
        say: takes a line for the experimenter.
    """

    setup: LiveSetup
    hosting: Hosting
    clock: Clock
    limit_s: float | None = None
    is_rehearsed: bool = False
    films: Films = with_film
    opened: Callable[[str], ScenePackage] = open_scene
    say: Say = print


class Director:
    """Lets a task begin and end as its participant and its goal have it; on the session's thread.

    Args:
        task: what is done.
        asking: what the participant goes through.
        note: takes events for the recording: kind and words.
        end: ends the session.
    """

    def __init__(
        self,
        task: Task,
        asking: Asking,
        *,
        note: Callable[[str, str], None],
        end: Callable[[], None],
    ) -> None:
        self._task, self._asking, self._note, self._end = task, asking, note, end
        self._goal = GoalWatch(task.goal)
        self._thanked_ns: int | None = None
        self._newest_ns = 0
        self.begun_ns: int | None = None
        """Session time at which the task began; None before."""
        self.ended_ns: int | None = None
        """Session time at which it ended; None before."""
        self.ended_by = ""
        """How it ended: reached, said or limit; empty before."""

    def see(self, state: SceneState, t_ns: int) -> None:
        """Look at the room at a moment."""
        self._newest_ns = t_ns
        kind = self._asking.step.kind
        if self.begun_ns is None:
            if kind is StepKind.TASK:
                self.begun_ns = t_ns
                self._note(BEGUN, self._task.task_id)
        elif self.ended_ns is None:
            self._judge(state, t_ns)
        if kind is StepKind.THANKS:
            self._thanked_ns = t_ns if self._thanked_ns is None else self._thanked_ns
            if t_ns - self._thanked_ns >= round(GOODBYE_S * 1e9):
                self._end()

    def stop(self) -> None:
        """Take note that the session was ended before the task was."""
        if self.begun_ns is not None and self.ended_ns is None:
            self.ended_ns, self.ended_by = self._newest_ns, "stopped"

    def _judge(self, state: SceneState, t_ns: int) -> None:
        assert self.begun_ns is not None
        if self._asking.step.kind is not StepKind.TASK:
            self._finish("said", t_ns)
        elif self._goal.look(poses_of(state), t_ns):
            assert self._goal.reached_ns is not None
            self._finish("reached", max(self._goal.reached_ns, self.begun_ns))
        elif t_ns - self.begun_ns >= round(self._task.limit_s * 1e9):
            self._finish("limit", t_ns)

    def _finish(self, how: str, t_ns: int) -> None:
        self.ended_ns, self.ended_by = t_ns, how
        self._note(ENDED, how)
        self._asking.end_task()


def poses_of(state: SceneState) -> Mapping[str, Pose]:
    """Return `world_from_object` by object id."""
    return {name: track.world_from_object for name, track in state.objects.items()}


def play_trial(folder: StudyFolder, trial: Trial, *, stage: Stage) -> Ended | None:
    """Play a trial's session to its end and keep what came of it; None where no task was begun.

    Args:
        folder: of the study.
        trial: which task under which condition.
        stage: what it is played on.

    Raises:
        ValueError, OSError: an input is bad, or a file cannot be written.
    """
    task, target = folder.study.task(trial.task), folder.folder_of(trial)
    if stage.is_rehearsed and not task.scenario:
        raise ValueError(f"task {task.task_id!r}: scenario is missing, by which it is rehearsed")
    if stage.limit_s is not None:
        task = replace(task, limit_s=stage.limit_s)
    target.mkdir(parents=True, exist_ok=True)
    scene, renderer = stage.opened(task.scene), NativeRenderer()
    how = "simulated" if stage.is_rehearsed else "page"
    asking = Asking(steps_of(folder, trial), _keeper(folder, trial, how=how))
    with ExitStack() as stack:
        hub = stack.enter_context(
            hosted(stage.hosting, scene, clock=stage.clock, say=_drop, asks=NOW, more=asking.assets)
        )
        people = StudyPeople(
            hub,
            folder.study.condition(trial.condition),
            participant=trial.participant,
            person=lambda: asking.person,
            clock=stage.clock,
        )
        session = LiveSession(
            task.scene,
            scene,
            stage.setup,
            clock=stage.clock,
            renderer=renderer,
            locate=RoomLocator(scene, renderer),
            record_to=target / RECORDING,
            people=people,
        )
        director = Director(task, asking, note=people.note, end=session.end)
        if stage.is_rehearsed:
            stage.films(session, task, target=target, stack=stack, say=stage.say)
            with_people(session, hub, task=task, stage=stage, stack=stack)
        else:
            _invite(hub, session, stage=stage)
        result = _played(session, director)
        ping_ms = _ping_ms(hub, asking.person)
    write_report(target, result, live_rows(result), scene=task.scene)
    director.stop()
    if director.begun_ns is None or director.ended_ns is None:
        return None
    ended = _ended(trial, director, result=result, person=asking.person)
    ended = replace(ended, ping_ms=ping_ms, is_rehearsed=stage.is_rehearsed)
    folder.keep_trial(ended)
    return ended


def _ended(trial: Trial, director: Director, *, result: LiveResult, person: str) -> Ended:
    """Return how a trial went whose task was begun."""
    assert director.begun_ns is not None
    assert director.ended_ns is not None
    return Ended(
        trial.name,
        trial.participant,
        trial.number,
        trial.condition,
        trial.task,
        person,
        director.begun_ns,
        director.ended_ns,
        director.ended_by,
        {s.name: (s.p50_ms, s.p95_ms) for s in result.latencies.stages()},
    )


def _played(session: LiveSession, director: Director) -> LiveResult:
    def watch(output: SessionOutput) -> None:
        director.see(output.state, output.input.frame.t_ns)

    return session.run(watch)


def _keeper(
    folder: StudyFolder, trial: Trial, *, how: str
) -> Callable[[Step, Mapping[str, str]], None]:
    """Return what keeps a participant's answers."""

    def keep(step: Step, answers: Mapping[str, str]) -> None:
        if step.kind is StepKind.CONSENT:
            folder.agree(trial.participant, how=how)
        elif step.questionnaire is not None:
            name = step.questionnaire.name
            is_first = any(
                asked.questionnaire.name == name and asked.when is When.FIRST
                for asked in folder.study.asked
            )
            after = "" if is_first else trial.name
            folder.keep_answers(Answers(trial.participant, after, name, how, answers))

    return keep


def _invite(hub: Hub, session: LiveSession, *, stage: Stage) -> None:
    hosting = stage.hosting
    stage.say(join_line(hub, hosting, invitations=invitations_for(hub, hosting)))
    if session.status().listening_at:
        stage.say(f"enter in the camera: {session.status().listening_at}")


def with_people(
    session: LiveSession, hub: Hub, *, task: Task, stage: Stage, stack: ExitStack
) -> None:
    """Let the remote people of a task's scenario take part until the stack is left."""
    crowd = Crowd(
        hub,
        lambda: session.status().live_s,
        clients=len(scripts_of(load_scenario(task.scenario))),
        seconds=None,
        clock=stage.clock,
        tokens=Tokens(),
        say=stage.say,
        scenario=task.scenario,
        takes_part=True,
    )
    crowd.start()
    stack.callback(crowd.end)


def _ping_ms(hub: Hub, person_id: str) -> float | None:
    found = [person for person in hub.people() if person.person_id == person_id]
    return found[0].latency_ms if found else None


def _drop(_line: str) -> None:
    """Say nothing: what the hub says is in the session's report."""
