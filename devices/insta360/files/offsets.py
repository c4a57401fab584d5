"""Calibration strings of Insta360 lenses, versions 1 to 3: read and written.

A string is numbers joined by `_`: how many lenses, the numbers of each lens, and what follows them.
Pixels are on a canvas of one square a lens, side by side: the second lens's `cx_px` is one square
further right. Angles are degrees, translations metres from the first lens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TypeVar

MAX_TEXT = 4096
"""Characters of a string. Version 3 of two lenses has about 370."""

MAX_LENSES = 8
"""Lenses of one camera; the vendor's largest has eight."""


class OffsetError(ValueError):
    """A calibration string that cannot be used: says what is wrong with it."""


@dataclass(frozen=True, slots=True)
class LensV1:
    """Equidistant circle: `radius_px` is reached about 96° off the axis.

    Attributes:
        radius_px: of the picture's circle.
        cx_px, cy_px: its centre.
        yaw_deg, pitch_deg, roll_deg: how the lens is turned.
    """

    radius_px: float
    cx_px: float
    cy_px: float
    yaw_deg: float
    pitch_deg: float
    roll_deg: float


@dataclass(frozen=True, slots=True)
class LensV2:
    """A polynomial of the angle off the axis, `c1` to `c4`, scaled to a circle's radius.

    Attributes:
        radius_px: of the picture's circle.
        cx_px, cy_px: its centre.
        yaw_deg, pitch_deg, roll_deg: how the lens is turned.
        tx_m, ty_m, tz_m: where it is.
        c1, c2, c3, c4: coefficients.
        width_px, height_px: of the canvas.
        lens_type: the vendor's number.
    """

    radius_px: float
    cx_px: float
    cy_px: float
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    tx_m: float
    ty_m: float
    tz_m: float
    c1: float
    c2: float
    c3: float
    c4: float
    width_px: int
    height_px: int
    lens_type: int


@dataclass(frozen=True, slots=True)
class LensV3:
    """Unified sphere with radial and tangential distortion.

    A unit ray (x, y, z) is at m = (x, y) / (z + xi), distorted by the radial factor
    1 + k1 r² + k2 r⁴ + k3 r⁶ (r = |m|) and by p1, p2, then at pixel f · m + c.

    Attributes:
        xi: distance of the second projection centre from the sphere's.
        fx_px, fy_px: focal lengths.
        cx_px, cy_px: principal point.
        yaw_deg, pitch_deg, roll_deg: how the lens is turned.
        tx_m, ty_m, tz_m: where it is.
        k1, k2, k3: radial distortion.
        p1, p2: tangential distortion.
        width_px, height_px: of the canvas.
        lens_type: the vendor's number.
    """

    xi: float
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    tx_m: float
    ty_m: float
    tz_m: float
    k1: float
    k2: float
    k3: float
    p1: float
    p2: float
    width_px: int
    height_px: int
    lens_type: int


@dataclass(frozen=True, slots=True)
class OffsetsV1:
    """Version 1: canvas size and lens type are the camera's, not a lens's."""

    lenses: tuple[LensV1, ...]
    width_px: int
    height_px: int
    lens_type: int


@dataclass(frozen=True, slots=True)
class OffsetsV2:
    """Version 2; `flag` is the vendor's number at the end, or None."""

    lenses: tuple[LensV2, ...]
    flag: int | None


@dataclass(frozen=True, slots=True)
class OffsetsV3:
    """Version 3; `flag` is the vendor's number at the end, or None."""

    lenses: tuple[LensV3, ...]
    flag: int | None


Offsets = OffsetsV1 | OffsetsV2 | OffsetsV3
_Lens = TypeVar("_Lens", LensV1, LensV2, LensV3)


def read_offsets(text: str) -> Offsets:
    """A calibration string of any version; the version follows from how many numbers there are.

    Raises:
        OffsetError: too long, no number where one belongs, an unknown count, a size that is not
            positive.
    """
    if len(text) > MAX_TEXT:
        raise OffsetError(f"calibration of {len(text)} characters, at most {MAX_TEXT}")
    words = text.strip().split("_")
    count = _whole(words, 0)
    if not 1 <= count <= MAX_LENSES:
        raise OffsetError(f"calibration of {count} lenses, wanted 1 to {MAX_LENSES}")
    v1, v2, v3 = (len(fields(kind)) for kind in (LensV1, LensV2, LensV3))
    rest = len(words) - 1
    if rest == count * v1 + 3:
        lenses = tuple(_lens(LensV1, words, 1 + i * v1) for i in range(count))
        end = 1 + count * v1
        return OffsetsV1(lenses, _size(words, end), _size(words, end + 1), _whole(words, end + 2))
    if rest in (count * v2, count * v2 + 1):
        flag = _whole(words, rest) if rest > count * v2 else None
        return OffsetsV2(tuple(_lens(LensV2, words, 1 + i * v2) for i in range(count)), flag)
    if rest in (count * v3, count * v3 + 1):
        flag = _whole(words, rest) if rest > count * v3 else None
        return OffsetsV3(tuple(_lens(LensV3, words, 1 + i * v3) for i in range(count)), flag)
    raise OffsetError(
        f"calibration of {count} lenses with {rest} numbers after the count; known are "
        f"{count * v1 + 3} (version 1), {count * v2 + 1} (2) and {count * v3 + 1} (3)"
    )


def write_offsets(offsets: Offsets) -> str:
    """Inverse of `read_offsets`: as many decimals as the vendor writes, more where they are needed.

    Raises:
        OffsetError: a number is not finite, or there are too many lenses.
    """
    if not 1 <= len(offsets.lenses) <= MAX_LENSES:
        raise OffsetError(f"{len(offsets.lenses)} lenses, wanted 1 to {MAX_LENSES}")
    words = [str(len(offsets.lenses))]
    for lens in offsets.lenses:
        words += [_word(field.name, getattr(lens, field.name)) for field in fields(lens)]
    if isinstance(offsets, OffsetsV1):
        words += [str(offsets.width_px), str(offsets.height_px), str(offsets.lens_type)]
    elif offsets.flag is not None:
        words.append(str(offsets.flag))
    return "_".join(words)


def _lens(kind: type[_Lens], words: list[str], at: int) -> _Lens:
    values: list[float | int] = []
    for index, field in enumerate(fields(kind), at):
        if field.name in ("width_px", "height_px"):
            values.append(_size(words, index))
        elif field.name == "lens_type":
            values.append(_whole(words, index))
        else:
            values.append(_real(words, index))
    return kind(*values)  # pyright: ignore[reportArgumentType] - the types follow from the names


def _real(words: list[str], index: int) -> float:
    try:
        value = float(words[index])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise OffsetError(f"calibration: number {index} is {words[index][:20]!r}")
    return value


def _whole(words: list[str], index: int) -> int:
    word = words[index].strip()
    digits = word.removeprefix("-")
    if not digits.isascii() or not digits.isdigit() or len(digits) > 18:
        raise OffsetError(f"calibration: number {index} is {word[:20]!r}, wanted a whole one")
    return int(word)


def _size(words: list[str], index: int) -> int:
    value = _whole(words, index)
    if not 1 <= value <= 1_000_000:
        raise OffsetError(f"calibration: size {value} px (number {index}), wanted 1 to 1000000")
    return value


def _word(name: str, value: float) -> str:
    """`value` with the vendor's decimals, or with all it needs."""
    if not math.isfinite(value):
        raise OffsetError(f"calibration: {name} is {value}, wanted a finite number")
    if name in ("width_px", "height_px", "lens_type"):
        return str(value)
    decimals = 3 if name.endswith(("_px", "_deg")) else 6 if name == "xi" or "_m" in name else 8
    word = f"{value:.{decimals}f}"
    return word if float(word) == value else repr(float(value))
