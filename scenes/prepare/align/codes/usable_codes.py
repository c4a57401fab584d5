"""Choice of the seen codes that can be used: they have a size, a place, and agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.align.codes.anchors import AnchorSightings, Sighting
from scenes.prepare.align.codes.squares import Observation, place
from scenes.prepare.align.codes.triangulate import UNIT_CORNERS, Square, find_square
from scenes.prepare.reconstruction import View

FloatArray = NDArray[np.float64]

DISAGREE_SIGMAS = 4.0
DISAGREE_SHARE = 0.01
"""Codes disagree about the scale if they differ by more than both."""

MIN_BASELINE_DEG = 3.0
"""A code whose rays cross at less than this is used, with a warning."""


@dataclass(frozen=True, slots=True, eq=False)
class Code:
    """A code that can be used.

    Attributes:
        payload: what it says.
        side_m: its printed side.
        square: where most photos see it.
        sightings: those photos'.
    """

    payload: str
    side_m: float
    square: Square
    sightings: tuple[Sighting, ...]

    @property
    def corners_m(self) -> FloatArray:
        """(4, 3) its corners in its own frame."""
        return self.side_m * UNIT_CORNERS

    @property
    def start(self) -> Pose:
        """Its pose in the reconstruction, to begin with."""
        similarity = self.square.reconstruction_from_code
        return Pose(similarity.rotation, similarity.translation)

    @property
    def metres_per_unit(self) -> float:
        """The scale that it alone gives."""
        return self.side_m / self.square.reconstruction_from_code.scale


def usable_codes(
    views: Mapping[str, View],
    sightings: Sequence[AnchorSightings],
    sides_m: Mapping[str, float] | float,
) -> tuple[list[Code], list[str]]:
    """Codes with a size and a place, and what is wrong with the others."""
    codes: list[Code] = []
    warnings: list[str] = []
    for anchor in sightings:
        side_m = sides_m if isinstance(sides_m, float | int) else sides_m.get(anchor.payload)
        if side_m is None:
            warnings.append(
                f"Code {anchor.payload!r} is not used: its printed side is not given; measure it."
            )
            continue
        if not (math.isfinite(side_m) and 0.005 <= side_m <= 5.0):
            raise ValueError(
                f"code {anchor.payload!r}: side {side_m} m, wanted 0.005 to 5; give metres, "
                "measured over the dark pattern without its white border"
            )
        code, problem = _place_code(views, anchor, float(side_m))
        if problem:
            warnings.append(problem)
        if code is not None:
            codes.append(code)
    if not codes:
        raise ValueError(
            "alignment: no code can be used. "
            + (" ".join(warnings) or "None was found in the photos.")
            + " Film a printed code of 20 cm or more from 1 to 4 m and from places half a metre "
            "apart, or give two points and the length between them."
        )
    return codes, warnings


def _place_code(
    views: Mapping[str, View], anchor: AnchorSightings, side_m: float
) -> tuple[Code | None, str]:
    """The code where most photos see it; a warning for the user, if any."""
    name = f"Code {anchor.payload!r}"
    if len(anchor.sightings) < 2:
        refused = "; ".join(f"in {r.view} {r.reason}" for r in anchor.refusals[:2])
        return None, (
            f"{name} is not used: it was measured in {len(anchor.sightings)} photo(s), wanted 2 or "
            f"more{' (' + refused + ')' if refused else ''}."
        )
    square = find_square([views[s.view] for s in anchor.sightings],
                         [s.corners_px for s in anchor.sightings])  # fmt: skip
    if square is None:
        return None, (
            f"{name} is not used: its {len(anchor.sightings)} photos are from almost one place or "
            "do not agree where it is; film it from places half a metre apart, and do not move it."
        )
    agree = square.is_inlier
    kept = tuple(s for s, ok in zip(anchor.sightings, agree, strict=True) if ok)
    left = [s for s, ok in zip(anchor.sightings, agree, strict=True) if not ok]
    code = Code(anchor.payload, side_m, square, kept)
    elsewhere = find_square([views[s.view] for s in left], [s.corners_px for s in left])
    if elsewhere is not None:
        there, here = elsewhere.reconstruction_from_code, square.reconstruction_from_code
        away_m = code.metres_per_unit * float(np.linalg.norm(there.translation - here.translation))
        first = next(s.view for s, ok in zip(left, elsewhere.is_inlier, strict=True) if ok)
        count = int(elsewhere.is_inlier.sum())
        moved = (
            f"{name} was moved while filming: {len(kept)} photos see it at one place and {count} "
            f"(from {first}) {1000 * away_m:.0f} mm away"
        )
        if 2 * count > len(kept):
            return None, f"{moved}. It is not used; fix it to the wall and film again."
        return code, f"{moved}. Only the first place is used."
    if left:
        return code, (
            f"{name}: {len(left)} of {len(anchor.sightings)} photos do not agree with the others "
            f"and are left out ({', '.join(s.view for s in left[:3])})."
        )
    if square.angle_deg < MIN_BASELINE_DEG:
        return code, (
            f"{name} was filmed from almost one direction ({square.angle_deg:.1f}° between the "
            f"outermost rays, better {MIN_BASELINE_DEG:.0f} or more); the scale is uncertain."
        )
    return code, ""


def consistent(
    codes: list[Code], seen: Mapping[str, list[Observation]], warnings: list[str]
) -> list[Code]:
    """Without the one code whose size contradicts the others.

    Raises:
        ValueError: the sizes do not show which of them is wrong.
    """
    if len(codes) < 2:
        return codes
    logs, sigmas = np.empty(len(codes)), np.empty(len(codes))
    for k, code in enumerate(codes):
        alone = place(
            [code.corners_m],
            seen[code.payload],
            start=[code.start],
            metres_per_unit=code.metres_per_unit,
        )
        logs[k] = math.log(alone.metres_per_unit)
        sigmas[k] = math.sqrt(float(alone.covariance[-1, -1]))
    apart = np.abs(logs[:, None] - logs[None])
    limit = np.maximum(DISAGREE_SIGMAS * np.hypot(sigmas[:, None], sigmas[None]), DISAGREE_SHARE)
    clash = apart > limit
    if not clash.any():
        return codes
    worst = int(np.argmax(clash.sum(axis=1) * 1e3 + apart.sum(axis=1)))
    rest = [k for k in range(len(codes)) if k != worst]
    others = float(np.average(logs[rest], weights=1.0 / sigmas[rest] ** 2))
    code = codes[worst]
    looks_m = code.side_m * math.exp(others - logs[worst])
    if len(codes) == 2 or clash[np.ix_(rest, rest)].any():
        other = codes[rest[int(np.argmax(clash[worst][rest]))]]
        j = codes.index(other)
        raise ValueError(
            f"alignment: codes {code.payload!r} and {other.payload!r} disagree about the scale by "
            f"{100 * math.expm1(abs(logs[worst] - logs[j])):.1f} %: if {other.payload!r} is "
            f"{1000 * other.side_m:.1f} mm wide, then {code.payload!r} is "
            f"{1000 * code.side_m * math.exp(logs[j] - logs[worst]):.1f} mm, not "
            f"{1000 * code.side_m:.1f}; measure both prints and give their sides"
        )
    warnings.append(
        f"Code {code.payload!r} is not used: by the other codes it is {1000 * looks_m:.1f} mm "
        f"wide, not {1000 * code.side_m:.1f} as given; measure the print."
    )
    return [c for c in codes if c is not code]
