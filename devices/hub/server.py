"""The hub's server: pairing, people, the room's state to all of them, and their changes to it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

from aiohttp import web

from devices.clock import Clock
from devices.hub.attendance import PageHeadset
from devices.hub.connection import Connection, Peers
from devices.hub.contract import Arrived, Asset, HubCounts, HubSettings, Invitation
from devices.hub.elsewhere import Elsewhere
from devices.hub.entities.drawn import Drawn
from devices.hub.entry.certificates import Certificates, keep_certificates, lan_addresses
from devices.hub.entry.pairing import PairingCodes
from devices.hub.entry.tokens import Tokens
from devices.hub.inbox import Avatars
from devices.hub.media.link import MediaLink, is_available
from devices.hub.media.voice_room import link_to
from devices.hub.port import Port, address_of, own_names, tls_of
from devices.hub.protocol.mesh import Cell
from devices.hub.protocol.messages import Do, Wish
from devices.hub.protocol.wire import pack_picture
from devices.hub.roles import Person, Role
from devices.hub.session import Session
from devices.hub.site import HEADERS, Site, defect_line, is_loopback
from scenes.mesh import CollisionMesh
from scenes.state import SceneState
from scenes.workers.task import Task

T = TypeVar("T")

START_S = 10.0
"""Longest time to open a port."""

CLOSE_S = 5.0
"""Longest time to say goodbye to everybody."""

GOODBYE_S = 1.0
"""Time in which goodbyes are sent."""

TICK_S = 0.5
"""Time between looks at who is away, silent or stuck."""

LOOK_S, IDLE_LOOK_S = 0.005, 0.1
"""Time between looks for a new state: while somebody is there, the age that it adds to a state is
a sixth of the tracker's period at most; while nobody is, it only keeps the newest."""

IDLE_S = 15.0
"""Time that a connection may be idle before and between requests."""


class Hub:
    """People in a session. Its sockets live on a thread of its own; every method is safe anywhere.

    What is asked of somebody who is not there is a KeyError.

    Args:
        settings: where it listens.
        assets: files of the page by path, "/" the page itself. Looked up at each request.
        clock: session time.
        say: takes a line for the log, on any thread; never a secret.
        codes: ways in; others for tests.
        tokens: ways back in; others for tests.

    Raises:
        ValueError: open to the network without a certificate.
    """

    def __init__(
        self,
        settings: HubSettings,
        assets: Mapping[str, Asset],
        *,
        clock: Clock,
        say: Callable[[str], None] = lambda _text: None,
        codes: PairingCodes | None = None,
        tokens: Tokens | None = None,
    ) -> None:
        if settings.certificate_folder is None and not is_loopback(settings.host):
            raise ValueError(
                f"hub: host {settings.host} is open to the network without a certificate; "
                "give a certificate_folder"
            )
        self._settings, self._assets, self._clock, self._say = settings, assets, clock, say
        self._session = Session(
            max_people=settings.max_people,
            codes=codes or PairingCodes(),
            tokens=tokens or Tokens(),
            say=say,
            now_ns=clock.now_ns(),
            is_voice_recorded=settings.is_voice_recorded,
        )
        self._media: MediaLink | None = None
        self._certificates: Certificates | None = None
        self._task: Task[None] | None = None
        self._ending: asyncio.Event | None = None
        self._peers = Peers(clock)
        self._newest: SceneState | None = None
        self._avatars = Avatars()
        self._port = settings.port
        self._names: frozenset[str] = frozenset()

    def start(self) -> None:
        """Listen.

        Raises:
            OSError: the port is taken, or the certificate cannot be made.
            RuntimeError: it listens already.
        """
        if self._task is not None:
            raise RuntimeError("hub: start() was called before")
        addresses = lan_addresses()
        self._names = own_names(self._settings, addresses)
        if self._settings.certificate_folder is not None:
            self._certificates = keep_certificates(
                self._settings.certificate_folder, names=tuple(sorted(self._names))
            )
        if is_available():
            reach = ("127.0.0.1",) if is_loopback(self._settings.host) else addresses
            self._media = link_to(
                self._session.media,
                reach,
                lock=self._session.lock,
                now_ns=self._clock.now_ns,
                say=self._say,
                wake=self._peers.wake_soon,
            )
        listening: Future[int] = Future()

        def work(_task: Task[None]) -> None:
            try:
                asyncio.run(self._run(listening))
            except OSError as error:
                if listening.done():
                    raise
                listening.set_exception(error)

        self._task = Task("hub", work).start()
        try:
            listening.result(START_S)
        except BaseException:
            self._task.join(CLOSE_S)
            self._task = None
            raise

    def close(self) -> None:
        """Say goodbye to everybody and free the port. Harmless when it is closed."""
        task, ending = self._task, self._ending
        if task is None or ending is None:
            return
        self._peers.call_soon(ending.set)
        if self._media is not None:
            self._media.close()
        task.join(CLOSE_S)

    @property
    def url(self) -> str:
        """Address of the page, with the machine's own address where it is open to the network."""
        return address_of(self._settings, self._port)

    @property
    def port(self) -> int:
        """Number of the port at which it listens, or listened last."""
        return self._port

    @property
    def root_pem(self) -> bytes | None:
        """Certificate that a headset installs once to trust this machine; None without TLS."""
        return None if self._certificates is None else self._certificates.root_pem

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once.

        The hub's thread looks for it: waking it would let it take the interpreter from the caller,
        for 5 ms where a crowd keeps it busy.
        """
        self._newest = state

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody, the newest where a link is slow.

        Args:
            surface_id: of a surface in a published state.
            jpeg: its picture, upright, the first corner at the top left.

        Raises:
            WireError: the picture is larger than may be sent.
        """
        message = pack_picture(surface_id, jpeg)
        with self._session.lock:
            self._take_newest()  # a surface reaches everybody before its picture
            self._session.pictures.put(surface_id, message)
            self._session.media.show(surface_id, jpeg)
        self._peers.wake_soon()

    def take(self) -> Arrived:
        """Return what people have sent since the last call."""
        with self._session.lock:
            arrived = self._session.take()
            bodies = self._session.attendance.shown(self._clock.now_ns())
        return replace(arrived, avatars=self._avatars.of(bodies))

    def meet(self, others: Sequence[Elsewhere], *, way: str = "sites") -> None:
        """Show people who are in the session another way: these, and nobody else by that way."""
        with self._session.lock:
            self._session.meet(others, self._clock.now_ns(), way=way)
        self._peers.wake_for_bodies_soon()

    def elsewhere(self, *, but: str) -> list[Elsewhere]:
        """Return people who are in the session by another way than this hub, and than that one."""
        with self._session.lock:
            return self._session.others.by_other_ways(but)

    def act(self, person_id: str, do: Do) -> Drawn | None:
        """Do what somebody asks who is here another way, or OpError; return what comes of it."""
        return self._change(lambda session, now_ns: session.act(person_id, do, now_ns=now_ns))

    def be_site(self) -> None:
        """Leave shapes to the room of which this is a site, from now on: see `Arrived.wishes`."""
        self._change(lambda session, _now_ns: setattr(session.deciding, "is_site", True))

    def answer(self, wish: Wish, why: str = "") -> None:
        """Let somebody learn what the room has decided of their wish: why not, if it has not."""
        self._change(lambda session, now_ns: session.answer(wish, why, now_ns=now_ns))

    def bodies(self) -> list[tuple[Person, bytes]]:
        """Return this hub's own people who show a body, and the newest of each."""
        with self._session.lock:
            return self._session.attendance.shown(self._clock.now_ns())

    def people(self) -> tuple[Person, ...]:
        """Return who is here by this hub, and who may come back."""
        with self._session.lock:
            return self._session.people(self._clock.now_ns())

    def headsets(self) -> tuple[PageHeadset, ...]:
        """Return headsets of this hub's people, as their pages say them."""
        with self._session.lock:
            return self._session.attendance.headsets(self._clock.now_ns())

    def invite(self, role: Role = Role.REMOTE) -> Invitation:
        """Make a code."""
        with self._session.lock:
            code, expires_ns = self._session.codes.make(role, self._clock.now_ns())
        return Invitation(code, f"{self.url}#code={code}", role, expires_ns)

    def revoke(self, code: str) -> None:
        """Let a code be worth nothing."""
        self._change(lambda session, _now_ns: session.codes.revoke(code))

    def set_role(self, person_id: str, role: Role) -> None:
        """Give a person another role; their rights change at once."""
        self._change(lambda session, now_ns: session.change(person_id, now_ns, role=role))

    def mute(self, person_id: str, *, is_muted: bool) -> None:
        """Refuse a person's body and operations, or take them again."""
        self._change(lambda session, now_ns: session.change(person_id, now_ns, is_muted=is_muted))

    def give_pen(self, person_id: str | None) -> None:
        """Let one person alone draw; None lets everybody again whose role allows it.

        Raises:
            ValueError: their role lets them draw nothing.
        """
        self._change(lambda session, now_ns: session.give_pen(person_id, now_ns))

    def record_voices(self, *, is_recorded: bool) -> None:
        """Hand voices to the session, which records them, or no longer; everybody is told."""
        self._change(lambda session, _now_ns: session.media.record(is_recorded=is_recorded))

    @property
    def is_voice_recorded(self) -> bool:
        """Whether voices are handed to the session."""
        return self._session.media.is_recorded

    def remove(self, person_id: str) -> None:
        """Send a person away; their token is worth nothing from then on."""
        self._change(lambda session, now_ns: session.remove(person_id, now_ns))

    def hide_behind(self, cells: Mapping[Cell, CollisionMesh]) -> None:
        """Let surfaces hide what is behind them for everybody: cells that changed, world metres."""
        self._change(lambda session, _now_ns: session.mesh.take(cells))

    def _change(self, change: Callable[[Session, int], T]) -> T:
        with self._session.lock:
            self._take_newest()  # a change is of what everybody has seen
            found = change(self._session, self._clock.now_ns())
        self._peers.wake_soon()
        return found

    def counts(self) -> HubCounts:
        """Return figures since the start."""
        with self._session.lock:
            sent, refused = self._session.sent, dict(self._session.refused)
            return HubCounts(sent.bytes, sent.messages, sent.dropped, refused)

    async def _run(self, listening: Future[int]) -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._say_defect)
        self._ending = asyncio.Event()
        site = Site(
            self._session,
            self._assets,
            clock=self._clock,
            is_own_host=lambda host: is_loopback(host) or host in self._names,
            talk=self._talk,
            root_pem=self.root_pem,
            say=self._say,
        )
        # Messages of strangers are no lines of a log.
        silent = logging.Logger("hub")
        silent.disabled = True
        server = web.Server(site.answer, access_log=None, logger=silent, keepalive_timeout=IDLE_S)
        tls = None if self._certificates is None else tls_of(self._certificates)
        port = Port(server, tls)
        self._port = port.open(self._settings.host, self._settings.port)
        self._peers.loop = loop
        listening.set_result(self._port)
        self._say(f"people: the hub listens at {self.url}")
        looking = asyncio.ensure_future(self._look_for_states())
        await self._keep_time()
        looking.cancel()
        await port.close()
        with self._session.lock:
            self._session.end()
        self._peers.wake()
        deadline = loop.time() + GOODBYE_S
        while self._peers.connections and loop.time() < deadline:
            await asyncio.sleep(0.01)
        await server.shutdown(GOODBYE_S)

    async def _keep_time(self) -> None:
        """Look after connections until the hub ends."""
        assert self._ending is not None
        while not self._ending.is_set():
            now_ns = self._clock.now_ns()
            self._try(lambda at=now_ns: self._look_around(at))
            with suppress(TimeoutError):
                async with asyncio.timeout(TICK_S):
                    await self._ending.wait()

    def _look_around(self, now_ns: int) -> None:
        with self._session.lock:
            self._session.tick(now_ns)
        for connection in list(self._peers.connections):
            connection.check(now_ns)
        self._peers.wake()

    def _try(self, call: Callable[[], None]) -> None:
        """Do something again and again, of which one time may fail: the others count."""
        try:
            call()
        except Exception as error:  # noqa: BLE001 - a defect, said; people stay connected
            self._say(defect_line(error))

    async def _look_for_states(self) -> None:
        while True:
            self._try(self._publish)
            self._try(self._look_at_voices)
            await asyncio.sleep(LOOK_S if self._peers.connections else IDLE_LOOK_S)

    async def _talk(self, request: web.BaseRequest, address: str) -> web.StreamResponse:
        if not web.WebSocketResponse().can_prepare(request):
            return web.Response(status=426, text="a WebSocket", headers=HEADERS)
        self._try(self._publish)
        connection = Connection(self._session, clock=self._clock, peers=self._peers)
        self._peers.connections.add(connection)
        try:
            return await connection.serve(request, address)
        finally:
            self._peers.connections.discard(connection)

    def _publish(self) -> None:
        if self._newest is not None:
            self._change(lambda _session, _now_ns: None)

    def _take_newest(self) -> None:
        """Hand the newest state to the session, whose lock is held."""
        state, self._newest = self._newest, None
        if state is not None:
            self._session.publish(state)

    def _look_at_voices(self) -> None:
        with self._session.lock:
            has_changed = self._session.tell_speaking(self._clock.now_ns())
        if has_changed:
            self._peers.wake()

    def _say_defect(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self._say(defect_line(context.get("exception"), otherwise=str(context.get("message"))))
