"""A simulated Quest as its page says it: how it is shown, pictures a second, battery."""

from __future__ import annotations

from typing import Any

import numpy as np

from devices.hub.protocol.messages import Immersion
from devices.hub.roles import Role
from sim.headset.faults import HeadsetState

SAY_S = 2.0
"""Time between two messages of a page, `SAY_MS` in its `device.js`."""

MODEL = "Quest 3"
"""Name as its browser says it."""

FULL_S = 2.2 * 3600.0
"""Time in which a full battery is empty, seconds: what the maker gives for a Quest 3."""

FIRST_PERCENT = (60.0, 100.0)
"""Battery at joining, percent, chosen: charged in the morning, and shown to somebody before."""


class QuestDevice:
    """The headset of one person.

    Args:
        seed: of its battery.
        role: of the person: whoever is in the room sees it as it is.
    """

    def __init__(self, *, seed: int, role: str) -> None:
        self._first_percent = float(np.random.default_rng([seed, 11]).uniform(*FIRST_PERCENT))
        self._immersion = Immersion.AR if role == Role.LOCAL else Immersion.VR
        self._said: tuple[float, int] | None = None

    def said(self, here_s: float, *, pictures: int, faults: HeadsetState) -> dict[str, Any] | None:
        """Return what the page says now; None while it rests.

        Args:
            here_s: since the person joined.
            pictures: shown since then.
            faults: between the headset and the hub.
        """
        before, self._said = self._said, (here_s, pictures)
        if faults.is_asleep or faults.is_cut:
            self._said = None  # counted anew when it is awake
            return None
        hz = None
        if before is not None and here_s > before[0]:
            hz = round((pictures - before[1]) / (here_s - before[0]), 1)
        percent = max(0.0, self._first_percent - 100.0 * here_s / FULL_S)
        return {
            "kind": "device",
            "model": MODEL,
            "immersion": str(self._immersion),
            "worn": not faults.is_off,
            "hz": hz,
            "battery": round(percent),
            "charging": False,
        }
