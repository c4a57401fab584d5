"""Changes that people ask for: whether they may, what becomes of the entity, what a session takes.

No socket and no thread: whoever calls keeps others off.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from devices.hub.contract import Arrived
from devices.hub.entities.board import Board
from devices.hub.entities.drawn import Drawn, drawn_by_room
from devices.hub.inbox import Inbox
from devices.hub.protocol.messages import Do, OpError, Wish
from devices.hub.roles import Op, Pen, Person
from scenes.state import SceneState

MAX_WISHES = 256
"""Wishes of a site's people that wait for the site's next look, a ninetieth of a second apart: what
32 people may ask for in a fifth of a second."""


@dataclass(slots=True)
class Deciding:
    """Decides over the entities of one session.

    Attributes:
        board: entities that are there.
        inbox: what the session has yet to take.
        pen: rights beside people's roles.
        is_site: whether shapes are decided in the room of which this is a site.
    """

    board: Board = field(default_factory=Board)
    inbox: Inbox = field(default_factory=Inbox)
    pen: Pen = field(default_factory=Pen)
    is_site: bool = False
    _state: SceneState = field(default_factory=SceneState)
    _wishes: deque[Wish] = field(default_factory=deque[Wish])

    def publish(self, state: SceneState) -> list[Drawn]:
        """Take the next state of the room; return what it has drawn itself, for everybody."""
        before, self._state = self._state, state
        found: list[Drawn] = []
        for drawn in drawn_by_room(before, state, is_known=self.inbox.recognise):
            self.inbox.see_end(drawn)
            if drawn.is_finite and self.board.put(drawn):
                found.append(drawn)
        return found

    def carry_out(
        self, person: Person, do: Do, *, here: Iterable[Person], now_ns: int
    ) -> Drawn | None:
        """Do what somebody asks for; return what has become of the entity, for everybody.

        Args:
            person: who asks.
            do: what for.
            here: everybody who is here.
            now_ns: session time.

        Returns:
            None where the room of this site is to decide.

        Raises:
            OpError: it cannot be done.
        """
        if why := self.pen.refusal(person, do.op):
            raise OpError(why, op_id=do.op_id)
        if do.drawn is not None and do.drawn.object_id not in ("", *self._state.objects):
            raise OpError("there is no such object", op_id=do.op_id)
        if self.is_site:
            if len(self._wishes) >= MAX_WISHES:
                why = f"{MAX_WISHES} changes of shapes wait for the room; ask again"
                raise OpError(why, op_id=do.op_id)
            wish = self.board.wish(person.person_id, do, now_ns=now_ns)
            if wish is not None:
                self._wishes.append(Wish(person.person_id, wish))
                return None
        drawn = self.board.carry_out(person, do, here=here, now_ns=now_ns)
        if do.op is Op.GIVE:
            self.inbox.note("given", f"{person.called} gave {drawn.key} to {drawn.name}")
        self.inbox.draw(drawn)
        return drawn

    def take(self) -> Arrived:
        """Return everything since the last call but people's bodies, and forget it."""
        wishes = tuple(self._wishes)
        self._wishes.clear()
        return replace(self.inbox.take(), wishes=wishes)
