"""Names of the room at a site, and what its people have drawn: sent, and recognised in the echo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from scenes.state import Annotation, LiveSurface, SceneState, SharedPrimitive

T = TypeVar("T", Annotation, LiveSurface)
N = TypeVar("N", Annotation, LiveSurface, SharedPrimitive)

SURE_NS = 1_000_000_000
"""Time after which the room's state says whether an item is there: it has been there and back."""

MAX_OWN = 8_192
"""Items of a site's people that are remembered; twice what a room takes. The oldest go first."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sent:
    item: Annotation | LiveSurface
    t_ns: int


class OwnItems:
    """Lines, surfaces and shapes between a site's hub and the room.

    The hub knows its people's own by the very values that it gave out. Those come back in place of
    the room's echo, however old that is; what the room does not have, although it has had the time,
    is gone. Shapes are as the room has them, whoever has made them.

    Args:
        site: name of the site, which begins its people's ids in the room.
        room: name of the room, which begins all others' ids here.
    """

    def __init__(self, site: str, room: str) -> None:
        self._site, self._room = f"{site}.", f"{room}."
        self._sent: dict[tuple[type, str], _Sent] = {}
        self._kept: dict[tuple[type, str], tuple[object, object]] = {}
        """Values of the room with other ids, which stay the same values as long as they do."""

    def note_sent(self, item: Annotation | LiveSurface, now_ns: int) -> None:
        """Remember a value of the hub that is on its way to the room; or its end."""
        if isinstance(item, Annotation):
            key, is_there = item.annotation_id, len(item.points_in_world) > 0
        else:
            key, is_there = item.surface_id, len(item.corners_in_world) > 0
        self._sent.pop((type(item), key), None)
        if is_there:
            self._sent[(type(item), key)] = _Sent(item, now_ns)
            while len(self._sent) > MAX_OWN:
                del self._sent[next(iter(self._sent))]

    def name_here(self, key: str) -> str:
        """Return the id that an item or a person of the room has here."""
        is_own = key.startswith(self._site)
        return key.removeprefix(self._site) if is_own else f"{self._room}{key}"

    def name_there(self, key: str) -> str:
        """Return the id that an item or a person has in the room by the one here."""
        is_room = key.startswith(self._room)
        return key.removeprefix(self._room) if is_room else f"{self._site}{key}"

    def is_own(self, key: str) -> bool:
        """Return whether an id in the room is one of this site's people."""
        return key.startswith(self._site)

    def shown(self, state: SceneState, now_ns: int) -> SceneState:
        """Return the room's state as the hub here takes it."""
        lines = self._mapped(state.annotations, Annotation, now_ns=now_ns)
        surfaces = self._mapped(state.surfaces, LiveSurface, now_ns=now_ns)
        shapes = {self.name_here(key): it for key, it in state.primitives.items()}
        shapes = {here: self._renamed(it, here) for here, it in shapes.items()}
        self._keep_only(SharedPrimitive, shapes)
        return replace(state, annotations=lines, surfaces=surfaces, primitives=shapes)

    def _mapped(self, items: Mapping[str, T], kind: type[T], *, now_ns: int) -> Mapping[str, T]:
        found: dict[str, T] = {}
        for key, item in items.items():
            here = self.name_here(key)
            sent = self._sent.get((kind, here)) if self.is_own(key) else None
            if sent is not None and isinstance(sent.item, kind):
                found[here] = sent.item
            elif not self.is_own(key):
                found[here] = self._renamed(item, here)
        for (each, here), sent in list(self._sent.items()):
            if each is not kind or here in found or not isinstance(sent.item, kind):
                continue
            if now_ns - sent.t_ns < SURE_NS:
                found[here] = sent.item  # on its way
            else:
                del self._sent[(each, here)]
        self._keep_only(kind, found)
        return found

    def _keep_only(self, kind: type, found: Mapping[str, object]) -> None:
        for name in [n for n in self._kept if n[0] is kind and n[1] not in found]:
            del self._kept[name]

    def _renamed(self, item: N, here: str) -> N:
        name = (type(item), here)
        kept = self._kept.get(name)
        if kept is not None and kept[0] is item and isinstance(kept[1], type(item)):
            return kept[1]
        if isinstance(item, Annotation):
            made = replace(item, annotation_id=here, user_id=self.name_here(item.user_id))
        elif isinstance(item, SharedPrimitive):
            by = item.user_id and self.name_here(item.user_id)
            made = replace(item, primitive_id=here, user_id=by)
        else:
            made = replace(item, surface_id=here)
        self._kept[name] = (item, made)
        return made
