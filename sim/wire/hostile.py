"""Hostile bytes by seed: noise, damaged, cut, repeated and spliced packets, lengths that lie.

The same seed gives the same bytes. They are for tests of whatever reads from a network or a file:
it must refuse or read them, never fail otherwise, and never take memory that the bytes did not
bring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from random import Random
from typing import NamedTuple

LONGEST_NOISE = 256
"""Bytes of noise that are made at a time."""

LONGEST_INPUT = 1 << 14
"""Limit of one hostile input, bytes."""

_LENGTHS = (0, 1, 3, 6, 7, 8, 0xFF, 0x7FFF, 0xFFFF, 1 << 20, 1 << 22, (1 << 22) + 1)
"""Lengths at the limits of formats and of what is received."""

_LIES = (*_LENGTHS, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)
"""Lengths where a 32-bit field is damaged: small ones, limits, and the largest."""


class _Input(NamedTuple):
    """Bytes that are to be damaged, and all that a friendly device sends."""

    data: bytes
    valid: Sequence[bytes]


def hostile_bytes(seed: int, valid: Sequence[bytes]) -> bytes:
    """One hostile input.

    Args:
        seed: which one.
        valid: what a friendly device sends, at least one; most inputs are damaged copies.
    """
    random = Random(seed)
    made = random.choice(valid)
    for _round in range(random.choice((1, 1, 1, 2, 3))):
        made = random.choice(_DAMAGES)(random, _Input(made, valid))
    return made[:LONGEST_INPUT]


def hostile_stream(seed: int, valid: Sequence[bytes]) -> Iterator[bytes]:
    """One hostile peer: what it sends, in pieces of any size."""
    random = Random(seed)
    whole = b"".join(
        random.choice(valid)
        if random.random() < 0.5
        else hostile_bytes(random.getrandbits(32), valid)
        for _part in range(random.randint(1, 6))
    )
    at = 0
    while at < len(whole):
        size = random.choice((1, 2, 3, 5, 17, 100, 1000, len(whole)))
        yield whole[at : at + size]
        at += size


def _noise(random: Random, made: _Input) -> bytes:
    return random.randbytes(random.randint(0, LONGEST_NOISE))


def _changed(random: Random, made: _Input) -> bytes:
    """Some bytes are others."""
    out = bytearray(made.data)
    for _byte in range(random.randint(1, 8) if out else 0):
        out[random.randrange(len(out))] = random.choice(
            (0, 1, 0x7F, 0x80, 0xFF, random.getrandbits(8))
        )
    return bytes(out)


def _cut(random: Random, made: _Input) -> bytes:
    at = random.randint(0, len(made.data))
    return made.data[:at] if random.random() < 0.7 else made.data[at:]


def _spliced(random: Random, made: _Input) -> bytes:
    other = random.choice(made.valid)
    return made.data[: random.randint(0, len(made.data))] + other[random.randint(0, len(other)) :]


def _repeated(random: Random, made: _Input) -> bytes:
    begin = random.randint(0, len(made.data))
    piece = made.data[begin : begin + random.randint(1, 64)]
    return made.data[:begin] + piece * random.randint(2, 40) + made.data[begin:]


def _lied(random: Random, made: _Input) -> bytes:
    """Four bytes somewhere, often at the beginning or the end, are a length that is not true."""
    at = random.choice((0, 0, max(0, len(made.data) - 40), random.randint(0, len(made.data))))
    lie = random.choice(_LIES).to_bytes(4, "little")
    return made.data[:at] + lie + made.data[at + 4 :]


def _grown(random: Random, made: _Input) -> bytes:
    at = random.randint(0, len(made.data))
    return made.data[:at] + random.randbytes(random.randint(1, 32)) + made.data[at:]


def _flat(random: Random, made: _Input) -> bytes:
    return bytes([random.choice((0, 0x0A, 0x20, 0x5B, 0x7B, 0x80, 0xFF))]) * (len(made.data) % 600)


_DAMAGES: tuple[Callable[[Random, _Input], bytes], ...] = (
    _noise,
    _changed,
    _changed,
    _cut,
    _spliced,
    _repeated,
    _lied,
    _lied,
    _grown,
    _flat,
)
