"""A fault: the lamp flickers, so that every picture is a little brighter or darker."""

# ruff: noqa: D101, D102
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sim.faults.fault import LightFault


@dataclass(frozen=True)
class Flicker(LightFault):
    name: ClassVar[str] = "flicker"
    sizes: ClassVar[dict] = {"share": "share"}
    share: float = 0.2

    @classmethod
    def read(cls, table):
        return cls(table.number("share", 0.2, low=0.0, high=0.9))

    def size_at(self, t_s):
        return self.share

    def seen(self, pictures, t_s):
        gain = 1.0 + self.share * math.sin(2 * math.pi * 3.0 * t_s)
        return tuple(np.clip(p * gain, 0, 255).astype(np.uint8) for p in pictures)


def register(studio):
    studio.fault(Flicker)
