"""Download of a room as the page does it: first what it is recognised by, then the rest."""

from __future__ import annotations

import json
from typing import Any, cast

import aiohttp

from sim.headset.connection import ANSWER_S, HubAddress, HubRefusedError

MANIFEST = "manifest.json"
"""File that names the others."""

CHUNK_BYTES = 64 * 1024
"""Bytes of a file that are read at a time; nothing of it is kept."""

MAX_MANIFEST_BYTES = 4 * 1024 * 1024
"""Longest manifest that is taken: some thousand objects."""

MAX_FILE_S = 60.0
"""Longest time for one file."""

FIRST, WHOLE = "first_part", "room_part"
"""Keys of the thinned room and of the whole one; None in place of a name where there is none."""


class RoomDownload:
    """Files of one room for one person.

    Args:
        http: of `HubAddress.opened`.
        address: of the hub.

    Attributes:
        received_bytes: of all files so far.
    """

    def __init__(self, http: aiohttp.ClientSession, address: HubAddress) -> None:
        self.received_bytes = 0
        self._http, self._address = http, address
        self._manifest: dict[str, Any] = {}

    async def fetch_first(self, token: str) -> bool:
        """Fetch manifest and thinned room; return whether the hub has a room to give.

        Raises:
            HubRefusedError: the token is not accepted, or a file is missing.
            aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
        """
        data = await self._fetch(MANIFEST, token, keeps=MAX_MANIFEST_BYTES)
        if data is None:
            return False
        self._manifest = cast(dict[str, Any], json.loads(data))
        await self._fetch_part(self._manifest.get(FIRST), token)
        return True

    async def fetch_rest(self, token: str) -> None:
        """Fetch objects, their shadows and the whole room.

        Raises:
            As `fetch_first`.
        """
        for item in self._manifest.get("objects", ()):
            await self._fetch_part(item.get("part"), token)
            await self._fetch_part(item.get("shadow_part"), token)
        await self._fetch_part(self._manifest.get(WHOLE), token)

    async def _fetch_part(self, part: str | None, token: str) -> None:
        if part is not None and await self._fetch(f"{part}.spz", token) is None:
            raise HubRefusedError(f"{part}.spz: the hub does not have it", status=404)

    async def _fetch(self, name: str, token: str, *, keeps: int = 0) -> bytes | None:
        """Return the begin of a file; None where the hub does not have it."""
        headers = {"Authorization": f"Bearer {token}"}
        limit = aiohttp.ClientTimeout(total=MAX_FILE_S, sock_connect=ANSWER_S)
        url = self._address.at(f"/assets/room/{name}")
        async with self._http.get(url, headers=headers, timeout=limit) as answer:
            if answer.status == 404:
                return None
            if answer.status != 200:
                raise HubRefusedError(f"{name}: HTTP {answer.status}", status=answer.status)
            kept = bytearray()
            async for chunk in answer.content.iter_chunked(CHUNK_BYTES):
                self.received_bytes += len(chunk)
                if len(kept) < keeps:
                    kept += chunk
            return bytes(kept[:keeps])
