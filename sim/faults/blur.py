"""Blur of the whole picture: out of focus, or a camera that trembles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.faults.fault import LightFault, Picture
from sim.faults.span import Span, read_span
from sim.tables import Table

KINDS = ("defocus", "motion")


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
        if fault.kind not in KINDS:
            raise table.error("kind", fault.kind, " or ".join(KINDS))
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
