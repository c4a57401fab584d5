# pyright: standard
"""Metric alignment on printed codes: one is enough, more make it better and check each other.

Each code is a planar square of known side, and nothing is assumed of how codes stand to each other,
unless their world poses are given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.align.alignment import Alignment, Anchor, bend_per_metre
from scenes.prepare.align.codes.anchors import AnchorSightings, Sighting
from scenes.prepare.align.codes.squares import Observation, Placement, place
from scenes.prepare.align.codes.triangulate import rays, triangulated
from scenes.prepare.align.codes.usable_codes import Code, consistent, usable_codes
from scenes.prepare.align.gravity import Gravity, find_gravity, standing_world
from scenes.prepare.align.similarity import Similarity, similarity_from_points
from scenes.prepare.reconstruction import Reconstruction, View

FloatArray = NDArray[np.float64]

MISPLACED_M = 0.02
"""A code with a known place that is seen further from it than this is reported to the user."""

FLAT = 0.8
"""A code whose normal has this much of up in it lies flat."""


def align(
    reconstruction: Reconstruction,
    sightings: Sequence[AnchorSightings],
    *,
    sides_m: Mapping[str, float] | float,
    world_from_codes: Mapping[str, Pose] | None = None,
    rng: np.random.Generator,
) -> Alignment:
    """Find the metric world of a reconstruction from the codes seen in it.

    Args:
        reconstruction: photos with poses, and the sparse points that the floor is found in.
        sightings: from `find_anchors`.
        sides_m: printed side by payload, or one for all: outer edge to outer edge of the dark
            pattern, without its white border.
        world_from_codes: known world poses of codes. Then the world is theirs, and their mutual
            distances count too.
        rng: for the search of the floor.

    Raises:
        ValueError: no code is usable, two disagree about the scale, or a side is no length. The
            message says which, by how much, and what to do.
    """
    views = {view.name: view for view in reconstruction.views}
    codes, warnings = usable_codes(views, sightings, sides_m)
    order = {view.name: k for k, view in enumerate(reconstruction.views)}
    seen = {
        code.payload: [_observation(s, views[s.view], order[s.view]) for s in code.sightings]
        for code in codes
    }
    codes = consistent(codes, seen, warnings)
    known = {p: w for p, w in (world_from_codes or {}).items() if p in {c.payload for c in codes}}
    if known:
        codes = [code for code in codes if code.payload in known]
        world_from_reconstruction, covariance, placement = _align_on_known(codes, seen, known)
        gravity = None
    else:
        gravity = find_gravity(reconstruction, rng=rng)
        if gravity.floor_points == 0:
            warnings.append(
                "No floor was found in the sparse points, so up is taken from the cameras and may "
                f"be {gravity.tilt_sigma_deg:.0f}° off; film the floor too, from where it has "
                "texture."
            )
        world_from_reconstruction, covariance, placement = _align_on_free(codes, seen, gravity)
    anchors = _anchors(codes, seen, placement, world_from_reconstruction, one_body=bool(known))
    warnings += [
        _describe_misplaced(a, known[a.payload]) for a in anchors if known and _is_off(a, known)
    ]
    return Alignment(
        world_from_reconstruction,
        covariance,
        anchors,
        gravity,
        placement.groups,
        np.stack([anchor.world_from_code.translation for anchor in anchors]),
        bend_per_metre(reconstruction),
        tuple(warnings),
    )


def _observation(sighting: Sighting, view: View, order: int) -> Observation:
    return Observation(0, np.arange(4), view, order, sighting.corners_px, sighting.sigma_px)


def _move_to(seen: Observation, *, body: int, first_point: int = 0) -> Observation:
    return Observation(
        body, seen.points + first_point, seen.view, seen.order, seen.pixels, seen.sigma_px
    )


def _align_on_known(
    codes: Sequence[Code], seen: Mapping[str, list[Observation]], known: Mapping[str, Pose]
) -> tuple[Similarity, FloatArray, Placement]:
    """The world of codes whose poses are known: one rigid body of all their corners."""
    body = np.concatenate([known[code.payload] @ code.corners_m for code in codes])
    observations = [
        _move_to(o, body=0, first_point=4 * k)
        for k, code in enumerate(codes)
        for o in seen[code.payload]
    ]
    first = codes[0]
    known_first = known[first.payload]
    turn = Pose(first.start.rotation, np.zeros(3)) @ Pose(known_first.rotation.T, np.zeros(3))
    start = Pose(
        np.asarray(turn.rotation),
        first.start.translation - turn.rotation @ known_first.translation / first.metres_per_unit,
    )
    placement = place([body], observations, start=[start], metres_per_unit=first.metres_per_unit)
    reconstruction_from_world = Similarity(
        1.0 / placement.metres_per_unit, placement.rotations[0], placement.translations[0]
    )
    world_from_reconstruction = reconstruction_from_world.inverse()
    change = np.zeros((7, 7))
    change[:3, :3] = -world_from_reconstruction.rotation
    change[3:6, 3:6] = -placement.metres_per_unit * world_from_reconstruction.rotation
    change[6, 6] = 1.0
    return world_from_reconstruction, change @ placement.covariance @ change.T, placement


def _align_on_free(
    codes: Sequence[Code], seen: Mapping[str, list[Observation]], gravity: Gravity
) -> tuple[Similarity, FloatArray, Placement]:
    """The world by rule: gravity, floor, and the first code."""
    placement = place(
        [code.corners_m for code in codes],
        [_move_to(o, body=k) for k, code in enumerate(codes) for o in seen[code.payload]],
        start=[code.start for code in codes],
        metres_per_unit=float(np.median([code.metres_per_unit for code in codes])),
    )
    first = placement.rotations[0]
    facing = first[:, 2] if abs(float(first[:, 2] @ gravity.up)) < FLAT else first[:, 1]
    world_from_reconstruction = standing_world(
        gravity, placement.translations[0], facing, placement.metres_per_unit
    )
    change = _as_seen_from_codes(codes, placement, world_from_reconstruction)
    return world_from_reconstruction, change @ placement.covariance @ change.T, placement


def _as_seen_from_codes(
    codes: Sequence[Code], placement: Placement, world_from_reconstruction: Similarity
) -> FloatArray:
    """(7, 6B + 1): how the world changes with the placement, after it is laid back on the codes.

    A device that finds the codes in the room lays its own frame on them; what is left then is the
    error that matters: least squares over all corners.
    """
    scale, turn = placement.metres_per_unit, world_from_reconstruction.rotation
    count = placement.covariance.shape[0]
    moves, places = [], []
    for k, code in enumerate(codes):
        arms = code.corners_m @ placement.rotations[k].T / scale
        corners = world_from_reconstruction @ (placement.translations[k] + arms)
        move = np.zeros((4, 3, count))
        for j in range(4):
            move[j, :, 6 * k : 6 * k + 3] = -scale * turn @ _cross(arms[j])
            move[j, :, 6 * k + 3 : 6 * k + 6] = scale * turn
            move[j, :, -1] = (
                corners[j] - world_from_reconstruction.translation - scale * turn @ arms[j]
            )
        moves.append(move)
        places.append(corners)
    x = np.concatenate(places)
    rigid = np.concatenate([np.concatenate([-_cross(p), np.eye(3)], axis=1) for p in x])
    back = -np.linalg.pinv(rigid) @ np.concatenate(moves).reshape(-1, count)
    change = np.zeros((7, count))
    change[:6] = back
    change[3:6, -1] -= world_from_reconstruction.translation
    change[6, -1] = 1.0
    return change


def _cross(v: FloatArray) -> FloatArray:
    """(3, 3) matrix M with M @ x = v × x."""
    return np.cross(v, np.eye(3), axisb=1).T


def _anchors(
    codes: Sequence[Code],
    seen: Mapping[str, list[Observation]],
    placement: Placement,
    world_from_reconstruction: Similarity,
    *,
    one_body: bool,
) -> tuple[Anchor, ...]:
    """Return an anchor for each code; `one_body` if all were placed together, as known."""
    anchors, used = [], 0
    for k, code in enumerate(codes):
        observations = seen[code.payload]
        residuals_px = placement.residuals_px[used : used + len(observations)]
        used += len(observations)
        corners_m = world_from_reconstruction @ _free_corners(observations)
        if one_body:
            measured = similarity_from_points(corners_m, code.corners_m)
            world_from_code = Pose(measured.rotation, measured.translation)
        else:
            world_from_code = world_from_reconstruction.moved(
                Pose(placement.rotations[k], placement.translations[k])
            )
        off_m = np.linalg.norm(corners_m - world_from_code @ code.corners_m, axis=1)
        rms_px = np.sqrt([np.mean(r * r) for r in residuals_px])
        edges_px = [o.pixels - np.roll(o.pixels, 1, axis=0) for o in observations]
        m_per_px = code.side_m / np.array([np.linalg.norm(e, axis=1).mean() for e in edges_px])
        anchors.append(
            Anchor(
                code.payload,
                code.side_m,
                world_from_code,
                corners_m,
                residual_px=float(np.sqrt(np.mean(rms_px**2))),
                residual_mm=1000 * float(np.sqrt(np.mean((rms_px * m_per_px) ** 2))),
                corner_mm=1000 * float(np.sqrt(np.mean(off_m**2))),
                views=tuple(o.view.name for o in observations),
            )
        )
    return tuple(anchors)


def _is_off(anchor: Anchor, known: Mapping[str, Pose]) -> bool:
    away = anchor.world_from_code.translation - known[anchor.payload].translation
    return float(np.linalg.norm(away)) > MISPLACED_M


def _describe_misplaced(anchor: Anchor, world_from_code: Pose) -> str:
    away = anchor.world_from_code.translation - world_from_code.translation
    return (
        f"Code {anchor.payload!r} is {1000 * float(np.linalg.norm(away)):.0f} mm from where it "
        "should be, or another code is; see whether one was moved since, or align without their "
        "old places."
    )


def _free_corners(observations: Sequence[Observation]) -> FloatArray:
    """(4, 3) corners of one code, each from its own rays, in the reconstruction's frame."""
    cast = [rays(o.view, o.pixels) for o in observations]
    places = np.stack([place for place, _ in cast])
    directions = np.stack([direction for _, direction in cast])
    return np.stack([triangulated(places, directions[:, j]) for j in range(4)])
