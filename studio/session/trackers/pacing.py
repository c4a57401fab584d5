"""Pace of the tracker's searches and looks in a session, and its record."""

from __future__ import annotations

import time
from typing import Protocol

from devices.messages import Frame
from devices.recording_codec import FrameStamp
from tracking.beside.runner import SearchBesideFrames
from tracking.hypotheses.budget import NOMINAL_COSTS, MeasuredCosts, RepeatedCosts, StepCosts
from tracking.hypotheses.search_runner import (
    IN_FRAMES,
    SearchAsRecorded,
    SearchInFrames,
    SearchRunner,
)

SEARCH_NICENESS = 10
"""How much less urgent than the session a search of the whole room is: on two busy cores a tenth of
the tracker's share (the kernel's weights are 110 to 1024), and all that is left over. Live sessions
of 50 s, two cores, seeds 0 and 5: 787 and 760 pictures tracked for 650 and 659 with 5, a pose 148
and 155 ms for 213 and 190 (95th percentiles)."""

LOOK_NICENESS = 5
"""Likewise of a look. With 10 it takes 5 to 8 s on two full cores, 2 to 3 s with 0; one that ends
3 s after its picture leaves 6 to 16 % of what is in plain sight wrong, after 1 s 5 (four films, 5
pictures a second). Live sessions of 40 s with a simulated headset, seeds 12, 0: 25 and 27 % wrong
with 10, 8 and 16 with 5, 12 and 10 with 0; its video 43 and 75, 61 and 70, 120 and 94 ms."""


class Pacing(Protocol):
    """Paces the searches of a session's tracker."""

    @property
    def costs(self) -> StepCosts:
        """Of the steps of searches in the frames."""
        ...

    @property
    def searches(self) -> SearchRunner:
        """Computes the searches for lost objects."""
        ...

    @property
    def looks(self) -> SearchRunner:
        """Computes the looks around where objects were known."""
        ...

    def begin(self, stamp: FrameStamp | None) -> None:
        """A frame is tracked now.

        Args:
            stamp: of a recorded frame.
        """
        ...

    def stamp(self, frame: Frame) -> FrameStamp | None:
        """Return the record of a frame that has just been tracked, to repeat it."""
        ...

    def close(self) -> None:
        """Nothing will be tracked any more."""
        ...


class InFrames:
    """Searches take a share of each frame.

    Args:
        costs: nominal ones make every run the same, measured ones keep a stream's pace.
    """

    def __init__(self, costs: StepCosts = NOMINAL_COSTS) -> None:
        self.costs: StepCosts = costs
        in_frames = IN_FRAMES if costs is NOMINAL_COSTS else SearchInFrames(costs)
        self.searches: SearchRunner = in_frames
        self.looks: SearchRunner = in_frames

    def begin(self, stamp: FrameStamp | None) -> None:
        """See `Pacing.begin`: nothing is different for a recorded frame."""

    def stamp(self, frame: Frame) -> FrameStamp | None:
        """See `Pacing.stamp`: nothing but the frame is needed."""
        return None

    def close(self) -> None:
        """See `Pacing.close`: nothing goes on."""


class Live:
    """Searches and looks are computed beside the frames, all else as it was measured.

    Each in its own process: a look that waited for a search of the whole room would be of no use,
    and one that is late finds what is carried where it no longer is.
    """

    def __init__(self) -> None:
        self._costs = MeasuredCosts(time.perf_counter_ns)
        self._searches, self._looks = (
            SearchBesideFrames(niceness) for niceness in (SEARCH_NICENESS, LOOK_NICENESS)
        )
        self.costs: StepCosts = self._costs
        self.searches: SearchRunner = self._searches
        self.looks: SearchRunner = self._looks

    def begin(self, stamp: FrameStamp | None) -> None:
        """See `Pacing.begin`; forgets what settings that were tried beside have taken."""
        del stamp
        self._costs.taken()
        for runner in (self._searches, self._looks):
            runner.start()
            runner.has_ended()

    def stamp(self, frame: Frame) -> FrameStamp | None:
        """See `Pacing.stamp`: how long steps took, and whether a search or a look ended."""
        return stamp_of(
            frame,
            self._costs.taken(),
            search_ended=self._searches.has_ended(),
            look_ended=self._looks.has_ended(),
        )

    def close(self) -> None:
        """See `Pacing.close`: gives up what is computed."""
        self._searches.close()
        self._looks.close()


class AsRecorded:
    """Searches and looks as they went in a live session."""

    def __init__(self) -> None:
        self._costs = RepeatedCosts()
        self._searches = SearchAsRecorded(self._costs)
        self._looks = SearchAsRecorded(self._costs)
        self.costs: StepCosts = self._costs
        self.searches: SearchRunner = self._searches
        self.looks: SearchRunner = self._looks

    def begin(self, stamp: FrameStamp | None) -> None:
        """See `Pacing.begin`: the steps of this frame are those of the recorded one."""
        self._costs.give(() if stamp is None else stamp.steps_ms)
        self._searches.give(ends=None if stamp is None else stamp.search_ended)
        self._looks.give(ends=None if stamp is None else stamp.look_ended)

    def stamp(self, frame: Frame) -> FrameStamp | None:
        """See `Pacing.stamp`: the recorded one says it."""
        return None

    def close(self) -> None:
        """See `Pacing.close`: nothing goes on."""


def stamp_of(
    frame: Frame,
    steps_ms: tuple[float, ...] = (),
    *,
    search_ended: bool | None = None,
    look_ended: bool | None = None,
) -> FrameStamp:
    """A frame's stamp, with how its searches and looks went."""
    return FrameStamp(
        frame.stream_id,
        frame.seq,
        frame.t_ns,
        frame.received_ns,
        frame.world_from_rig,
        steps_ms,
        search_ended,
        look_ended,
    )
