"""The simulated camera: plays a film at its pace and gives every unit to its outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random

from devices.clock import Clock
from scenes.workers.task import Task
from sim.wire.faults import FaultSchedule, WireFault
from sim.wire.film.film import Film
from sim.wire.streaming.events import CameraEvent, Say
from sim.wire.streaming.output import Output, OutputSetting
from sim.wire.streaming.truth_file import PictureTime, TruthWriter
from sim.wire.unit_faults import OutgoingUnit, UnitFaults, stills_of

NANOSECONDS = 1_000_000_000

LATE_NS = 2 * NANOSECONDS
"""How far the camera may fall behind before it leaves pictures out, nanoseconds: a computer that
slept, or was busy with something else."""


@dataclass(frozen=True, slots=True)
class CameraPlan:
    """Film and faults that a camera plays.

    Attributes:
        film: the pictures.
        schedule: what goes wrong.
        seconds: how long; None until it is closed.
        seed: of all that is random.
    """

    film: Film
    schedule: FaultSchedule
    seconds: float | None = None
    seed: int = 0


class FilmCamera:
    """A camera that streams from `start` until its time is over or `close`.

    Args:
        plan: what it plays.
        clock: session time.
        wall_ns: nanoseconds since 1970, for events and the truth.
        say: takes events.
        truth: takes the truth; None for none.
    """

    def __init__(
        self,
        plan: CameraPlan,
        clock: Clock,
        *,
        wall_ns: Callable[[], int],
        say: Say,
        truth: TruthWriter | None = None,
    ) -> None:
        self._plan, self._clock, self._wall_ns, self._say = plan, clock, wall_ns, say
        self._truth = truth
        self._random = Random(plan.seed)
        self._stills = stills_of(plan.film, plan.schedule)
        self._outputs: list[Output] = []
        self._start_ns: int | None = None
        self._task = Task("camera plays", self._run)
        self._film_faults: Mapping[str, float] = {}
        self.taken = 0
        """Pictures so far."""

    def now_ns(self) -> int:
        """Nanoseconds from the stream's beginning; -1 before it."""
        return -1 if self._start_ns is None else self._clock.now_ns() - self._start_ns

    def setting(self) -> OutputSetting:
        """Setting with which an output of this camera is made."""
        return OutputSetting(
            now=self.now_ns,
            state=self._plan.schedule.at,
            say=self._say,
            sent=self._sent,
            random=Random(self._random.getrandbits(64)),
        )

    def add(self, output: Output) -> None:
        """Send to one more; before `start`."""
        self._outputs.append(output)

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Outputs that it sends to."""
        return tuple(self._outputs)

    @property
    def is_running(self) -> bool:
        """Whether it still plays."""
        return self._task.is_running

    def start(self) -> None:
        """Begin to play; the stream's time begins now."""
        self._start_ns = self._clock.now_ns()
        self._task.start()

    def join(self, timeout_s: float) -> None:
        """Wait until it has played all."""
        self._task.join(timeout_s)

    def close(self) -> None:
        """Stop, and hang up everywhere."""
        self._task.cancel()
        self._task.join()
        for output in self._outputs:
            output.close()

    def _run(self, _task: Task[None]) -> None:
        film, faults = (
            self._plan.film,
            UnitFaults(self._plan.film, self._plan.schedule, self._random, self._stills),
        )
        number, seen_ns = 0, -1
        while not self._task.is_cancelled:
            due_ns = film.time_ns(number)
            if self._plan.seconds is not None and due_ns >= self._plan.seconds * NANOSECONDS:
                return
            self._wait_until(due_ns)
            self._report_faults(seen_ns, due_ns)
            seen_ns = due_ns
            unit = faults.passed(number)
            self._take(number, due_ns, unit)
            if unit is not None:
                for output in self._outputs:
                    output.put(unit)
            number += 1
            if self.now_ns() - due_ns > LATE_NS:
                number = max(number, film.keyframe_before(film.number_at(self.now_ns())))

    def _wait_until(self, t_ns: int) -> None:
        """In steps, so that a close is seen."""
        while not self._task.is_cancelled and (rest := t_ns - self.now_ns()) > 0:
            self._clock.sleep_until(self._clock.now_ns() + min(rest, NANOSECONDS // 5))

    def _take(self, number: int, due_ns: int, unit: OutgoingUnit | None) -> None:
        self.taken += unit is not None
        schedule, film = self._plan.schedule, self._plan.film
        truth = film.truth_of(film.unit(number).shows)
        if truth is not None:
            self._report_film(truth.faults, due_ns)
        if self._truth is None:
            return
        wall_ns = self._wall_ns() - (self.now_ns() - due_ns)
        is_on = unit is not None
        time = PictureTime(number, schedule.boot(due_ns), schedule.stamp_ns(due_ns), wall_ns, is_on)
        self._truth.taken(time, truth)

    def _report_faults(self, seen_ns: int, now_ns: int) -> None:
        for fault, begins in self._plan.schedule.between(seen_ns, now_ns):
            name = "fault_begins" if begins else "fault_ends"
            self._say(CameraEvent(name, now_ns, _shown(fault)))

    def _report_film(self, now: Mapping[str, float], t_ns: int) -> None:
        before, self._film_faults = self._film_faults, now
        for kind, size in now.items():
            if kind not in before:
                self._say(CameraEvent("fault_begins", t_ns, {"kind": kind, "size": size}))
        for kind in before:
            if kind not in now:
                self._say(CameraEvent("fault_ends", t_ns, {"kind": kind}))

    def _sent(self, unit: OutgoingUnit, output: str) -> None:
        if self._truth is not None:
            self._truth.sent(unit, output, self._wall_ns())


def _shown(fault: WireFault) -> Mapping[str, str | int | float]:
    return {"kind": fault.kind.value, "size": fault.size, "at_s": fault.at_s, "for_s": fault.for_s}
