"""Faults of the light that a camera takes in: exposure, white balance, blur."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.faults.fault import LightFault, Picture, Span, read_span
from sim.tables import Table


def with_gains(pictures: Sequence[Picture], gains: ArrayLike) -> tuple[Picture, ...]:
    """The pictures (H, W, 3) with red, green and blue light times `gains` (3,), clipped."""
    curve = gain_curve(gains)
    return tuple(np.asarray(cv2.LUT(picture, curve), np.uint8) for picture in pictures)


def gain_curve(gains: ArrayLike) -> NDArray[np.uint8]:
    """(256, 1, 3) sRGB levels after linear light is multiplied by `gains` (3,)."""
    levels = np.arange(256) / 255.0
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    lit = np.clip(linear[:, None] * np.asarray(gains, dtype=np.float64), 0.0, 1.0)
    srgb = np.where(lit <= 0.0031308, 12.92 * lit, 1.055 * lit ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * srgb).astype(np.uint8).reshape(256, 1, 3)


@dataclass(frozen=True, slots=True)
class Exposure(LightFault):
    """Brighter or darker pictures.

    Attributes:
        ev: steps of exposure; +1 is twice the light.
        span: when.
    """

    name: ClassVar[str] = "exposure"
    sizes: ClassVar[Mapping[str, str]] = {"ev": "EV"}

    ev: float
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(table.number("ev", low=-4.0, high=4.0), read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.ev if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the exposure is off by {self.ev:+g} EV"

    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """See `LightFault.seen`."""
        del t_s
        return with_gains(pictures, [2.0**self.ev] * 3)


@dataclass(frozen=True, slots=True)
class WhiteBalance(LightFault):
    """Redder or bluer pictures.

    Attributes:
        warmth: red light is multiplied by 1 + `warmth`, blue divided by it; below 0 it is colder.
        span: when.
    """

    name: ClassVar[str] = "white_balance"
    sizes: ClassVar[Mapping[str, str]] = {"warmth": "share"}

    warmth: float
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(table.number("warmth", low=-0.6, high=1.5), read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.warmth if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the white balance is off by {self.warmth:+.0%} red"

    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """See `LightFault.seen`."""
        del t_s
        return with_gains(pictures, [1.0 + self.warmth, 1.0, 1.0 / (1.0 + self.warmth)])


BLURS = ("defocus", "motion")


@dataclass(frozen=True, slots=True)
class Blur(LightFault):
    """Every lens picture is blurred.

    Attributes:
        px: standard deviation in pixels of the delivered picture; of motion, along its direction.
        kind: "defocus" (a Gaussian) or "motion" (a straight stroke).
        angle_deg: direction of motion in the picture, from right towards down.
        span: when.
    """

    name: ClassVar[str] = "blur"
    sizes: ClassVar[Mapping[str, str]] = {"px": "px"}

    px: float
    kind: str = "defocus"
    angle_deg: float = 0.0
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(
            table.number("px", low=0.0, high=50.0),
            table.text("kind", "defocus"),
            table.number("angle_deg", 0.0, low=-360.0, high=360.0),
            read_span(table),
        )
        if fault.kind not in BLURS:
            raise table.error("kind", fault.kind, " or ".join(BLURS))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.px if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the picture is blurred by {self.px:g} px ({self.kind})"

    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """See `LightFault.seen`."""
        del t_s
        if self.kind == "motion":
            stroke = stroke_kernel(self.px, math.radians(self.angle_deg))
            return tuple(np.asarray(cv2.filter2D(p, -1, stroke), np.uint8) for p in pictures)
        return tuple(np.asarray(cv2.GaussianBlur(p, (0, 0), self.px), np.uint8) for p in pictures)


def stroke_kernel(sigma_px: float, angle_rad: float) -> NDArray[np.float32]:
    """(N, N) weights of sum 1 along a straight stroke whose standard deviation is `sigma_px`."""
    half_px = math.sqrt(3.0) * sigma_px
    reach = math.ceil(half_px) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1))
    for along in np.linspace(-half_px, half_px, 16 * reach + 1):
        x, y = along * math.cos(angle_rad) + reach, along * math.sin(angle_rad) + reach
        column, row = math.floor(x), math.floor(y)
        right, down = x - column, y - row
        kernel[row, column] += (1.0 - right) * (1.0 - down)
        kernel[row, column + 1] += right * (1.0 - down)
        kernel[row + 1, column] += (1.0 - right) * down
        kernel[row + 1, column + 1] += right * down
    return (kernel / kernel.sum()).astype(np.float32)
