"""Codes of six digits that let one person in, and how guessing them is stopped."""

from __future__ import annotations

import hmac
import secrets
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from devices.hub.roles import Role

CODE_DIGITS = 6
"""Digits of a code; chosen: said aloud and typed in a headset without a mistake."""

CODE_NS = 120 * 10**9
"""Life of a code, two minutes; chosen: time to put a headset on."""

MAX_CODES = 16
"""Codes that are good at the same time: each more makes a guess likelier to hit."""

MAX_WRONG, MAX_WRONG_IN_ALL = 5, 30
"""Wrong codes within `WINDOW_NS` from an address, and from all: at most 30 × 2 min × 16 / 10^6 =
0.1 % of attacks hit a code, with all codes given out all the time."""

WINDOW_NS = 60 * 10**9
"""Time over which wrong codes are counted, and for which an address is refused afterwards."""

MAX_ADDRESSES = 1024
"""Addresses that are remembered; the one that was wrong longest ago is forgotten first."""


class PairingRefused(Exception):
    """A code is not accepted; says why, and never the code.

    Args:
        why: in words for the person.
        status: of HTTP.
        kind: under which it is counted.
    """

    def __init__(self, why: str, *, status: int, kind: str) -> None:
        super().__init__(why)
        self.status, self.kind = status, kind


@dataclass(slots=True)
class _Misses:
    """Times of wrong codes."""

    times_ns: deque[int]
    locked_until_ns: int = 0


@dataclass(frozen=True, slots=True)
class _Code:
    role: Role
    expires_ns: int


@dataclass(slots=True)
class PairingCodes:
    """Codes that are good now.

    Attributes:
        random_below: a number of 0 … n - 1 that nobody can foretell.
    """

    random_below: Callable[[int], int] = secrets.randbelow
    _codes: dict[str, _Code] = field(default_factory=dict[str, _Code])
    _by_address: OrderedDict[str, _Misses] = field(default_factory=OrderedDict[str, _Misses])
    _in_all: _Misses = field(default_factory=lambda: _Misses(deque(maxlen=MAX_WRONG_IN_ALL)))

    def make(self, role: Role, now_ns: int) -> tuple[str, int]:
        """Return a new code and until when it is good; the oldest goes where there are too many."""
        self._forget_expired(now_ns)
        while len(self._codes) >= MAX_CODES:
            del self._codes[next(iter(self._codes))]
        code = self._draw()
        while code in self._codes:
            code = self._draw()
        self._codes[code] = _Code(role, now_ns + CODE_NS)
        return code, now_ns + CODE_NS

    def revoke(self, code: str) -> None:
        """Let a code be worth nothing; one that is not there is none already."""
        self._codes.pop(code, None)

    def redeem(self, code: str, *, address: str, now_ns: int) -> Role:
        """Use a code up; return the role that it was made for.

        Raises:
            PairingRefused: it is wrong, used or expired, or too many wrong ones came before.
        """
        self._forget_expired(now_ns)
        misses = self._by_address.get(address)
        for known in (self._in_all, misses):
            if known is not None and now_ns < known.locked_until_ns:
                wait_s = -(-(known.locked_until_ns - now_ns) // 10**9)
                raise PairingRefused(
                    f"too many wrong codes, try again in {wait_s} s", status=429, kind="guessing"
                )
        given = code.encode("utf-8", "replace")
        found: str | None = None
        for known_code in self._codes:  # all of them, each in constant time
            if hmac.compare_digest(known_code.encode(), given):
                found = known_code
        if found is None:
            self._miss(address, now_ns)
            raise PairingRefused(
                "the code is wrong, used or older than two minutes", status=403, kind="code"
            )
        self._by_address.pop(address, None)
        return self._codes.pop(found).role

    def _draw(self) -> str:
        return f"{self.random_below(10**CODE_DIGITS):0{CODE_DIGITS}d}"

    def _forget_expired(self, now_ns: int) -> None:
        for code in [c for c, known in self._codes.items() if known.expires_ns <= now_ns]:
            del self._codes[code]

    def _miss(self, address: str, now_ns: int) -> None:
        misses = self._by_address.pop(address, None) or _Misses(deque(maxlen=MAX_WRONG))
        self._by_address[address] = misses
        while len(self._by_address) > MAX_ADDRESSES:
            self._by_address.popitem(last=False)
        for counted in (misses, self._in_all):
            counted.times_ns.append(now_ns)
            is_full = len(counted.times_ns) == counted.times_ns.maxlen
            if is_full and now_ns - counted.times_ns[0] < WINDOW_NS:
                counted.locked_until_ns = now_ns + WINDOW_NS
                counted.times_ns.clear()
