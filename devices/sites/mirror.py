"""A room's state on another machine: the same changes through the same reducer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from devices.sites.channels import DRAWN, OBJECTS, SiteBytesError
from devices.sites.drawn import Item, read_item
from devices.sites.objects import read_object, read_objects
from devices.transport.followed import LogNews, News
from scenes.state import (
    Annotation,
    LiveSurface,
    SceneState,
    TrackState,
    reduce_state,
)

NOTHING = np.zeros((0, 3))
"""Points and corners of what is gone."""


class Mirror:
    """State of one room as it is known here.

    Attributes:
        state: the newest.
        refused: values and entries so far that could not be read.
    """

    def __init__(self) -> None:
        self.state = SceneState()
        self.refused = 0
        self._objects: dict[str, bytes] = {}

    def take(self, news: News) -> bool:
        """Take what is new of the room; return whether its state is another."""
        before = self.state
        if news.is_new:
            self.state, self._objects = SceneState(), {}
        drawn = news.logs.get(DRAWN)
        if drawn is not None:
            self._take_drawn(drawn)
        data = news.values.get(OBJECTS)
        if data is not None:
            try:
                self._take_objects(*read_objects(data))
            except SiteBytesError:
                self.refused += 1
        return self.state is not before

    def _take_objects(self, t_ns: int, given: Mapping[str, bytes]) -> None:
        changed = {name: data for name, data in given.items() if self._objects.get(name) != data}
        state = self.state
        if self._objects.keys() - given.keys():  # the reducer knows no end of an object
            state, changed = self._without_objects(), dict(given)
        for name, data in changed.items():
            state = reduce_state(state, read_object(name, data), t_ns)
        self.state, self._objects = state, dict(given)

    def _without_objects(self) -> SceneState:
        """Return what is drawn, in a new state of a later version."""
        state = SceneState(version=self.state.version)
        for change in (*self.state.surfaces.values(), *self.state.annotations.values()):
            state = reduce_state(state, change, self.state.t_ns)
        return state

    def _take_drawn(self, news: LogNews) -> None:
        state = self.state
        items: dict[tuple[type, str], Item] = {}
        for entry in news.entries:
            try:
                item = read_item(entry.item, entry.data)
            except SiteBytesError:
                self.refused += 1
                continue
            key = item.annotation_id if isinstance(item, Annotation) else item.surface_id
            items[(type(item), key)] = item
        if news.is_whole:
            for key, line in state.annotations.items():
                if (Annotation, key) not in items:
                    gone = replace(line, points_in_world=NOTHING)
                    state = reduce_state(state, gone, state.t_ns)
            for key, surface in state.surfaces.items():
                if (LiveSurface, key) not in items:
                    gone = replace(surface, corners_in_world=NOTHING)
                    state = reduce_state(state, gone, state.t_ns)
        for item in items.values():
            state = reduce_state(state, item, state.t_ns)
        self.state = state


def as_lost(state: SceneState) -> SceneState:
    """Return a state in which nobody is sure of any object: its room is not reached."""
    for tracked in state.objects.values():
        lost = replace(tracked, state=TrackState.LOST, confidence=0.0)
        state = reduce_state(state, lost, state.t_ns)
    return state
