"""A room's state on another machine: the same changes through the same reducer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from devices.sites.channels import DRAWN, OBJECTS, SiteBytesError
from devices.sites.drawn import Item, ended, item_name, read_item
from devices.sites.objects import read_object, read_objects
from devices.transport.followed import LogNews, News
from scenes.state import SceneState, TrackState, reduce_state


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
        for change in (
            *self.state.surfaces.values(),
            *self.state.annotations.values(),
            *self.state.primitives.values(),
        ):
            state = reduce_state(state, change, self.state.t_ns)
        return state

    def _take_drawn(self, news: LogNews) -> None:
        state = self.state
        items: dict[str, Item] = {}
        for entry in news.entries:
            try:
                items[entry.item] = read_item(entry.item, entry.data)
            except SiteBytesError:
                self.refused += 1
        if news.is_whole:
            for known in (state.annotations, state.surfaces, state.primitives):
                for item in known.values():
                    if item_name(item) not in items:
                        state = reduce_state(state, ended(item), state.t_ns)
        for item in items.values():
            state = reduce_state(state, item, state.t_ns)
        self.state = state


def as_lost(state: SceneState) -> SceneState:
    """Return a state in which nobody is sure of any object: its room is not reached."""
    for tracked in state.objects.values():
        lost = replace(tracked, state=TrackState.LOST, confidence=0.0)
        state = reduce_state(state, lost, state.t_ns)
    return state
