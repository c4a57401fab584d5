"""A hub on another machine, fed by a room: people who join there are in that room."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from devices.clock import Clock
from devices.clock_mapping import ClockMapping, add_arrival, estimate
from devices.hub.elsewhere import Elsewhere
from devices.hub.protocol.mesh import MAX_CELLS, Cell, unpack_cell
from devices.hub.protocol.messages import Wish
from devices.hub.roles import Person
from devices.hub.server import Hub
from devices.sites.about import RoomAbout, read_about
from devices.sites.channels import (
    ANSWERS,
    BODIES,
    DRAWN,
    HIDDEN,
    MAX_PEOPLE,
    MAX_PICTURES,
    PEOPLE,
    PICTURE,
    ROOM_LIMITS,
    WISHES,
    SiteBytesError,
)
from devices.sites.drawn import item_name, pack_item
from devices.sites.hidden import read_cells
from devices.sites.mirror import Mirror, as_lost
from devices.sites.own_items import SURE_NS, OwnItems
from devices.sites.people import pack_bodies, pack_people, read_bodies, read_people
from devices.sites.pictures import read_picture
from devices.sites.wishes import (
    ANSWER_NS,
    MAX_ASKED,
    NOT_REACHED,
    Asking,
    pack_wish,
    read_answers,
)
from devices.transport.followed import LogNews, News
from devices.transport.follower import Follower
from devices.transport.keys import room, site
from devices.transport.source import LogFullError, Source
from devices.transport.transport import Transport
from studio.live.sites.turns import Turns


@dataclass(frozen=True, slots=True)
class SiteStatus:
    """How a site is doing.

    Attributes:
        is_reached: whether the room is heard.
        about: what it says of itself; None before it was heard.
        objects: how many it has.
        others: people who are in the room, but not by this site.
        refused: messages so far that could not be read.
    """

    is_reached: bool
    about: RoomAbout | None
    objects: int
    others: int
    refused: int


class JoinedSite:
    """A site of a room. Any thread.

    Args:
        transport: the way to the room.
        session: of the room, which is its name.
        name: of the site, unique in the room.
        hub: by which people join here.
        clock: the hub's time.
        epoch: time of day in nanoseconds.
        say: takes a line for the log.
    """

    def __init__(
        self,
        transport: Transport,
        *,
        session: str,
        name: str,
        hub: Hub,
        clock: Clock,
        epoch: int,
        say: Callable[[str], None],
    ) -> None:
        self._hub, self._clock, self._say = hub, clock, say
        self._source = Source(transport, site(session, name), logs=(DRAWN, WISHES), epoch=epoch)
        hub.be_site()
        self._name, self._epoch = name, epoch
        self._follower = Follower(
            transport, room(session), limits=ROOM_LIMITS, logs=(DRAWN, HIDDEN, ANSWERS), clock=clock
        )
        self._mirror, self._own = Mirror(), OwnItems(name, session)
        self._asking, self._room_epoch = Asking(), 0
        self._answered: list[tuple[int, Wish, str]] = []
        self._room_clock = ClockMapping()
        self._beat: tuple[int, int] | None = None
        self._about: RoomAbout | None = None
        self._is_reached = False
        self._people: tuple[Person, ...] = ()
        self._own_people: tuple[Person, ...] | None = None
        self._bodies: dict[str, bytes] = {}
        self._pictures: dict[str, bytes] = {}
        self._surfaces: frozenset[str] = frozenset()
        self._cells: set[Cell] = set()
        self._next_look_ns = 0
        self._refused = 0
        self._turns = Turns("site", self.turn, say=say)

    def start(self) -> None:
        """Begin to take and send."""
        self._turns.start()

    def close(self) -> None:
        """Leave the room."""
        self._turns.end()
        self._follower.close()
        self._source.close()

    def status(self) -> SiteStatus:
        """Return how it is doing."""
        return SiteStatus(
            self._is_reached,
            self._about,
            len(self._mirror.state.objects),
            len(self._others()) if self._is_reached else 0,
            self._refused + self._mirror.refused + self._follower.refused,
        )

    def turn(self) -> None:
        """Look once at what is new, both ways."""
        now_ns = self._clock.now_ns()
        is_news = self._send(now_ns)
        has_people = False
        for news in self._follower.take():
            is_news |= self._take(news)
            has_people = True
        if has_people:
            self._hub.meet(self._others() if self._is_reached else [])
        if is_news or now_ns >= self._next_look_ns:
            self._next_look_ns = now_ns + SURE_NS // 4
            self._publish(now_ns)
        self._answer(now_ns)
        self._source.beat(now_ns, {})

    def _send(self, now_ns: int) -> bool:
        """Send what people here have drawn, who they are, and their bodies; return if they drew."""
        arrived = self._hub.take()
        for item in (*arrived.lines, *arrived.surfaces):
            self._own.note_sent(item, now_ns)
            try:
                self._source.append(DRAWN, item_name(item), data=pack_item(item))
            except LogFullError as error:
                self._say(f"site: {item_name(item)} is not sent: {error}")
        own = self._hub.people()
        if own != self._own_people:
            self._source.keep(PEOPLE, pack_people(own))
            self._own_people = own
        self._source.keep(BODIES, pack_bodies((p.person_id, b) for p, b in self._hub.bodies()))
        for wish in arrived.wishes:  # after who they are
            self._ask(wish, now_ns)
        return bool(arrived.lines or arrived.surfaces)

    def _ask(self, wish: Wish, now_ns: int) -> None:
        """Ask the room for a change of a shape."""
        number = self._asking.ask(wish, now_ns) if self._is_reached else None
        if number is None:
            why = f"{MAX_ASKED} changes have no answer yet" if self._is_reached else NOT_REACHED
            self._hub.answer(wish, why)
            return
        do, drawn = wish.do, wish.do.drawn
        named = None if drawn is None else replace(drawn, key=self._own.name_there(drawn.key))
        there = replace(do, drawn=named, to=do.to and self._own.name_there(do.to))
        data = pack_wish(Wish(wish.person_id, there), room_epoch=self._room_epoch)
        self._source.append(WISHES, str(number), data=data)

    def _answer(self, now_ns: int) -> None:
        """Let people learn what was decided; every one sees the shape before."""
        late = self._asking.refuse("the room has not answered", asked_before_ns=now_ns - ANSWER_NS)
        answered, self._answered = [*self._answered, *late], []
        for number, wish, why in answered:
            self._source.append(WISHES, str(number), data=b"")
            self._hub.answer(wish, why)

    def _take(self, news: News) -> bool:
        if news.beat is not None and news.beat != self._beat:
            self._beat = news.beat
            self._room_clock = add_arrival(self._room_clock, *news.beat)
        self._about = read_about(news.about) if news.beat is not None else self._about
        was_reached, self._is_reached = self._is_reached, not news.is_away
        if was_reached != self._is_reached:
            self._say("the room is reached" if self._is_reached else "the room is not reached")
        if news.is_new:
            self._people, self._bodies, self._pictures = (), {}, {}
            self._answered += self._asking.refuse("the room has started again")
        self._room_epoch = news.epoch
        is_news = self._mirror.take(news) or was_reached != self._is_reached
        if HIDDEN in news.logs:
            self._take_hidden(news.logs[HIDDEN])
        if ANSWERS in news.logs:
            self._take_answers(news.logs[ANSWERS])
        for channel, data in news.values.items():
            if data is None:
                continue
            try:
                is_news |= self._take_value(channel, data)
            except SiteBytesError:
                self._refused += 1
        return is_news

    def _take_answers(self, news: LogNews) -> None:
        for entry in news.entries:
            if entry.item != self._name:
                continue
            try:
                answers = read_answers(entry.data)
            except SiteBytesError:
                self._refused += 1
                continue
            if answers.site_epoch == self._epoch:
                self._answered += self._asking.take(answers)

    def _take_value(self, channel: str, data: bytes) -> bool:
        if channel == PEOPLE:
            self._people = read_people(data, limit=MAX_PEOPLE)
        elif channel == BODIES:
            self._bodies = read_bodies(data, self._bodies, limit=MAX_PEOPLE)
        elif channel.startswith(PICTURE):
            surface_id, jpeg = read_picture(data)
            if len(self._pictures) < MAX_PICTURES:
                self._pictures[self._own.name_here(surface_id)] = jpeg
            return True
        return False

    def _take_hidden(self, news: LogNews) -> None:
        """Let the room's surfaces hide what is behind them here: cells that have changed."""
        cells, refused = read_cells(news)
        self._refused += refused
        if news.is_whole:
            cells = {cell: unpack_cell(cell, b"") for cell in self._cells - cells.keys()} | cells
        for cell, mesh in list(cells.items()):
            if not len(mesh.faces):
                self._cells.discard(cell)
            elif cell in self._cells or len(self._cells) < MAX_CELLS:
                self._cells.add(cell)
            else:
                del cells[cell]
        if cells:
            self._hub.hide_behind(cells)

    def _others(self) -> list[Elsewhere]:
        return [
            Elsewhere(
                replace(person, person_id=self._own.name_here(person.person_id)),
                self._bodies.get(person.person_id, b""),
            )
            for person in self._people
            if not self._own.is_own(person.person_id)
        ]

    def _publish(self, now_ns: int) -> None:
        state = self._mirror.state if self._is_reached else as_lost(self._mirror.state)
        clock = estimate(self._room_clock)
        t_ns = now_ns if clock is None else max(0, clock.session_ns(state.t_ns))
        shown = replace(self._own.shown(state, now_ns), t_ns=t_ns)
        self._hub.publish(shown)
        # A picture follows its surface, which people are told of a moment after it is published.
        for surface_id in [key for key in self._pictures if key in self._surfaces]:
            self._hub.show(surface_id, self._pictures.pop(surface_id))
        self._surfaces = frozenset(shown.surfaces)
