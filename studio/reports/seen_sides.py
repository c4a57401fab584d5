"""Coverage of an object in words, and where more photos would help.

An object's front is the level side that photos saw most of. Left and right are as one sees them who
stands before it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes.coverage.directions import middles
from scenes.coverage.record import Coverage
from scenes.coverage.sides import BOTTOM, NORMALS, TOP
from scenes.prepare.cutout.coverage.standpoints import Advice, Standpoint
from scenes.state import ObjectModel

SIDES_SEEN_FROM: Mapping[str, str] = {
    "front": "from the front",
    "back": "from behind",
    "left": "from the left",
    "right": "from the right",
    "top": "from above",
    "bottom": "from below",
}
"""Names of sides, and how one says from where a side is seen."""

PLACES = (
    "in front of it",
    "in front of it to the right",
    "to its right",
    "behind it to the right",
    "behind it",
    "behind it to the left",
    "to its left",
    "in front of it to the left",
)
"""Ways from an object, by eighths of a turn from its front to its right."""

MIN_SEEN, MIN_WELL_SEEN = 0.1, 0.5
"""Shares of a side below which it is not seen, and hardly: a rim that shows past a neighbour, and
less than half."""

OUTWARD = 0.5
"""Cosine from a side's normal up to which a direction looks at that side: 60 degrees."""

NOT_MEASURED = "not measured"
"""Of an object whose package has no record, and no views to measure it from."""


@dataclass(frozen=True, slots=True)
class SeenSides:
    """Shares of an object that photos saw.

    Attributes:
        directions: 0..1, share of all directions from which photos saw it.
        sides: 0..1, seen share of each side, by the names of `SIDES_SEEN_FROM`.
        front_rad: which way its front faces, about up in the object's frame.
    """

    directions: float
    sides: Mapping[str, float]
    front_rad: float

    def sentence(self) -> str:
        """Return it in words: "seen from 62 % of directions; not from behind, not from below"."""
        missing = [f"not {SIDES_SEEN_FROM[s]}" for s, x in self.sides.items() if x < MIN_SEEN]
        missing += [
            f"hardly {SIDES_SEEN_FROM[s]}"
            for s, x in self.sides.items()
            if MIN_SEEN <= x < MIN_WELL_SEEN
        ]
        text = f"seen from {100 * self.directions:.0f} % of directions"
        return f"{text}; {', '.join(missing)}" if missing else text


def seen_sides(coverage: Coverage) -> SeenSides:
    """Return what photos saw of an object, by sides named from its front."""
    shares, directions = coverage.seen_share_of_sides(), coverage.seen_directions()
    looks = (middles() @ NORMALS.T > OUTWARD)[directions].sum(axis=0)
    front = max(range(4), key=lambda side: (round(float(shares[side]), 6), int(looks[side]), -side))
    ahead = NORMALS[front]
    # Whoever looks at the front, against its normal, has this side at their right.
    right = int(np.argmax(NORMALS @ np.cross(-ahead, [0.0, 0.0, 1.0])))
    back, left = (int(np.argmin(NORMALS @ NORMALS[side])) for side in (front, right))
    order = (front, back, left, right, TOP, BOTTOM)
    sides = {name: float(shares[side]) for name, side in zip(SIDES_SEEN_FROM, order, strict=True)}
    front_rad = math.atan2(float(ahead[1]), float(ahead[0]))
    return SeenSides(float(directions.mean()), sides, front_rad)


def seen_words(item: ObjectModel) -> str:
    """Return what photos saw of an object, in one sentence, or that nobody has measured it."""
    return NOT_MEASURED if item.coverage is None else seen_sides(item.coverage).sentence()


def standpoint_words(at: Standpoint, seen: SeenSides) -> str:
    """Return where to stand for a photo, in words and coordinates, and how much it shows."""
    # From the front to the right of who stands before it is counter-clockwise, seen from above.
    turn = (at.bearing_rad - seen.front_rad) / (2.0 * math.pi) % 1.0
    where = PLACES[round(turn * len(PLACES)) % len(PLACES)]
    x, y, _ = at.eye_m
    return (
        f"stand {where}, {at.away_m:.1f} m from it, camera {at.height_m:.1f} m high, at "
        f"({x:.2f}, {y:.2f}) m, where the floor is free: shows {_percent(at.gain)} more of it"
    )


def advice_lines(advice: Advice, seen: SeenSides) -> list[str]:
    """Return a line for each photo that would help, and one for what none could show."""
    lines = [
        f"{number}. {standpoint_words(at, seen)}" for number, at in enumerate(advice.standpoints, 1)
    ]
    if not lines and advice.unseen < advice.min_gain:
        return ["photos saw all of it that can be seen where it stands"]
    if advice.left >= advice.min_gain:
        lines.append(
            f"{_percent(advice.left)} of it {'then ' if lines else ''}shows from no free place on "
            "the floor: turn or move it, and film it there"
        )
    return lines


def coverage_values(item: ObjectModel, advice: Advice | None = None) -> dict[str, Any]:
    """Return the same as plain values, for `--json`."""
    if item.coverage is None:
        return {"object": item.object_id, "seen": None}
    seen = seen_sides(item.coverage)
    values: dict[str, Any] = {
        "object": item.object_id,
        "seen": {
            "directions_percent": round(100 * seen.directions, 1),
            "sides_percent": {side: round(100 * x, 1) for side, x in seen.sides.items()},
            "splats_never_percent": round(100 * float((item.coverage.directions == 0).mean()), 1),
        },
    }
    if advice is not None:
        values["photos"] = [
            {
                "eye_m": [round(x, 3) for x in at.eye_m],
                "away_m": at.away_m,
                "height_m": at.height_m,
                "shows_percent": round(100 * at.gain, 1),
                "words": standpoint_words(at, seen),
            }
            for at in advice.standpoints
        ]
        values["hidden_percent"] = round(100 * advice.left, 1)
    return values


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
