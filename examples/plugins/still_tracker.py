"""A tracker that leaves every object where the scan saw it: the least that a tracker must do."""
# ruff: noqa: D101, D102

import numpy as np

from scenes.state import TrackedObject, TrackState
from tracking.output import TrackOutput


class StillTracker:
    def __init__(self, scene):
        self._objects = scene.objects

    def start(self):
        return None

    def step(self, state, frame, now_ns):
        tracks = tuple(
            TrackedObject(item.object_id, frame.t_ns, item.world_from_object, 1e-4 * np.eye(4),
                          1.0, TrackState.TRACKED, 0.5, frame.seq)
            for item in self._objects
        )  # fmt: skip
        return state, TrackOutput(tracks, {}, frame.world_from_rig)


def register(studio):
    studio.tracker("still", StillTracker)
