"""Pictures that a simulated camera sends: with their times, paced, or a test pattern."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class FedPicture:
    """One picture of a simulated camera.

    Attributes:
        t_ns: when it was taken, from any origin.
        rgb: (H, W, 3) uint8, both lenses side by side.
    """

    t_ns: int
    rgb: Picture


def paced(pictures: Iterable[FedPicture], clock: Clock) -> Iterator[FedPicture]:
    """The same pictures, each not before its time after the first."""
    start_ns: int | None = None
    for picture in pictures:
        if start_ns is None:
            start_ns = clock.now_ns() - picture.t_ns
        clock.sleep_until(start_ns + picture.t_ns)
        yield picture


def numbered_pictures(
    size_px: tuple[int, int], fps: float, *, count: int | None = None
) -> Iterator[FedPicture]:
    """Two lens circles side by side with a moving bar, and the picture's number in squares.

    Args:
        size_px: width and height.
        fps: pictures a second.
        count: how many; None for no end.
    """
    ground = _two_circles(size_px)
    number = 0
    while count is None or number < count:
        picture = ground.copy()
        bar = number * 8 % size_px[0]
        picture[:, bar : bar + 8] = 255
        draw_number(picture, number)
        yield FedPicture(round(number * 1e9 / fps), picture)
        number += 1


NUMBER_BITS = 20
"""Bits of a picture's number that are drawn: more than nine hours at 30 Hz."""


def draw_number(picture: Picture, number: int) -> None:
    """Write a picture's number into its top row of squares, black or white; changes `picture`."""
    side = _square_px(picture.shape[1])
    for bit in range(NUMBER_BITS):
        value = 235 if number >> bit & 1 else 20
        picture[:side, bit * side : (bit + 1) * side] = value


def read_number(luma: Picture) -> int:
    """The number that `draw_number` wrote, from a picture's Y plane (H, W)."""
    side = _square_px(luma.shape[1])
    row = luma[side // 2]
    return sum((int(row[bit * side + side // 2]) > 127) << bit for bit in range(NUMBER_BITS))


def _square_px(width_px: int) -> int:
    """Side of a square: whole macroblocks where there is room."""
    return max(4, width_px // (2 * NUMBER_BITS))


def _two_circles(size_px: tuple[int, int]) -> Picture:
    width, height = size_px
    picture = np.zeros((height, width, 3), np.uint8)
    for lens in range(2):
        centre = (width * (2 * lens + 1) // 4, height // 2)
        radius = min(width // 4, height // 2)
        cv2.circle(picture, centre, radius, (90 + 60 * lens, 120, 160 - 60 * lens), -1)
        cv2.circle(picture, centre, radius // 3, (200, 180, 60), -1)
    return picture
