"""Wishes of a site's people about shapes, on their way to the room that decides; its answers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from devices.hub.entities.reading import read_person
from devices.hub.protocol.fields import MAX_COUNT, MessageError, read_count, read_object, read_text
from devices.hub.protocol.messages import OpError, Wish, read_do
from devices.hub.roles import Op
from devices.sites.channels import SiteBytesError

MAX_WISH_BYTES = 4 * 1024
"""Length of a wish: a shape of twenty numbers as Python prints doubles is 800 bytes, twice two
names of 161 characters, and as much again."""

MAX_ANSWERS_BYTES = 128 * 1024
"""Length of what is answered to a site: a refusal in words of each of its wishes."""

MAX_ASKED = 256
"""Wishes of a site that are not answered: as many as its hub lets wait."""

MAX_WHY = 200
"""Characters of a refusal."""

ANSWER_NS = 5_000_000_000
"""Time after which a wish counts as refused, chosen: a room that is away is noticed after two
seconds, and a page shows what it asked for until then."""

NOT_REACHED = "the room is not reached"
"""Refusal where nobody decides."""


def pack_wish(wish: Wish, *, room_epoch: int) -> bytes:
    """Return a wish as it is sent to a room's start."""
    do, drawn = wish.do, wish.do.drawn
    assert drawn is not None, "a wish names a shape"
    fields = {"to": do.to} if do.op is Op.GIVE else drawn.fields()
    fields |= {"id": do.op_id, "op": str(do.op), "primitive": drawn.key}
    fields |= {"by": wish.person_id, "room": str(room_epoch)}
    return json.dumps(fields, separators=(",", ":")).encode()


def read_wish(data: bytes, *, room_epoch: int) -> Wish:
    """Return a wish.

    Raises:
        SiteBytesError: it is none; in words for whoever asked.
    """
    if len(data) > MAX_WISH_BYTES:
        raise SiteBytesError(f"wish: {len(data)} bytes, at most {MAX_WISH_BYTES}")
    try:
        fields = read_object(data)
        if read_text(fields, "room") != str(room_epoch):
            raise SiteBytesError("the room has started again")
        do = read_do(fields)
        if do.op not in (Op.PRIMITIVE, Op.GIVE):
            raise SiteBytesError(f"wish: op {do.op} is not about shapes")
        return Wish(read_person(fields, "by"), do)
    except (MessageError, OpError) as error:
        raise SiteBytesError(f"wish: {error}") from None


@dataclass(frozen=True, slots=True)
class Answers:
    """Decisions of a room about one site's wishes.

    Attributes:
        site_epoch: start of the site whose wishes they were.
        done: number up to which every wish that is not refused is done, and in the room's state.
        refused: why, by number: of those that the site still has.
    """

    site_epoch: int
    done: int = 0
    refused: Mapping[int, str] = field(default_factory=dict[int, str])


def pack_answers(answers: Answers) -> bytes:
    """Return answers as they are sent."""
    fields: dict[str, Any] = {"site": str(answers.site_epoch), "done": answers.done}
    fields["refused"] = {str(number): why[:MAX_WHY] for number, why in answers.refused.items()}
    return json.dumps(fields, separators=(",", ":")).encode()


def read_answers(data: bytes) -> Answers:
    """Return answers.

    Raises:
        SiteBytesError: they are none.
    """
    if len(data) > MAX_ANSWERS_BYTES:
        raise SiteBytesError(f"answers: {len(data)} bytes, at most {MAX_ANSWERS_BYTES}")
    try:
        fields = read_object(data)
        refused = fields.get("refused")
        if not isinstance(refused, dict) or len(cast(dict[str, Any], refused)) > MAX_ASKED:
            raise SiteBytesError(f"answers: refused: wanted at most {MAX_ASKED} by number")
        whys = {
            read_number(key): read_text(cast(dict[str, Any], refused), key)[:MAX_WHY]
            for key in cast(dict[str, Any], refused)
        }
        return Answers(_epoch(read_text(fields, "site")), read_count(fields, "done"), whys)
    except MessageError as error:
        raise SiteBytesError(f"answers: {error}") from None


def read_number(name: str) -> int:
    """Return the number of a wish by its item's name.

    Raises:
        SiteBytesError: it is none.
    """
    if not (name.isascii() and name.isdecimal() and len(name) <= len(str(MAX_COUNT))):
        raise SiteBytesError(f"wish: {name[:40]!r} is no number")
    return int(name)


def _epoch(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= len(str(2**64))):
        raise SiteBytesError(f"answers: site: {text[:40]!r} is no start")
    return int(text)


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    wish: Wish
    t_ns: int


@dataclass(slots=True)
class Asking:
    """Wishes of a site that have no answer yet."""

    _newest: int = 0
    _asked: dict[int, _Asked] = field(default_factory=dict[int, _Asked])

    def ask(self, wish: Wish, now_ns: int) -> int | None:
        """Return the number of a wish; None where too many have no answer."""
        if len(self._asked) >= MAX_ASKED:
            return None
        self._newest += 1
        self._asked[self._newest] = _Asked(wish, now_ns)
        return self._newest

    def take(self, answers: Answers) -> list[tuple[int, Wish, str]]:
        """Return wishes that are answered: number, wish, and why it was refused, or nothing."""
        return [
            (number, self._asked.pop(number).wish, answers.refused.get(number, ""))
            for number in list(self._asked)
            if number <= answers.done or number in answers.refused
        ]

    def refuse(
        self, why: str, *, asked_before_ns: int | None = None
    ) -> list[tuple[int, Wish, str]]:
        """Return wishes that nobody answers: all, or those that were asked before a time."""
        return [
            (number, self._asked.pop(number).wish, why)
            for number, each in list(self._asked.items())
            if asked_before_ns is None or each.t_ns < asked_before_ns
        ]
