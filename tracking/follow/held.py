"""Objects while nobody knows where the camera is: what it sees says nothing of where they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scenes.state import TrackState
from tracking.follow.track import Track
from tracking.solve.motion import Motion

HELD_SIGMA = np.array([0.03, 0.03, 0.002, math.radians(3)])
"""(4,) growth per frame of the standard deviation of what moved: metres, radians; as of what is
hidden."""


def held(track: Track, now_ns: int) -> Track:
    """The track of an object after a frame that says nothing: what moved is held, unseen."""
    if track.state is not TrackState.TRACKED:
        return replace(track, motion=Motion.rest(now_ns))
    return replace(
        track,
        covariance=track.covariance + np.diag(HELD_SIGMA**2),
        state=TrackState.OCCLUDED,
        missed_frames=track.missed_frames + 1,
        still_frames=0,
        motion=Motion.rest(now_ns),
        rest=None,
    )


def seen_anew(track: Track) -> Track:
    """The track of an object that is seen from elsewhere now: place kept, patches not.

    Its remembered appearance is still a good one, but no longer of the same pixels.
    """
    memory = track.appearance
    moved = None if memory is None else replace(memory, was_at_rest=False)
    return replace(track, rest=None, appearance=moved)
