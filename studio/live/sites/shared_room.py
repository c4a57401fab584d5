"""A live session that sites join: its state and people go out, what sites send comes in."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

from devices.clock import Clock
from devices.hub.contract import Arrived
from devices.hub.elsewhere import Elsewhere
from devices.hub.entities.deciding import Deciding
from devices.hub.entities.drawn import Drawn
from devices.hub.protocol.mesh import Cell, MeshChannel
from devices.hub.protocol.messages import Do
from devices.hub.roles import Person
from devices.sites.about import RoomAbout
from devices.sites.channels import (
    ANSWERS,
    BODIES,
    DRAWN,
    HIDDEN,
    MAX_PICTURES,
    OBJECTS,
    PEOPLE,
    PICTURE,
    SITE_LIMITS,
    WISHES,
)
from devices.sites.drawn import Item, ended, item_name, pack_item
from devices.sites.hidden import cell_name
from devices.sites.objects import pack_objects
from devices.sites.people import pack_bodies, pack_people
from devices.sites.pictures import pack_picture
from devices.transport.follower import Follower
from devices.transport.keys import ANY, Member, MemberRole, room
from devices.transport.source import LogFullError, Source
from devices.transport.transport import Transport
from scenes.mesh import CollisionMesh
from scenes.state import SceneState
from studio.live.people.entering import People
from studio.live.sites.deciding import Decisions
from studio.live.sites.site_people import SitePeople
from studio.live.sites.turns import Turns

SITES = "sites"
"""Way by which people of sites are here."""


class LocalHub(Protocol):
    """Part of a hub that a shared room needs."""

    def bodies(self) -> list[tuple[Person, bytes]]:
        """Return its own people who show a body, and the newest of each."""
        ...

    def people(self) -> tuple[Person, ...]:
        """Return its own people."""
        ...

    def meet(self, others: list[Elsewhere], *, way: str = ...) -> None:
        """Show people of sites."""
        ...

    def elsewhere(self, *, but: str) -> list[Elsewhere]:
        """Return who is here another way, such as a headset's wearer, but not that one."""
        ...

    def act(self, person_id: str, do: Do) -> Drawn | None:
        """Do what somebody of a site asks for."""
        ...


class SharedRoom:
    """People of a session, wherever they join: stands for its hub. Any thread.

    Args:
        transport: the way to the sites.
        name: of the room.
        about: what is said of it.
        inner: the session's own people; None where nobody can join here.
        hub: returns the hub of the moment; None while nobody can join here.
        clock: session time.
        epoch: time of day in nanoseconds.
        say: takes a line for the log.
    """

    def __init__(
        self,
        transport: Transport,
        name: str,
        *,
        about: RoomAbout,
        inner: People | None,
        hub: Callable[[], LocalHub | None],
        clock: Clock,
        epoch: int,
        say: Callable[[str], None],
    ) -> None:
        self.name = name
        self._about, self._inner, self._hub = about, inner, hub
        self._clock, self._say = clock, say
        self._source = Source(transport, room(name), logs=(DRAWN, HIDDEN, ANSWERS), epoch=epoch)
        self._follower = Follower(
            transport,
            Member(name, MemberRole.SITE, ANY),
            limits=SITE_LIMITS,
            logs=(DRAWN, WISHES),
            clock=clock,
        )
        self._lock = threading.Lock()
        self._people, self._decisions = SitePeople(), Decisions(epoch)
        self._deciding = Deciding()  # of shapes while there is no hub that does
        self._newest = self._told = SceneState()
        self._pictures: dict[str, bytes] = {}
        self._slots: dict[str, int] = {}
        self._everybody: tuple[Person, ...] | None = None
        self._mesh = MeshChannel()
        self._told_cells = 0
        self._is_mesh_cut = False
        self._turns = Turns("sites", self.turn, say=say)

    def start(self) -> None:
        """Begin to share."""
        self._turns.start()

    def close(self) -> None:
        """Share no more; sites notice it after two seconds."""
        self._turns.end()
        self._follower.close()
        self._source.close()

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once."""
        self._newest = state
        if self._inner is not None:
            self._inner.publish(state)

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody; returns at once."""
        with self._lock:
            self._pictures[surface_id] = jpeg
        if self._inner is not None:
            self._inner.show(surface_id, jpeg)

    def hide_behind(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Let surfaces hide what is behind them at the sites: cells that changed, world metres."""
        with self._lock:
            self._mesh.take(cells)

    def take(self) -> Arrived:
        """Return what people have sent since the last call, here and at the sites."""
        own = Arrived() if self._inner is None else self._inner.take()
        with self._lock:
            lines, surfaces, events = self._people.changes()
            avatars = self._people.avatars()
            decided = self._deciding.take()
        return replace(
            own,
            avatars=(*own.avatars, *avatars),
            lines=(*own.lines, *lines),
            surfaces=(*own.surfaces, *surfaces),
            placed=(*own.placed, *decided.placed),
            events=(*own.events, *events, *decided.events),
        )

    def sites(self) -> tuple[str, ...]:
        """Return sites that have people here."""
        with self._lock:
            return self._people.names()

    def turn(self) -> None:
        """Look once at what is new, both ways."""
        state = self._newest
        if state.objects is not self._told.objects:
            self._source.set(OBJECTS, pack_objects(state.objects.values(), state.t_ns))
        self._tell_changes(self._told.annotations, state.annotations)
        self._tell_changes(self._told.surfaces, state.surfaces)
        self._tell_changes(self._told.primitives, state.primitives)
        self._told = state
        self._tell_pictures(state)
        self._tell_mesh()
        hub = self._hub()
        with self._lock:
            self._deciding.publish(SceneState(primitives=state.primitives))
            for news in self._follower.take():
                self._people.take(news)
                self._decisions.take(news, self._clock.now_ns())
            others = self._people.everybody()
        if hub is not None:
            hub.meet(others, way=SITES)
        self._decide(hub, others, state=state)
        own = () if hub is None else hub.people()
        bodies = [] if hub is None else [(p.person_id, body) for p, body in hub.bodies()]
        others += [] if hub is None else hub.elsewhere(but=SITES)
        self._tell_everybody((*own, *(each.person for each in others)))
        bodies += [(each.person.person_id, each.body) for each in others if each.body]
        self._source.keep(BODIES, pack_bodies(bodies))
        about = replace(self._about, people=len(own) + len(others))
        self._source.beat(self._clock.now_ns(), about.fields())

    def _decide(self, hub: LocalHub | None, others: list[Elsewhere], *, state: SceneState) -> None:
        """Carry out what people of sites ask of shapes, and answer: by the hub, if there is one."""
        now_ns = self._clock.now_ns()
        people = {each.person.person_id: each.person for each in others}

        def act(person_id: str, do: Do) -> Drawn | None:
            with self._lock:
                here, person = people.values(), people[person_id]
                return self._deciding.carry_out(person, do, here=here, now_ns=now_ns)

        self._decisions.carry_out(act if hub is None else hub.act, now_ns)
        for name, data in self._decisions.answers(state, now_ns).items():
            self._source.append(ANSWERS, name, data=data)

    def _tell_everybody(self, people: tuple[Person, ...]) -> None:
        if people != self._everybody:
            self._source.keep(PEOPLE, pack_people(people))
            self._everybody = people

    def _tell_changes(self, before: Mapping[str, Item], now: Mapping[str, Item]) -> None:
        if now is before:
            return
        for key, item in now.items():
            if before.get(key) is not item:
                self._append(item)
        for key in before.keys() - now.keys():
            self._append(ended(before[key]))

    def _append(self, item: Item) -> None:
        try:
            self._source.append(DRAWN, item_name(item), data=pack_item(item))
        except LogFullError as error:
            self._say(f"sites: {item_name(item)} is not shared: {error}")

    def _tell_mesh(self) -> None:
        """Send cells that have changed, as many at a time as a page gets: bodies wait no longer."""
        with self._lock:
            found = self._mesh.cells_after(self._told_cells)
            gone = {} if found is None else {cell: not self._mesh.has(cell) for cell in found[1]}
        if found is None:
            return
        self._told_cells, cells = found
        for cell, data in cells.items():
            try:
                self._source.append(HIDDEN, cell_name(cell), data=b"" if gone[cell] else data)
            except LogFullError as error:
                if not self._is_mesh_cut:
                    self._say(f"sites: of the headset's surfaces, some are not shared: {error}")
                self._is_mesh_cut = True

    def _tell_pictures(self, state: SceneState) -> None:
        with self._lock:
            pictures, self._pictures = self._pictures, {}
        if not pictures and self._slots.keys() <= state.surfaces.keys():
            return
        for gone in self._slots.keys() - state.surfaces.keys():
            self._source.drop(f"{PICTURE}-{self._slots.pop(gone)}")
        free = iter(sorted(set(range(MAX_PICTURES)) - set(self._slots.values())))
        for surface_id, jpeg in pictures.items():
            if surface_id not in state.surfaces:
                continue
            slot = self._slots.get(surface_id)
            if slot is None:
                slot = next(free, None)
            if slot is not None:
                self._slots[surface_id] = slot
                self._source.set(f"{PICTURE}-{slot}", pack_picture(surface_id, jpeg))
