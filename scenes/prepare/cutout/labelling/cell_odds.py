"""Odds of surface cells: by the flat patch that a cell lies in, and by its colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.surface_cells import SurfaceCells

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

GOES_ON_SHARE = 0.15
"""Of a flat patch: so much of it outside the ball means that it goes on."""

MIN_PATCH = 60
"""Cells of a flat patch: eight by eight."""

MAX_PATCHES = 24
"""Planes that are looked for, the largest first."""

SAMPLED = 3000
"""Cells among which a plane is looked for; of more, so many are drawn."""

TRIALS = 100
"""Cells whose tangent plane is tried as a plane."""

THICKNESS = 1.5
"""In sides of a cell, half the thickness of a plane at most."""

MAX_COLOUR_ODDS = 2.0
"""Log odds that a colour may say: objects and rooms share colours."""

BINS = 12
"""Of each channel, in which colours are counted; as wide as exposure and noise scatter them."""


def going_on(cells: SurfaceCells, inside: BoolArray) -> FloatArray:
    """(N,) how sure it is that a cell's flat patch goes on outside, 0..1.

    Args:
        cells: around an object, and well beyond it.
        inside: (N,) those that may be the object's.
    """
    patch, count = _flat_patches(cells)
    flat = patch >= 0
    if not count:
        return np.zeros(len(cells))
    size = np.bincount(patch[flat], minlength=count)
    outside = np.bincount(patch[flat], weights=~inside[flat], minlength=count)
    share = np.clip(outside / np.maximum(size, 1) / GOES_ON_SHARE, 0.0, 1.0)
    return np.where(flat, share[np.maximum(patch, 0)], 0.0)


def _flat_patches(cells: SurfaceCells) -> tuple[NDArray[np.intp], int]:
    """(N,) number of the flat patch that a cell lies in, -1 if in none; and how many there are.

    Planes by trial (Fischler and Bolles 1981), the largest first, each divided where it has gaps.
    """
    rng = np.random.default_rng(0)
    patch, count = np.full(len(cells), -1, dtype=np.intp), 0
    left = np.arange(len(cells))
    for _ in range(MAX_PATCHES):
        if len(left) < MIN_PATCH:
            break
        sample = left if len(left) <= SAMPLED else rng.choice(left, SAMPLED, replace=False)
        found = _largest_plane(cells, sample, rng=rng)
        if found is None or found[2] * len(left) / len(sample) < MIN_PATCH:
            break
        point, normal, _, thick_m = found
        on = np.abs((cells.places[left] - point) @ normal) < thick_m
        on &= cells.normals[left] @ normal > 0.8
        members = left[on]
        if len(members):
            parts, part = bodies(cells.places[members], 2.0 * cells.side_m)
            is_large = np.bincount(part, minlength=parts) >= MIN_PATCH // 2
            patch[members] = np.where(is_large[part], count + part, -1)
            count += parts
        left = left[~on]
    return patch, count


def _largest_plane(
    cells: SurfaceCells, sample: NDArray[np.intp], *, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, int, float] | None:
    """Point, normal, number of sampled cells on it, and half the thickness of the largest plane."""
    places, normals = cells.places[sample], cells.normals[sample]
    most = THICKNESS * cells.side_m
    tried = rng.choice(len(sample), min(TRIALS, len(sample)), replace=False)
    offsets = np.einsum("kj,kj->k", places[tried], normals[tried])
    near = np.abs(places @ normals[tried].T - offsets) < most
    near &= normals @ normals[tried].T > 0.9
    on = near[:, int(np.argmax(near.sum(axis=0)))]
    if on.sum() < 3:
        return None
    point, normal = _plane_through(places[on], normals[on])
    for _ in range(2):
        refined = (np.abs((places - point) @ normal) < most) & (normals @ normal > 0.85)
        if refined.sum() < 3:
            break
        on = refined
        point, normal = _plane_through(places[on], normals[on])
    off = np.abs((places[on] - point) @ normal)
    thick_m = min(most, 2.5 * max(1.4826 * float(np.median(off)), 0.25 * cells.side_m))
    return point, normal, int(on.sum()), thick_m


def _plane_through(places: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Point and normal of the plane of least squares, on the side to which normals point."""
    point = places.mean(axis=0)
    normal = np.linalg.svd(places - point, full_matrices=False)[2][2]
    return point, normal * np.sign((normals @ normal).mean())


def colour_odds(colours: FloatArray, labels: BoolArray) -> FloatArray:
    """(N,) log odds of each colour between labelled cells and all others."""
    place = np.clip((colours * BINS).astype(np.intp), 0, BINS - 1)
    bins = (place[:, 0] * BINS + place[:, 1]) * BINS + place[:, 2]
    shares: list[FloatArray] = []
    for part in (labels, ~labels):
        counted = np.bincount(bins[part], minlength=BINS**3).astype(np.float64)
        smooth = _blurred(counted.reshape(BINS, BINS, BINS)).ravel()
        # A colour that was never seen is as rare as one cell in a hundred.
        smooth += 0.01 * max(int(part.sum()), 1) / BINS**3
        shares.append((smooth / smooth.sum())[bins])
    return np.clip(np.log(shares[0] / shares[1]), -MAX_COLOUR_ODDS, MAX_COLOUR_ODDS)


def _blurred(counts: FloatArray) -> FloatArray:
    """Counts (B, B, B), each shared with the bins beside it: a half stays, a quarter each way."""
    for axis in range(counts.ndim):
        padded = np.pad(counts, [(int(a == axis),) * 2 for a in range(counts.ndim)], mode="edge")
        low, middle, high = (
            np.take(padded, range(start, start + counts.shape[axis]), axis=axis)
            for start in range(3)
        )
        counts = 0.25 * low + 0.5 * middle + 0.25 * high
    return counts
