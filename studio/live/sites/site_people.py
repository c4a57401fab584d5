"""People of all sites of a room, and what they have drawn since the last look."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from devices.hub.elsewhere import Elsewhere
from devices.hub.inbox import MAX_CHANGES, MAX_EVENTS, Avatars
from devices.hub.roles import Person
from devices.sites.channels import BODIES, DRAWN, MAX_SITE_PEOPLE, PEOPLE, SiteBytesError
from devices.sites.drawn import Item, ended, item_name, read_item
from devices.sites.people import read_bodies, read_people
from devices.transport.followed import LogNews, News
from scenes.state import Annotation, Avatar, LiveSurface, SharedPrimitive, is_there

MAX_POINTS = 1_000
"""Points of a line that comes from a site: as many as a hub takes of a person."""


@dataclass(slots=True)
class _Site:
    is_away: bool = False
    people: tuple[Person, ...] = ()
    bodies: dict[str, bytes] = field(default_factory=dict[str, bytes])
    items: dict[str, Item] = field(default_factory=dict[str, Item])


class SitePeople:
    """Everything that sites have sent, as if their people were here. The caller keeps others off.

    A site's name begins the ids of its people and of all that they draw: no site can send in the
    name of another.

    """

    def __init__(self) -> None:
        self._sites: dict[str, _Site] = {}
        self._changes: OrderedDict[str, Item] = OrderedDict()
        self._events: deque[tuple[str, str]] = deque(maxlen=MAX_EVENTS)
        self._avatars = Avatars()
        self.refused = 0
        """Messages so far that could not be read."""

    def take(self, news: News) -> None:
        """Take what is new of a site."""
        name = news.member.name
        if news.is_away:
            site = self._sites.setdefault(name, _Site())
            if site.people and not site.is_away:
                self._events.append(("away", f"site {name} is not reached"))
            site.is_away = True
            return
        if news.is_new and name not in self._sites:
            self._events.append(("joined", f"site {name} has joined"))
        site = self._sites.setdefault(name, _Site())
        site.is_away = False
        if news.is_new:
            site.people, site.bodies = (), {}
        self._read(partial(self._read_people, site, name=name), news.values.get(PEOPLE))
        self._read(partial(self._read_bodies, site), news.values.get(BODIES))
        if DRAWN in news.logs:
            self._take_drawn(site, news.logs[DRAWN], name=name)

    def names(self) -> tuple[str, ...]:
        """Return sites that have people here."""
        return tuple(n for n, site in self._sites.items() if site.people and not site.is_away)

    def everybody(self) -> list[Elsewhere]:
        """Return all people of all sites with their bodies."""
        return [
            Elsewhere(person, site.bodies.get(person.person_id.partition(".")[2], b""))
            for site in self._sites.values()
            for person in site.people
            if not site.is_away
        ]

    def avatars(self) -> tuple[Avatar, ...]:
        """Return those who show a body as the session sees them."""
        return self._avatars.of((each.person, each.body) for each in self.everybody() if each.body)

    def changes(self) -> tuple[list[Annotation], list[LiveSurface], list[tuple[str, str]]]:
        """Return lines, surfaces and events since the last call, and forget them."""
        items = list(self._changes.values())
        events = list(self._events)
        self._changes.clear()
        self._events.clear()
        return (
            [item for item in items if isinstance(item, Annotation)],
            [item for item in items if isinstance(item, LiveSurface)],
            events,
        )

    def _read(self, read: Callable[[bytes], None], data: bytes | None) -> None:
        if data is None:
            return
        try:
            read(data)
        except SiteBytesError:
            self.refused += 1

    def _read_people(self, site: _Site, data: bytes, *, name: str) -> None:
        people = read_people(data, limit=MAX_SITE_PEOPLE)
        site.people = tuple(replace(p, person_id=f"{name}.{p.person_id}") for p in people)

    def _read_bodies(self, site: _Site, data: bytes) -> None:
        site.bodies = read_bodies(data, site.bodies, limit=MAX_SITE_PEOPLE)

    def _take_drawn(self, site: _Site, news: LogNews, *, name: str) -> None:
        found: dict[str, Item] = {}
        for entry in news.entries:
            try:
                item = _of_site(read_item(entry.item, entry.data), name)
            except SiteBytesError:
                self.refused += 1
                continue
            found[item_name(item)] = item
        if news.is_whole:
            for key, item in site.items.items():
                if key not in found:
                    found[key] = ended(item)
        for key, item in found.items():
            if is_there(item):
                site.items[key] = item
            else:
                site.items.pop(key, None)
            self._changes.pop(key, None)
            self._changes[key] = item
        while len(self._changes) > MAX_CHANGES:
            self._changes.popitem(last=False)


def _of_site(item: Item, name: str) -> Item:
    """Return an item with the site's name before its ids.

    Raises:
        SiteBytesError: a line is longer than people's may be, or it is a shape: those are wishes.
    """
    if isinstance(item, SharedPrimitive):
        raise SiteBytesError(f"shape {item.primitive_id[:40]!r}: a site asks for it by a wish")
    if isinstance(item, LiveSurface):
        return replace(item, surface_id=f"{name}.{item.surface_id}")
    if len(item.points_in_world) > MAX_POINTS:
        raise SiteBytesError(f"line of {len(item.points_in_world)} points, at most {MAX_POINTS}")
    return replace(
        item, annotation_id=f"{name}.{item.annotation_id}", user_id=f"{name}.{item.user_id}"
    )
