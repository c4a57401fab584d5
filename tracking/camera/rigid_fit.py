"""The turn and shift of a camera from displacements of windows, robust and with honest covariance.

A scan is not only noisy: whole parts of it lie somewhat beside their true place (a wall that few
photos showed, a surface whose splats hide each other). Every region of a lens therefore has a shift
of its own with a prior around 0, which is marginalised in closed form; how large these shifts are
is estimated from the windows. Without it the best textured wall decides, and a thousand windows on
it claim a precision that one has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracking.camera.displacements import Displacements

Points = NDArray[np.float64]
Indices = NDArray[np.intp]

REGION_RAD = math.radians(8.0)
"""Side of a region, in radians of the lens: 5° to 8° leave the same in all rooms tried, at 15° too
few are left to tell which of them are wrong."""

REGION_SIGMA_RAD = math.radians(0.02)
"""Standard deviation of a region's shift that does not depend on its distance, before it is scaled
by what is measured."""

REGION_SIGMA_M = 0.003
"""Standard deviation of a region's place in m, likewise: what a scan's surfaces are off by."""

REGION_TAIL = 2.0
"""Degrees of freedom of regions' shifts (Student's t): what moved since the scan is far out."""

MIN_REGION_SCALE = 0.2
"""Least ratio of the measured shifts of regions to the two constants above."""

FEWEST_REGIONS = 5
"""Informative regions from which that ratio is measured; it is 1 with fewer."""

CUTOFF = 4.0
"""Tukey's constant: windows beyond so many standard deviations of their region say nothing."""

FIRST_CUTOFF = 8.0
"""By how much that is multiplied at first; it shrinks to 1, so that many wrong windows at first do
not hold the fit."""

STEPS = 12
"""Steps of reweighting; the cutoff shrinks in the first eight."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidFit:
    """A small motion of the rig.

    Attributes:
        twist: (6,) turn in radians and shift in metres, in the rig's axes.
        information: (6, 6) its inverse covariance.
    """

    twist: Points
    information: Points


def rigid_fit(
    lenses: Sequence[Displacements], prior_mean: Points, prior_information: Points
) -> RigidFit:
    """The motion of a rig that accounts for the displacements in its lenses.

    Args:
        lenses: what their windows say.
        prior_mean: (6,) the motion expected beforehand.
        prior_information: (6, 6) its inverse covariance.
    """
    shift = np.concatenate([lens.shift for lens in lenses])
    by_twist = np.concatenate([lens.by_twist for lens in lenses])
    information = np.concatenate([lens.information for lens in lenses])
    range_m = np.concatenate([lens.range_m for lens in lenses])
    twist = prior_mean
    if not len(shift):
        return RigidFit(twist, prior_information)
    region, count = _regions(lenses)
    nearness = np.bincount(region, 1.0 / range_m) / np.bincount(region)
    variance = REGION_SIGMA_RAD**2 + (REGION_SIGMA_M * nearness) ** 2
    scale2, doubt = 1.0, np.ones(count)
    shifts = np.zeros((count, 2))
    total = prior_information
    moved = np.einsum("nij,nja->nia", information, by_twist)
    for cutoff in CUTOFF * np.geomspace(FIRST_CUTOFF, 1.0, 8)[np.minimum(np.arange(STEPS), 7)]:
        left = shift - np.einsum("nia,a->ni", by_twist, twist) - shifts[region]
        distance2 = np.einsum("ni,nij,nj->n", left, information, left)
        # In two dimensions the median of squared distances is 2 ln 2.
        noise2 = max(float(np.median(distance2)) / (2 * math.log(2.0)), 1.0)
        agree = np.clip(1.0 - distance2 / (cutoff**2 * noise2), 0.0, None) ** 2 / noise2
        weighted = moved * agree[:, None, None]
        of_shift = _summed(information * agree[:, None, None], region, count)
        of_twist = _summed(weighted, region, count)
        pull = _summed(np.einsum("nij,nj->ni", information, shift) * agree[:, None], region, count)
        prior = np.eye(2) / (scale2 * variance * doubt)[:, None, None]
        covariance = np.linalg.inv(of_shift + prior)
        through = np.einsum("kia,kij->kaj", of_twist, covariance)
        total = prior_information + np.einsum("nia,nib->ab", by_twist, weighted)
        total = total - np.einsum("kaj,kjb->ab", through, of_twist)
        right = prior_information @ prior_mean + np.einsum("nia,ni->a", weighted, shift)
        right = right - np.einsum("kaj,kj->a", through, pull)
        twist = np.asarray(np.linalg.solve(total, right), dtype=np.float64)
        shifts = np.einsum("kij,kj->ki", covariance, pull - np.einsum("kia,a->ki", of_twist, twist))
        size2 = (shifts**2).sum(axis=1)
        informative = np.trace(of_shift, axis1=1, axis2=2) * variance > 1.0
        if np.count_nonzero(informative) > FEWEST_REGIONS:
            spread = size2 + np.trace(covariance, axis1=1, axis2=2)
            ratio = np.median((spread / variance)[informative]) / (2 * math.log(2.0))
            scale2 = max(float(ratio), MIN_REGION_SCALE**2)
        doubt = 1.0 + size2 / (scale2 * variance * REGION_TAIL)
    return RigidFit(twist, total)


def _regions(lenses: Sequence[Displacements]) -> tuple[Indices, int]:
    """(N,) running number of each window's region, and how many there are."""
    places = [
        np.column_stack(
            [np.full(len(lens.pixels), k), np.floor(lens.pixels / (lens.f_px * REGION_RAD))]
        )
        for k, lens in enumerate(lenses)
    ]
    known, region = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    return np.asarray(region.reshape(-1), dtype=np.intp), len(known)


def _summed(values: Points, region: Indices, count: int) -> Points:
    """(count, …) sums of (N, …) values by region."""
    flat = values.reshape(len(values), -1)
    sums = np.stack([np.bincount(region, column, count) for column in flat.T], axis=1)
    return np.asarray(sums.reshape(count, *values.shape[1:]), dtype=np.float64)
