# pyright: standard
"""Splats put on one surface: flat, along it, opaque, of much the same colour from everywhere.

2D Gaussian splatting (Huang et al. 2024) adds terms to the loss for this. Here rows are moved a
share of the way to where those terms vanish, every few steps (a proximal step). The surface at a
splat is the plane of the splats around it, which is what the depths of neighbouring pixels say.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from scenes.pose import rotation_from_quaternion
from scenes.prepare.train.optimiser.rows import LOG_SCALE, LOGIT, MEAN, ROTATION, SH

Values = NDArray[np.float32]
FloatArray = NDArray[np.float64]

NEIGHBOURS = 12
"""Splats whose plane a splat lies in, itself among them: two rings around it."""
MAX_CURVED = 0.25
"""Smallest over middle variance of neighbours from which on they lie in no plane: a corner."""
MAX_STRETCH = 4.0
"""Longest over middle extent of a splat: needles stick out where a surface bends."""
MAX_LOGIT = 6.0
"""Of an opacity of 0.9975; beyond it nothing is seen to change."""


@dataclass(frozen=True, slots=True)
class SurfaceTerms:
    """How strongly splats are pulled, each time that `put_on_surface` is called.

    Attributes:
        flat: thickness over the middle extent, at most; inf leaves it.
        along: share of the way of a splat's normal to that of its neighbours' plane.
        onto: share of the way of its mean onto that plane.
        opaque: added to its logit.
        albedo: share of its view-dependent colour that is lost.

    Raises:
        ValueError: a number is out of range.
    """

    flat: float = 0.1
    along: float = 0.3
    onto: float = 0.3
    opaque: float = 0.05
    albedo: float = 0.1

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value, is_share = getattr(self, name), name in ("along", "onto", "albedo")
            if not value >= 0 or (is_share and value > 1) or (name == "flat" and value == 0):
                raise ValueError(f"SurfaceTerms.{name}: {value} is out of range")


def put_on_surface(values: Values, terms: SurfaceTerms) -> None:
    """Move rows towards a surface, in place.

    Args:
        values: (N, 11 + 3K), as `scenes.prepare.train.optimiser.rows` describes them.
        terms: how strongly.
    """
    if np.isfinite(terms.flat):
        _flatten(values, terms.flat)
    if (terms.along > 0 or terms.onto > 0) and len(values) > NEIGHBOURS:
        _align(values, terms)
    if terms.opaque > 0:
        values[:, LOGIT] = np.minimum(values[:, LOGIT] + np.float32(terms.opaque), MAX_LOGIT)
    values[:, SH.start + 3 :] *= np.float32(1 - terms.albedo)


def _flatten(values: Values, flat: float) -> None:
    """No splat thicker than its share, none a needle."""
    scales = values[:, LOG_SCALE]
    rows, order = np.arange(len(values)), np.argsort(scales, axis=1)
    thin, middle, longest = order.T
    limit = scales[rows, middle]
    scales[rows, thin] = np.minimum(scales[rows, thin], limit + np.float32(np.log(flat)))
    stretched = limit + np.float32(np.log(MAX_STRETCH))
    scales[rows, longest] = np.minimum(scales[rows, longest], stretched)


def _align(values: Values, terms: SurfaceTerms) -> None:
    """Means onto the plane of their neighbours, normals along its normal."""
    means = values[:, MEAN].astype(np.float64)
    opacities = 1 / (1 + np.exp(-values[:, LOGIT].astype(np.float64)))
    normal, planar, off = _planes(means, opacities)
    values[:, MEAN] -= ((terms.onto * planar * off)[:, None] * normal).astype(np.float32)
    quaternions = values[:, ROTATION].astype(np.float64)
    thin = values[:, LOG_SCALE].argmin(axis=1)
    own = rotation_from_quaternion(quaternions)[np.arange(len(values)), :, thin]
    wanted = normal * np.where((own * normal).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    axis = np.cross(own, wanted)
    sine = np.linalg.norm(axis, axis=1)
    angle = terms.along * planar * np.arctan2(sine, (own * wanted).sum(axis=1))
    turn = Rotation.from_rotvec(axis * (angle / np.maximum(sine, 1e-12))[:, None])
    turned = turn * Rotation.from_quat(quaternions, scalar_first=True)
    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    values[:, ROTATION] = (turned.as_quat(scalar_first=True) * length).astype(np.float32)


def _planes(means: FloatArray, opacities: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Plane of each splat's neighbours.

    Returns:
        (N, 3) unit normals, (N,) how plane they are, 0..1, and (N,) metres along the normal by
        which a splat is farther off its plane than its neighbours are off theirs: on a bent surface
        all are off, to the same side, and it must not shrink.
    """
    distance, near = KDTree(means).query(means, NEIGHBOURS)
    reach = np.maximum(distance[:, -1:], 1e-9)
    weight = opacities[near] * np.exp(-2.0 * (distance / reach) ** 2)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    around = means[near]
    centre = (weight[..., None] * around).sum(axis=1)
    apart = around - centre[:, None]
    variances, axes = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, apart, apart))
    normal = axes[:, :, 0]
    curved = variances[:, 0] / np.maximum(MAX_CURVED * variances[:, 1], 1e-18)
    way = ((means - centre) * normal).sum(axis=1, keepdims=True) * normal
    way -= (weight[..., None] * way[near]).sum(axis=1)
    return normal, np.clip(1 - curved, 0, 1), (way * normal).sum(axis=1)
