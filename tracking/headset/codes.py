"""Printed codes in one picture of a headset, with corners to hundredths of a pixel."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.align.codes.anchors import Sighting, april_tags, measure_code, qr_codes
from scenes.prepare.align.codes.symbols import TAG_PREFIX, Symbol

Floats = NDArray[np.float64]

READ_EVERY = 8
"""Pictures between two that are read whole while a code is found where it is expected; chosen: a
code that comes into sight, or was moved, waits for a second, and reading takes 20 ms."""

MAX_SYMBOLS = 256
"""Codes whose pattern is kept, chosen: a room has some."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenCode:
    """A code in one picture.

    Attributes:
        payload: what it says.
        corners_px: (4, 2) top left, top right, bottom right, bottom left as printed.
        sigma_px: (4,) standard deviation of each corner along either axis.
    """

    payload: str
    corners_px: Floats
    sigma_px: Floats


class CodeReader:
    """Finds the wanted codes in one picture after another.

    Args:
        wanted: what they say; others are left alone.
    """

    def __init__(self, wanted: frozenset[str]) -> None:
        self._wanted = wanted
        are_tags = {payload.startswith(TAG_PREFIX) for payload in wanted}
        self._has_tags, self._has_others = True in are_tags, False in are_tags
        self._symbols: dict[str, Symbol] = {}
        self._since_read = READ_EVERY

    def find(self, grey: NDArray[np.uint8], expected: Mapping[str, Floats]) -> list[SeenCode]:
        """Return the codes in a picture.

        Args:
            grey: (H, W) luminance.
            expected: (4, 2) px by payload, where codes should be.
        """
        found: dict[str, SeenCode] = {}
        for payload, corners_px in expected.items():
            symbol = self._symbols.get(payload)
            if symbol is not None:
                seen = _measured(grey, symbol, start_px=corners_px, was_read=False)
                if seen is not None:
                    found[payload] = seen
        self._since_read += 1
        if self._since_read >= READ_EVERY or not found:
            self._since_read = 0
            for seen in self._read(grey, found.keys()):
                found[seen.payload] = seen
        return list(found.values())

    def _read(self, grey: NDArray[np.uint8], known: Container[str]) -> list[SeenCode]:
        """Read the picture; return what is wanted and is there once."""
        # To look for tags takes three times as long as to read what is printed otherwise.
        candidates = [
            *(qr_codes(grey) if self._has_others else ()),
            *(april_tags(grey) if self._has_tags else ()),
        ]
        said = [candidate.payload for candidate in candidates]
        found: list[SeenCode] = []
        for candidate in candidates:
            payload, symbol = candidate.payload, candidate.symbol
            if payload not in self._wanted or symbol is None or said.count(payload) > 1:
                continue
            if payload in known:
                continue
            if payload in self._symbols or len(self._symbols) < MAX_SYMBOLS:
                self._symbols[payload] = symbol
            seen = _measured(grey, symbol, start_px=candidate.corners_px, was_read=True)
            if seen is not None:
                found.append(seen)
        return found


def _measured(
    grey: NDArray[np.uint8], symbol: Symbol, *, start_px: Floats, was_read: bool
) -> SeenCode | None:
    """Return a code whose corners could be measured."""
    # Where a code is expected an eighth of a second later is right to millimetres.
    outcome = measure_code(
        "picture", grey, symbol, start_px, was_read=was_read, is_close=not was_read
    )
    if not isinstance(outcome, Sighting):
        return None
    moved = float(np.linalg.norm(outcome.corners_px - start_px, axis=1).max())
    side = float(np.linalg.norm(start_px - np.roll(start_px, 1, axis=0), axis=1).mean())
    if not was_read and moved > max(2.0, 1.5 * side / symbol.modules):
        return None
    return SeenCode(symbol.payload, outcome.corners_px, outcome.sigma_px)
