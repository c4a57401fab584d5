"""Everything that people have put into the room, its limits, and undo for each person."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from devices.hub.entities.drawn import ROOM, Drawn
from devices.hub.protocol.messages import Do, OpError
from devices.hub.roles import Op, Person, can_have_shapes

MAX_LINES = 2000
"""Lines at the same time; chosen: an hour of drawing."""

MAX_POINTS_IN_ALL = 50_000
"""Points of all lines together: about 1.5 MB of text for whoever joins."""

MAX_SURFACES = 32
"""Surfaces that people have made, at the same time; each is a video."""

MAX_PRIMITIVES, MAX_PRIMITIVES_EACH = 256, 64
"""Primitives at the same time, of all and of one person; chosen: a furnished room."""

MAX_PROPOSALS, MAX_PROPOSALS_EACH = 16, 8
"""Proposals at the same time, of all and of one person; each is a copy of an object's splats."""

LIMITS: Mapping[Op, tuple[str, int, int]] = MappingProxyType(
    {
        Op.LINE: ("lines", MAX_LINES, MAX_LINES),
        Op.SURFACE: ("surfaces", MAX_SURFACES, MAX_SURFACES),
        Op.PRIMITIVE: ("primitives", MAX_PRIMITIVES, MAX_PRIMITIVES_EACH),
        Op.PROPOSE: ("proposals", MAX_PROPOSALS, MAX_PROPOSALS_EACH),
    }
)
"""Entities by operation: in words, at most of all, at most of one person."""

MAX_UNDO = 100
"""Operations that a person can undo."""

STEADY_NS = 10**9
"""Pause after which changing the same entity again is another operation to undo, where a client
does not say which operations are one drag: one second."""

HOLD_NS = 10**9
"""Pause after which somebody has let go of an object's copy, or of a shape: one second, as
`STEADY_NS`; a page sends ten of its places a second while it is dragged."""

Drag = str | int | None
"""A client's name of one drag; None where it gives none."""


@dataclass(slots=True, eq=False)
class _Step:
    """An entity before the operations that one undo takes back.

    Attributes:
        before: as it was.
        t_ns: of the newest operation that is taken back with it.
        drag: the client's name of these operations.
        is_open: whether more operations can be taken back with it.
    """

    before: Drawn
    t_ns: int
    drag: Drag
    is_open: bool


@dataclass(frozen=True, slots=True)
class _Hold:
    """Somebody who moves an object's copy, or a shape: id, name, and when they moved it last."""

    person_id: str
    name: str
    t_ns: int


@dataclass(slots=True)
class Board:
    """Every entity that is there now."""

    _entities: dict[Op, dict[str, Drawn]] = field(
        default_factory=lambda: {op: dict[str, Drawn]() for op in LIMITS}
    )
    _points: int = 0
    _steps: dict[str, deque[_Step]] = field(default_factory=dict[str, "deque[_Step]"])
    _holds: dict[str, _Hold] = field(default_factory=dict[str, _Hold])
    """Holds by object: whoever began to move a copy of it first has it until they let go. Holds by
    primitive: when its owner moved it last."""
    _wished: dict[str, tuple[Drawn, int]] = field(default_factory=dict[str, "tuple[Drawn, int]"])
    """Primitives as their room was asked for them, and when, by name: of a site."""

    def whole(self) -> dict[str, Any]:
        """Return entities for whoever joins, by kind and name."""
        return {
            LIMITS[op][0]: {key: {"by": it.by, **it.fields()} for key, it in there.items()}
            for op, there in self._entities.items()
        }

    def carry_out(self, person: Person, do: Do, *, here: Iterable[Person], now_ns: int) -> Drawn:
        """Do what somebody asks for; return what has become of the entity.

        Args:
            person: who asks.
            do: what for.
            here: everybody who is here.
            now_ns: session time.

        Raises:
            OpError: as `do` and `give`.
        """
        try:
            if do.op is Op.GIVE:
                by_id = {it.person_id: it for it in here}
                return self.give(person.person_id, do, here=by_id, now_ns=now_ns)
            return self.do(person.person_id, do, now_ns=now_ns, name=person.name)
        except OpError as error:
            raise OpError(str(error), op_id=do.op_id) from None

    def do(self, person_id: str, do: Do, *, now_ns: int, name: str = "") -> Drawn:
        """Do what a person asks for; return what has become of the entity.

        Args:
            person_id: who asks.
            do: what for.
            now_ns: session time.
            name: of the person.

        Raises:
            OpError: there is nothing to undo, it is somebody else's, somebody else moves the same
                object, or too much is there.
        """
        if do.drawn is None:
            steps = self._steps.get(person_id)
            if not steps:
                raise OpError("there is nothing to undo", op_id=do.op_id)
            before = steps[-1].before
            self._check_room(before, do)
            steps.pop()
            self.put(before)
            return before
        key = self._key_of(person_id, do)
        changed = replace(do.drawn, key=key, by=person_id, name=name)
        self._check_room(changed, do)
        self._hold(changed, do, now_ns=now_ns)
        before = self._entities[do.op].get(key) or Drawn(do.op, key, person_id)
        self._remember(before, changed, drag=do.drag, now_ns=now_ns)
        self.put(changed)
        return changed

    def give(self, person_id: str, do: Do, *, here: Mapping[str, Person], now_ns: int = 0) -> Drawn:
        """Let somebody else have a primitive; return it as theirs.

        Its owner gives it to whoever is here and may put primitives. What somebody who is not here
        any more has left, anybody takes for themselves: whoever asks first. So do they of whoever
        has no page to hand it over, unless it is being moved.

        Args:
            person_id: who asks.
            do: what for.
            here: everybody who is here, by id.
            now_ns: session time.

        Raises:
            OpError: it is gone, somebody else has it, or whoever should have it cannot.
        """
        assert do.drawn is not None, "a gift has a name"
        key, taker = in_full(person_id, do.drawn.key), here.get(do.to)
        given = self._entities[Op.PRIMITIVE].get(key)
        if given is None:
            raise OpError("it is not there any more", op_id=do.op_id)
        owner, who = here.get(given.by), given.name or given.by
        is_free = (owner is None or owner.is_yielding) and do.to == person_id
        if given.by != person_id and not is_free:
            raise OpError(f"{who} has it", op_id=do.op_id)
        hold = self._holds.get(key)
        if given.by != person_id and owner and hold and now_ns - hold.t_ns < HOLD_NS:
            raise OpError(f"{who} is moving it; wait until they let go", op_id=do.op_id)
        if taker is None or not can_have_shapes(taker):
            raise OpError(_why_not(taker), op_id=do.op_id)
        if given.by == do.to:
            return given
        changed = replace(given, by=do.to, name=taker.name)
        if self._count(changed) >= MAX_PRIMITIVES_EACH:
            why = f"{taker.name} has {MAX_PRIMITIVES_EACH} primitives, the most for one person"
            raise OpError(why, op_id=do.op_id)
        self.put(changed)
        return changed

    def wish(self, person_id: str, do: Do, *, now_ns: int) -> Do | None:
        """Return what the room of this site is to be asked for; None of what is not its to decide.

        Whose a shape is only the room knows. What an undo asks for is that one is as before.

        Args:
            person_id: who asks here.
            do: what for.
            now_ns: session time.
        """
        if do.drawn is None:
            steps = self._steps.get(person_id)
            if not steps or steps[-1].before.op is not Op.PRIMITIVE:
                return None
            asked = steps.pop().before
        elif do.op in (Op.PRIMITIVE, Op.GIVE):
            asked = replace(do.drawn, key=in_full(person_id, do.drawn.key), by=person_id)
        else:
            return None
        if do.op is Op.GIVE:
            return replace(do, drawn=asked)
        self._wished = {k: it for k, it in self._wished.items() if now_ns - it[1] < STEADY_NS}
        if do.drawn is not None:
            key, nothing = asked.key, Drawn(Op.PRIMITIVE, asked.key, person_id)
            before = self._entities[Op.PRIMITIVE].get(key, nothing)
            before = self._wished.get(key, (before, 0))[0]
            self._remember(before, asked, drag=do.drag, now_ns=now_ns)
        self._wished[asked.key] = asked, now_ns
        return replace(do, op=Op.PRIMITIVE, drawn=asked)

    def see_refused(self, person_id: str, key: str) -> None:
        """Let the room have refused somebody's wish: what never was is not to be taken back."""
        self._wished.pop(key, None)
        steps = self._steps.get(person_id)
        if steps and (steps[-1].before.op, steps[-1].before.key) == (Op.PRIMITIVE, key):
            before = steps[-1].before
            is_new = not before.is_there and key not in self._entities[Op.PRIMITIVE]
            if is_new or before.by != person_id:
                steps.pop()

    def put(self, drawn: Drawn) -> bool:
        """Replace an entity, or take it away at its end; return whether that is a change.

        Nobody takes anything back of a primitive that was given away.
        """
        there = self._entities[drawn.op]
        old = there.pop(drawn.key, None)
        if drawn.is_there:
            there[drawn.key] = drawn
            if drawn.op is Op.PRIMITIVE and old is not None and old.by != drawn.by:
                self._forget_steps(drawn.key)
        elif drawn.op is Op.PRIMITIVE:
            self._holds.pop(drawn.key, None)
        if drawn.op is Op.LINE:
            self._points += len(drawn.points) - (0 if old is None else len(old.points))
        return old is not None or drawn.is_there

    def forget(self, person_id: str) -> None:
        """Keep no operations to undo of somebody who does not come back."""
        self._steps.pop(person_id, None)
        self._holds = {key: it for key, it in self._holds.items() if it.person_id != person_id}

    def _forget_steps(self, key: str) -> None:
        """Keep nothing of a primitive of former owners: neither their steps nor their moves."""
        for steps in self._steps.values():
            kept = [it for it in steps if (it.before.op, it.before.key) != (Op.PRIMITIVE, key)]
            steps.clear()
            steps.extend(kept)
        self._holds.pop(key, None)
        self._wished.pop(key, None)

    def _hold(self, changed: Drawn, do: Do, *, now_ns: int) -> None:
        """Give a proposal's object to whoever moves it, unless somebody else has it.

        A primitive is its owner's anyhow: only when they moved it is kept.
        """
        if changed.op is Op.PRIMITIVE and changed.is_there:
            self._holds[changed.key] = _Hold(changed.by, changed.name, now_ns)
        if changed.op is not Op.PROPOSE:
            return
        if not changed.is_there:
            known = self._entities[changed.op].get(changed.key)
            hold = None if known is None else self._holds.get(known.object_id)
            if known is not None and hold is not None and hold.person_id == changed.by:
                del self._holds[known.object_id]
            return
        hold = self._holds.get(changed.object_id)
        if hold and hold.person_id != changed.by and now_ns - hold.t_ns < HOLD_NS:
            who = hold.name or hold.person_id
            raise OpError(f"{who} is moving it; wait until they let go", op_id=do.op_id)
        self._holds[changed.object_id] = _Hold(changed.by, changed.name, now_ns)

    def _key_of(self, person_id: str, do: Do) -> str:
        """Return the name in the session of what a person asks for.

        A primitive is whose it was made last, or whose undo would bring it back: what its maker
        sent before they learnt that somebody else has it does not make it anew.

        Raises:
            OpError: it is somebody else's.
        """
        assert do.drawn is not None, "an undo names nothing"
        key = in_full(person_id, do.drawn.key)
        known = self._entities[do.op].get(key)
        if do.op is not Op.PRIMITIVE:
            return own_key(person_id, key)
        if known is not None and known.by != ROOM:
            owner, name = known.by, known.name
        else:
            owner, name = next(
                (
                    (it.before.by, it.before.name)
                    for steps in self._steps.values()
                    for it in steps
                    if it.before.op is do.op and it.before.key == key
                ),
                (key.partition("/")[0], ""),
            )
        if owner != person_id:
            raise OpError(f"{name or owner} has it", op_id=do.op_id)
        return key

    def _count(self, drawn: Drawn) -> int:
        """Return how many of its kind its owner has."""
        return sum(it.by == drawn.by for it in self._entities[drawn.op].values())

    def _check_room(self, drawn: Drawn, do: Do) -> None:
        there = self._entities[drawn.op]
        old = there.get(drawn.key)
        if not drawn.is_there:
            return
        words, most, most_each = LIMITS[drawn.op]
        if old is None and len(there) >= most:
            raise OpError(f"{len(there)} {words} are there, erase some", op_id=do.op_id)
        own = self._count(drawn) if most_each < most else 0
        if old is None and own >= most_each:
            raise OpError(f"{own} {words} of yours are there, erase some", op_id=do.op_id)
        more = len(drawn.points) - (0 if old is None else len(old.points))
        if drawn.op is Op.LINE and self._points + more > MAX_POINTS_IN_ALL:
            raise OpError(f"lines of {self._points} points are there, erase some", op_id=do.op_id)

    def _remember(self, before: Drawn, changed: Drawn, *, drag: Drag, now_ns: int) -> None:
        """Let a line that grows, or an entity that is carried, be taken back as one."""
        steps = self._steps.setdefault(changed.by, deque(maxlen=MAX_UNDO))
        newest = steps[-1] if steps else None
        if newest is not None and newest.is_open and changed.is_there:
            is_same = (newest.before.op, newest.before.key) == (changed.op, changed.key)
            is_one = changed.op is Op.LINE or (
                newest.drag == drag
                if drag is not None
                else newest.drag is None and now_ns - newest.t_ns < STEADY_NS
            )
            if is_same and is_one:
                newest.t_ns = now_ns
                return
        if not changed.is_there and not before.is_there:
            return
        steps.append(_Step(before, now_ns, drag, changed.is_there))


def _why_not(taker: Person | None) -> str:
    """Return why somebody cannot be given a shape, in words for whoever gives it."""
    if taker is None:
        return "nobody of that name is here"
    return f"{taker.name} only watches"


def in_full(person_id: str, key: str) -> str:
    """Return an entity's name in the session by a person's own, or by that very name."""
    return key if "/" in key else f"{person_id}/{key}"


def own_key(person_id: str, key: str) -> str:
    """Return a person's entity by its name in the session.

    Raises:
        OpError: it is somebody else's.
    """
    found = in_full(person_id, key)
    if not found.startswith(f"{person_id}/"):
        raise OpError(f"{key} belongs to somebody else")
    return found
