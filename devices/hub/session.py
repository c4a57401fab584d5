"""The session as its people share it: who is let in, what they may, what each is to get.

No socket and no thread: whoever calls holds `lock`, and wakes the connections afterwards.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from devices.hub.attendance import Attendance, Guest, Visit
from devices.hub.channels import (
    BodyChannel,
    LogChannel,
    PictureChannel,
    StateChannel,
    answer_fields,
    people_of,
    rights_text,
    to_text,
    welcome_of,
    whole_text,
)
from devices.hub.contract import Arrived
from devices.hub.elsewhere import Elsewhere, Others
from devices.hub.entities.deciding import Deciding
from devices.hub.entities.drawn import Drawn
from devices.hub.entry.admission import Admission, Refused
from devices.hub.entry.pairing import PairingCodes, PairingRefused
from devices.hub.entry.rates import refusal_lines
from devices.hub.entry.tokens import Tokens
from devices.hub.media.signals import MediaSignal, OfferSignal
from devices.hub.media.voice_room import VoiceRoom
from devices.hub.outbox import Outbox, Sent
from devices.hub.protocol.fields import MessageError
from devices.hub.protocol.mesh import MeshChannel
from devices.hub.protocol.messages import (
    DeviceSaid,
    Do,
    Hello,
    OpError,
    Ping,
    Seen,
    Wish,
    read_message,
)
from devices.hub.protocol.wire import WireError, check_body, head_only
from devices.hub.roles import Op, Person, Role, can_hold_pen
from scenes.state import SceneState

MAX_FAULTS = 20
"""Messages that cannot be read after which a person's connection is closed."""

RENEW_NS = 5 * 60 * 10**9
"""Age of a token at which a connected person gets a fresh one: a third of its life."""


class Session:
    """Everything that is shared.

    Args:
        max_people: connected at the same time.
        codes: ways in.
        tokens: ways back in.
        say: takes a line for the log.
        now_ns: session time of its beginning.
        is_voice_recorded: whether voices are kept for the session's recording.
    """

    def __init__(
        self,
        *,
        max_people: int,
        codes: PairingCodes,
        tokens: Tokens,
        say: Callable[[str], None],
        now_ns: int,
        is_voice_recorded: bool = False,
    ) -> None:
        self.lock, self.codes = threading.RLock(), codes
        self.states, self.log, self.bodies = StateChannel(), LogChannel(), BodyChannel()
        self.pictures, self.mesh = PictureChannel(), MeshChannel()
        self.sent, self.refused = Sent(), Counter[str]()
        self.media = VoiceRoom(None, is_voice_recorded, lambda kind: self.refused.update((kind,)))
        self._say, self._lines_of_refusals = say, refusal_lines(now_ns)
        self.attendance, self.deciding, self.others = Attendance(), Deciding(), Others()
        self._board, self._inbox = self.deciding.board, self.deciding.inbox
        self._pen = self.deciding.pen
        self._door = Admission(self.attendance, codes, tokens, max_people)

    def pair(self, code: str, *, name: str, address: str, now_ns: int) -> str:
        """Return a token for a code, which is used up.

        Raises:
            PairingRefused: it is wrong.
            Refused: the room is full.
        """
        try:
            guest = self._door.pair(code, name=name, address=address, now_ns=now_ns)
        except (PairingRefused, Refused) as error:
            self.refuse(f"{address}: {error}", kind=error.kind, now_ns=now_ns)
            raise
        self._note("paired", f"{guest.called} has paired as {guest.person.role}")
        return self._door.new_token(guest, now_ns)

    def known_by(self, token: str, now_ns: int) -> str:
        """Return whose token is good, without using it; empty where it is nobody's."""
        return self._door.known_by(token, now_ns)

    def enter(self, hello: Hello, *, address: str, now_ns: int) -> Visit:
        """Let somebody in whose token is good; the welcome waits in their outbox.

        Raises:
            Refused: it is not, or the room is full.
        """
        try:
            guest = self._door.admit(hello.token, now_ns)
        except Refused as error:
            self.refuse(f"{address}: {error}", kind=error.kind, now_ns=now_ns)
            raise
        if guest.outbox is not None:
            guest.outbox.end("you came in again on another connection")
        is_back = guest.is_listed(now_ns)
        outbox = Outbox(guest.person.index, self.sent)
        visit = Visit(guest, outbox)
        guest.outbox, guest.has_joined, guest.is_gone = outbox, True, False
        name = guest.person.name if hello.name is None else hello.name
        guest.person = replace(guest.person, name=name, is_connected=True)
        self.media.enter(guest.person, outbox, address=address, now_ns=now_ns)
        self._welcome(visit, hello, now_ns=now_ns)
        self._tell_people(now_ns)
        how = "is back" if is_back else "joined"
        self._note("joined", f"{guest.called} {how} as {guest.person.role}")
        return visit

    def leave(self, visit: Visit, now_ns: int) -> None:
        """Note that a connection has ended."""
        guest = visit.guest
        if guest.outbox is not visit.outbox:
            return
        guest.outbox, guest.away_since_ns = None, now_ns
        guest.person = replace(guest.person, is_connected=False, latency_ms=None)
        self.bodies.drop(guest.person.index)
        self.media.leave(guest.person.index)
        self._note("away", f"{guest.called} has lost the connection")

    def hear(self, visit: Visit, text: str, *, now_ns: int) -> bool:
        """Take a text from somebody; return whether the others get something of it."""
        guest, outbox, limits = visit.guest, visit.outbox, visit.guest.limits
        if not (limits.texts.take(now_ns) and limits.text_bytes.take(now_ns, float(len(text)))):
            self.refuse(f"{guest.called} sends too much", kind="rate", now_ns=now_ns)
            outbox.end("you send too much")
            return False
        try:
            message = read_message(text)
            if isinstance(message, Seen) and outbox.see(message.version):
                guest.oldest_token = max(guest.oldest_token, outbox.token_number)
            elif isinstance(message, Ping):
                pong = {"kind": "pong", "t_us": message.t_us, "hub_t_us": now_ns // 1000}
                outbox.put(to_text(pong))
            elif isinstance(message, DeviceSaid):
                guest.device = message, now_ns
            elif isinstance(message, Do):
                self._do(visit, message, now_ns=now_ns)
                return True
            elif isinstance(message, (OfferSignal, MediaSignal)):
                is_news = self.media.take_signal(guest.person.index, message, now_ns=now_ns)
                self._tell_people(now_ns)
                return is_news
        except OpError as error:
            self.refuse(f"{guest.called}: {error}", kind="op", now_ns=now_ns)
            outbox.put(to_text(answer_fields(error.op_id, str(error))))
        except MessageError as error:
            self.fault(visit, str(error), now_ns=now_ns)
        return False

    def see_body(self, visit: Visit, data: bytes, *, now_ns: int) -> bool:
        """Take a body from somebody; return whether the others get it."""
        guest = visit.guest
        if guest.person.is_muted:
            self.refused["muted"] += 1
            return False
        if not guest.limits.bodies.take(now_ns):
            self.refused["rate"] += 1
            return False
        try:
            check_body(data)
        except WireError as error:
            self.fault(visit, str(error), now_ns=now_ns)
            return False
        if guest.person.role is Role.SPECTATOR:
            data = head_only(data)
        guest.body, guest.body_ns = data, now_ns
        self.bodies.put(guest.person.index, data)
        return True

    def hear_voice(self, visit: Visit, data: bytes, *, now_ns: int) -> bool:
        """Take a moment of somebody's voice; return whether others get it over a WebSocket."""
        try:
            return self.media.hear(visit.guest.person.index, data, now_ns=now_ns)
        except WireError as error:
            self.fault(visit, str(error), now_ns=now_ns)
            return False

    def tell_speaking(self, now_ns: int) -> bool:
        """Send who speaks if it has changed; return whether it has."""
        if (text := self.media.speaking_news(now_ns)) is not None:
            self._tell_all(text)
        return text is not None

    def fault(self, visit: Visit, why: str, *, now_ns: int) -> None:
        """Count a message that cannot be read; too many end the connection."""
        guest, outbox = visit.guest, visit.outbox
        guest.faults += 1
        self.refuse(f"{guest.called}: {why}", kind="message", now_ns=now_ns)
        if guest.faults > MAX_FAULTS:
            guest.faults = 0
            outbox.end(f"your messages cannot be read: {why}")

    def publish(self, state: SceneState) -> None:
        """Take the next state of the room; what it has drawn itself goes to the log."""
        for drawn in self.deciding.publish(state):
            self._tell_all(self.log.add(drawn.entry()))
        self.states.take(state)
        self.pictures.keep(state.surfaces.keys())
        self.media.keep_surfaces(state.surfaces.keys())

    def tick(self, now_ns: int) -> None:
        """Do what is due: fresh tokens, and whoever was away too long is gone."""
        for guest in self.attendance.note_left(now_ns):
            self._take_pen(guest, now_ns)
            self._note("left", f"{guest.called} has left")
        for guest in self.attendance.forget_old(now_ns):
            self._board.forget(guest.person.person_id)
        for guest, outbox in self.attendance.connected():
            if now_ns - guest.renewed_ns >= RENEW_NS:
                outbox.put(to_text({"kind": "token", "token": self._door.new_token(guest, now_ns)}))
        self._tell_people(now_ns)

    def people(self, now_ns: int) -> tuple[Person, ...]:
        """Return who is here, and who may come back."""
        return tuple(self.media.seen(guest.person) for guest in self.attendance.listed(now_ns))

    def meet(self, others: Iterable[Elsewhere], now_ns: int, *, way: str = "sites") -> None:
        """Show people who are in the session another way: these, and nobody else by that way."""
        before = {each.person_id for each in self.others.people()}
        if self.others.take(others, self.bodies, way=way):
            for gone in before - {each.person_id for each in self.others.people()}:
                self._board.forget(gone)
            self._tell_people(now_ns)

    def act(self, person_id: str, do: Do, *, now_ns: int) -> Drawn | None:
        """Do what somebody asks for who is here another way, or KeyError; see `carry_out`."""
        return self._carry_out(self.others.find(person_id), do, now_ns=now_ns)

    def answer(self, wish: Wish, why: str, *, now_ns: int) -> None:
        """Let somebody learn why the room has refused their wish; empty where it was done."""
        do, guest = wish.do, self.attendance.find(wish.person_id)
        if why and do.drawn is not None:
            self._board.see_refused(wish.person_id, do.drawn.key)
            self.refuse(
                f"{guest.called if guest else wish.person_id}: {why}", kind="op", now_ns=now_ns
            )
        if guest is not None and guest.outbox is not None:
            guest.outbox.put(to_text(answer_fields(do.op_id, why)))

    def take(self) -> Arrived:
        """Return what people have sent since the last call, without their bodies."""
        return replace(self.deciding.take(), voices=self.media.take_recorded())

    def change(
        self,
        person_id: str,
        now_ns: int,
        *,
        role: Role | None = None,
        is_muted: bool | None = None,
    ) -> None:
        """Give somebody another role, or mute them; they and the others are sent that.

        Raises:
            KeyError: there is no such person.
        """
        guest = self.attendance.known(person_id)
        guest.change(role=role, is_muted=is_muted)
        person = guest.person
        self.media.change(person)
        if person.is_muted:
            guest.body = b""
            self.bodies.drop(person.index)
        if not can_hold_pen(person):
            self._take_pen(guest, now_ns)
        self._tell_rights(guest)
        self._tell_people(now_ns)
        self._note("changed", f"{guest.called} is {person.role}{', muted' * person.is_muted}")

    def give_pen(self, person_id: str | None, now_ns: int) -> None:
        """Let one person alone draw, or everybody again; all are sent their rights.

        Raises:
            KeyError: there is no such person.
            ValueError: their role lets them draw nothing.
        """
        found = self.attendance.known(person_id) if person_id else None
        if found is not None and not can_hold_pen(found.person):
            raise ValueError(f"hub: {found.person.name} draws nothing as {found.person.role}")
        self._pen.holder = person_id or ""
        for guest in self.attendance.listed(now_ns):
            guest.change(has_pen=guest.person.person_id == person_id)
            self._tell_rights(guest)
        self._tell_people(now_ns)
        self._note("changed", f"{found.called if found else 'everybody'} has the pen")

    def _take_pen(self, guest: Guest, now_ns: int) -> None:
        """Let everybody draw again if somebody had the pen."""
        if guest.person.person_id == self._pen.holder:
            self.give_pen(None, now_ns)

    def remove(self, person_id: str, now_ns: int) -> None:
        """Send somebody away for good.

        Raises:
            KeyError: there is no such person.
        """
        guest = self.attendance.known(person_id)
        self._take_pen(guest, now_ns)
        self.attendance.remove(person_id)
        self._board.forget(person_id)
        self.bodies.drop(guest.person.index)
        self.media.leave(guest.person.index)
        if guest.outbox is not None:
            guest.outbox.end("the operator has removed you")
        self._tell_people(now_ns)
        self._note("removed", f"{guest.called} was removed")

    def end(self) -> None:
        """Say goodbye to everybody."""
        for _guest, outbox in self.attendance.connected():
            outbox.end("the session is over")

    def refuse(self, text: str, *, kind: str, now_ns: int) -> None:
        """Count a refusal, and say so unless there are too many."""
        self.refused[kind] += 1
        if self._lines_of_refusals.take(now_ns):
            self._note("refused", text)

    def _welcome(self, visit: Visit, hello: Hello, *, now_ns: int) -> None:
        guest, person, outbox = visit.guest, visit.guest.person, visit.outbox
        entries = None if hello.log_seq is None else self.log.since(hello.log_seq)
        fields: dict[str, Any] = {
            **welcome_of(person, self._everybody(now_ns), pen=self._pen),
            "token": self._door.new_token(guest, now_ns),
            "media": self.media.welcome(),
            "log_seq": self.log.seq if entries is None else hello.log_seq,
            "resumed": entries is not None,
            "t_us": now_ns // 1000,
        }
        texts = [whole_text(fields, states=self.states, board=self._board), *(entries or ())]
        outbox.begin(texts, version=self.states.version, token_number=guest.newest_token)

    def _do(self, visit: Visit, do: Do, *, now_ns: int) -> None:
        if not visit.guest.limits.ops.take(now_ns):
            raise OpError("too many operations at once", op_id=do.op_id)
        if self._carry_out(visit.guest.person, do, now_ns=now_ns) is not None:
            visit.outbox.put(to_text(answer_fields(do.op_id)))

    def _carry_out(self, person: Person, do: Do, *, now_ns: int) -> Drawn | None:
        drawn = self.deciding.carry_out(person, do, here=self._everybody(now_ns), now_ns=now_ns)
        if drawn is not None:
            if do.op is Op.GIVE:
                self._say(f"people: {person.called} gave {drawn.key} to {drawn.name}")
            self._tell_all(self.log.add(drawn.entry()))
        return drawn

    def _tell_rights(self, guest: Guest) -> None:
        if guest.outbox is not None:
            guest.outbox.put(rights_text(guest.person, self._pen))

    def _tell_all(self, text: str) -> None:
        for _guest, outbox in self.attendance.connected():
            outbox.put(text)

    def _tell_people(self, now_ns: int) -> None:
        text = to_text({"kind": "people", "people": people_of(self._everybody(now_ns), self._pen)})
        for _guest, outbox in self.attendance.connected():
            outbox.put_people(text)

    def _everybody(self, now_ns: int) -> tuple[Person, ...]:
        """Return people of this hub and of others."""
        return (*self.people(now_ns), *self.others.people())

    def _note(self, kind: str, text: str) -> None:
        self._inbox.note(kind, text)
        self._say(f"people: {text}")
