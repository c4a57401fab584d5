"""The process of media: WebRTC with everybody, apart from the hub, which does not wait for it.

`python -m devices.hub.media.process ADDRESS…` listens at these addresses alone, reads orders from
its standard input and ends with it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from io import BufferedIOBase
from typing import Any, cast

from devices.hub.media import frames
from devices.hub.media.floor import Floor
from devices.hub.media.peers import Peer
from devices.hub.media.pictures import SurfaceVideo
from devices.hub.media.signals import VIDEOS
from devices.hub.media.voice_wire import Voice
from scenes.workers.task import Task

REPEAT_S = 1.0
"""Time after which a picture that has not changed is sent again: whoever lost it gets it so."""

TICK_S = 0.25
"""Time between looks at what is due."""


class MediaProcess:
    """Everybody's connections, and what goes between them; on one loop.

    Args:
        send: writes a frame to the hub.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._peers: dict[int, Peer] = {}
        self._speakers: set[int] = set()
        self._floor = Floor()
        self._told: dict[str, Any] = {}
        self._videos: list[str | None] = [None] * VIDEOS
        self._encoders: dict[str, SurfaceVideo] = {}
        self._newest: dict[str, tuple[bytes, float]] = {}
        self._encoding: set[str] = set()
        self._works: set[asyncio.Task[None]] = set()

    def take(self, kind: int, data: bytes) -> None:
        """Do what the hub asks for."""
        if kind == frames.VOICE:
            self.hear(*frames.read_voice(data))
        elif kind == frames.PICTURE:
            surface_id, jpeg = frames.read_picture(data)
            self._show(surface_id, jpeg)
        else:
            self._obey(frames.read_order(data))

    def hear(self, index: int, voice: Voice) -> None:
        """Send a moment of somebody's voice to everybody else."""
        place = self._floor.take(index, level_db=voice.level_db, now_ns=time.monotonic_ns())
        if place is None:
            return
        for peer in self._peers.values():
            if peer.index != index and peer.is_connected:
                peer.voices[place].put(index, voice)
        self._tell_places()

    async def keep_time(self) -> None:
        """Repeat pictures that rest, until it is cancelled."""
        while True:
            await asyncio.sleep(TICK_S)
            now_s = time.monotonic()
            for surface_id, (jpeg, shown_s) in list(self._newest.items()):
                if now_s - shown_s > REPEAT_S:
                    self._show(surface_id, jpeg)

    def _obey(self, order: dict[str, Any]) -> None:
        match order.get("do"):
            case "offer":
                self._begin(self._answer(order))
            case "close":
                self._speakers.discard(int(order["person"]))
                self._floor.drop(int(order["person"]))
                self._begin(self._close(int(order["person"])))
            case "speaks":
                self._allow(int(order["person"]), may_speak=bool(order["may"]))
            case "surfaces":
                self._keep([str(name) for name in order["ids"]])
            case _:
                return

    def _allow(self, index: int, *, may_speak: bool) -> None:
        if may_speak:
            self._speakers.add(index)
        else:
            self._speakers.discard(index)
            self._floor.drop(index)

    async def _answer(self, order: dict[str, Any]) -> None:
        index, number = int(order["person"]), int(order["number"])
        await self._close(index)
        self._allow(index, may_speak=bool(order["may"]))
        peer = Peer(
            index,
            on_voice=self._hear_peer,
            wants_whole=self._want_whole,
            changed=lambda state: self._say_state(state, index=index, number=number),
        )
        self._peers[index] = peer
        said: dict[str, Any] = {"say": "answer", "person": index, "number": number}
        try:
            said["sdp"] = await peer.answer(str(order["sdp"]), str(order["address"]))
        except Exception as error:  # noqa: BLE001 - whatever an offer does to the library
            said["why"] = f"{type(error).__name__}: {error}"[:200]
            await self._close(index)
        self._send(frames.pack_order(said))

    async def _close(self, index: int) -> None:
        peer = self._peers.pop(index, None)
        if peer is not None:
            with suppress(Exception):
                await peer.close()

    def _hear_peer(self, index: int, voice: Voice) -> None:
        if index in self._speakers:
            self._send(frames.pack_voice(index, voice))
            self.hear(index, voice)

    def _say_state(self, state: str, *, index: int, number: int) -> None:
        report = {"say": "state", "person": index, "number": number, "state": state}
        self._send(frames.pack_order(report))
        if state == "connected":
            for encoder in self._encoders.values():
                encoder.want_whole()

    def _tell_places(self) -> None:
        places = {"voices": list(self._floor.owners()), "videos": list(self._videos)}
        if places != self._told:
            self._told = places
            self._send(frames.pack_order({"say": "places", **places}))

    def _keep(self, surface_ids: Sequence[str]) -> None:
        """Give surfaces videos; those that have one keep it."""
        there = set(surface_ids)
        for gone in self._encoders.keys() - there:
            del self._encoders[gone]
            self._newest.pop(gone, None)
        self._videos = [name if name in there else None for name in self._videos]
        for surface_id in surface_ids:
            if surface_id not in self._videos and None in self._videos:
                number = self._videos.index(None)
                self._videos[number] = surface_id
                self._encoders[surface_id] = SurfaceVideo()
                for peer in self._peers.values():
                    peer.videos[number].begin()
        self._tell_places()

    def _want_whole(self, number: int) -> None:
        surface_id = self._videos[number] if 0 <= number < VIDEOS else None
        if surface_id is not None and surface_id in self._encoders:
            self._encoders[surface_id].want_whole()

    def _show(self, surface_id: str, jpeg: bytes) -> None:
        encoder = self._encoders.get(surface_id)
        if encoder is None:
            return
        self._newest[surface_id] = (jpeg, time.monotonic())
        is_seen = any(peer.is_connected for peer in self._peers.values())
        if is_seen and surface_id not in self._encoding:  # else the next one is newer
            self._encoding.add(surface_id)
            self._begin(self._encode(surface_id, jpeg, encoder=encoder))

    async def _encode(self, surface_id: str, jpeg: bytes, *, encoder: SurfaceVideo) -> None:
        loop = asyncio.get_running_loop()
        try:
            data, pts, is_whole = await loop.run_in_executor(
                None, encoder.encode, jpeg, time.monotonic_ns()
            )
        finally:
            self._encoding.discard(surface_id)
        if surface_id not in self._videos:
            return
        number = self._videos.index(surface_id)
        for peer in self._peers.values():
            if peer.is_connected and data:
                peer.videos[number].put(data, pts, is_whole=is_whole)

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._works.add(task)
        task.add_done_callback(self._works.discard)


async def run(
    source: BufferedIOBase, send: Callable[[bytes], None], *, addresses: Sequence[str]
) -> None:
    """Serve until the source ends.

    Args:
        source: orders.
        send: writes a frame to the hub; on any thread.
        addresses: of this machine, at which connections are taken.
    """
    _listen_at(addresses)
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(lambda _loop, _context: None)
    media = MediaProcess(send)
    over = asyncio.Event()

    def read(_task: Task[None]) -> None:
        try:
            for kind, data in frames.read_frames(source):
                loop.call_soon_threadsafe(media.take, kind, data)
        finally:
            loop.call_soon_threadsafe(over.set)

    Task("orders", read).start()
    send(frames.pack_order({"say": "ready"}))
    keeping = asyncio.ensure_future(media.keep_time())
    await over.wait()
    keeping.cancel()


def _listen_at(addresses: Sequence[str]) -> None:
    """Let the library know no address of this machine but these."""
    from aioice import ice

    def known(use_ipv4: bool, use_ipv6: bool) -> list[str]:
        return [each for each in addresses if (use_ipv6 if ":" in each else use_ipv4)]

    cast(Any, ice).get_host_addresses = known


def main(addresses: Sequence[str]) -> None:
    """Serve over the standard streams until the hub is gone."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever prints does not print between frames
    logging.disable(logging.CRITICAL)  # what strangers send is no line of a log

    def send(data: bytes) -> None:
        out.write(data)

    with suppress(KeyboardInterrupt, BrokenPipeError):
        asyncio.run(run(cast(BufferedIOBase, sys.stdin.buffer), send, addresses=addresses))
    os._exit(0)  # threads of the library's may still wait


if __name__ == "__main__":
    main(sys.argv[1:])
