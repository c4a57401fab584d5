"""Playhead of a recording: plays, pauses, steps and jumps, by an injected clock."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

from devices.clock import Clock

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Recorded seconds per second."""


class Playback:
    """The playhead of one recording.

    Args:
        frames_ns: times of frames, in order; may be empty.
        start_ns: first instant.
        end_ns: last instant.
        clock: real time.
        origin_ns: the instant that people read as 0 s.
    """

    def __init__(
        self,
        frames_ns: Sequence[int],
        *,
        start_ns: int,
        end_ns: int,
        clock: Clock,
        origin_ns: int = 0,
    ) -> None:
        self.is_looping = False
        self._frames_ns = frames_ns
        self._start_ns, self._end_ns = start_ns, end_ns
        self._clock = clock
        self.origin_ns = origin_ns
        self._speed = 1.0
        self._is_playing = False
        self._base_ns = start_ns
        self._since_ns = 0
        """Real time at which the playhead was at `_base_ns`."""

    @property
    def is_playing(self) -> bool:
        """Whether it moves."""
        return self._is_playing

    @property
    def end_ns(self) -> int:
        """The last instant."""
        return self._end_ns

    @property
    def start_ns(self) -> int:
        """The first instant."""
        return self._start_ns

    @property
    def speed(self) -> float:
        """Of `SPEEDS`."""
        return self._speed

    @property
    def t_ns(self) -> int:
        """The instant that is shown now; arriving at the end pauses, or begins again in a loop."""
        if not self._is_playing:
            return self._base_ns
        passed = (self._clock.now_ns() - self._since_ns) * self._speed
        t_ns = self._base_ns + round(passed)
        if t_ns < self._end_ns:
            return t_ns
        if not self.is_looping or self._end_ns <= self._start_ns:
            self._is_playing = False
            self._base_ns = self._end_ns
            return self._end_ns
        length = self._end_ns - self._start_ns
        self._set(self._start_ns + (t_ns - self._start_ns) % length)
        return self._base_ns

    def seconds(self, t_ns: int) -> float:
        """An instant as people read it."""
        return (t_ns - self.origin_ns) / 1e9

    def instant_ns(self, t_s: float) -> int:
        """The instant that people read as so many seconds."""
        return self.origin_ns + round(t_s * 1e9)

    def play(self) -> None:
        """Go on; from the start if it is at the end."""
        if self._is_playing:
            return
        if self._base_ns >= self._end_ns:
            self._base_ns = self._start_ns
        self._is_playing = True
        self._since_ns = self._clock.now_ns()

    def pause(self) -> None:
        """Stop where it is."""
        self._base_ns = self.t_ns
        self._is_playing = False

    def seek(self, t_ns: int) -> None:
        """Go to an instant, or the nearest one of the recording; plays on if it played."""
        self._set(min(max(t_ns, self._start_ns), self._end_ns))

    def step(self, frames: int) -> None:
        """Pause and go forward, or back, by frames."""
        self.pause()
        if not len(self._frames_ns) or not frames:
            return
        if frames > 0:
            number = bisect_right(self._frames_ns, self._base_ns) + frames - 1
        else:
            number = bisect_left(self._frames_ns, self._base_ns) + frames
        last = len(self._frames_ns) - 1
        self._set(int(self._frames_ns[min(max(number, 0), last)]))

    def change_speed(self, steps: int) -> None:
        """Faster, or slower, by steps of `SPEEDS`."""
        self._set(self.t_ns)
        number = SPEEDS.index(self._speed) + steps
        self._speed = SPEEDS[min(max(number, 0), len(SPEEDS) - 1)]

    def jump(self, marks_ns: Sequence[int], *, forward: bool) -> bool:
        """Go to the next, or previous, of these instants; whether there was one.

        Args:
            marks_ns: in any order.
            forward: which way.
        """
        now = self.t_ns
        ahead = [t for t in marks_ns if (t > now if forward else t < now)]
        inside = [t for t in ahead if self._start_ns <= t <= self._end_ns]
        if inside:
            self._set(min(inside) if forward else max(inside))
        return bool(inside)

    def _set(self, t_ns: int) -> None:
        self._base_ns = t_ns
        self._since_ns = self._clock.now_ns()
