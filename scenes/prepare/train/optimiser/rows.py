"""Trained state of every splat: a row of raw numbers, and how they have been moving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.splats import SplatCloud

MEAN = slice(0, 3)
LOG_SCALE = slice(3, 6)
ROTATION = slice(6, 10)
LOGIT = 10
SH = slice(11, None)
"""Columns of a row: mean (metres), ln of scale, quaternion wxyz of any norm, logit of opacity, and
the coefficients, red, green, blue of one after the other."""


@dataclass(frozen=True, slots=True, eq=False)
class TrainingRows:
    """Splats in training.

    Attributes:
        values: (N, 11 + 3K) float32, columns as named above.
        first: as `values`: Adam's running mean of gradients.
        second: as `values`: of their squares.
        steps: (N,) uint32, steps that each splat has taken.
        error: (N,) float32, sum over the pictures drawn of blend weight × absolute error.
    """

    values: NDArray[np.float32]
    first: NDArray[np.float32]
    second: NDArray[np.float32]
    steps: NDArray[np.uint32]
    error: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.values)

    @property
    def sh_count(self) -> int:
        """K: 1, 4, 9 or 16."""
        return (self.values.shape[1] - SH.start) // 3

    @property
    def opacities(self) -> NDArray[np.float32]:
        """(N,) 0..1."""
        return (1 / (1 + np.exp(-self.values[:, LOGIT]))).astype(np.float32)

    def select(self, index: NDArray[np.integer] | NDArray[np.bool_]) -> TrainingRows:
        """The rows chosen by an index array or a mask, in that order."""
        return TrainingRows(
            self.values[index],
            self.first[index],
            self.second[index],
            self.steps[index],
            self.error[index],
        )

    def to_cloud(self) -> SplatCloud:
        """The splats as they are drawn."""
        values = self.values
        quaternions = values[:, ROTATION].astype(np.float64)
        return SplatCloud(
            values[:, MEAN],
            np.exp(values[:, LOG_SCALE]),
            (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).astype(np.float32),
            self.opacities,
            values[:, SH].reshape(len(self), self.sh_count, 3),
        )


def fresh_rows(values: NDArray[np.float32]) -> TrainingRows:
    """Rows that have not moved yet."""
    n = len(values)
    return TrainingRows(
        np.ascontiguousarray(values, dtype=np.float32),
        np.zeros_like(values, dtype=np.float32),
        np.zeros_like(values, dtype=np.float32),
        np.zeros(n, dtype=np.uint32),
        np.zeros(n, dtype=np.float32),
    )


def rows_of_cloud(cloud: SplatCloud, sh_count: int) -> TrainingRows:
    """Rows that draw as `cloud` does, with `sh_count` coefficients, zeros or a part of its own."""
    n = len(cloud)
    sh = np.zeros((n, sh_count, 3), dtype=np.float32)
    kept = min(sh_count, cloud.sh.shape[1])
    sh[:, :kept] = cloud.sh[:, :kept]
    opacities = np.clip(cloud.opacities.astype(np.float64), 1e-4, 1 - 1e-4)
    logits = np.log(opacities / (1 - opacities))
    columns = (cloud.means, np.log(cloud.scales), cloud.rotations, logits[:, None])
    return fresh_rows(np.hstack([*columns, sh.reshape(n, 3 * sh_count)]).astype(np.float32))


def joined(parts: list[TrainingRows]) -> TrainingRows:
    """All rows, one part after the other."""
    return TrainingRows(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.first for part in parts]),
        np.concatenate([part.second for part in parts]),
        np.concatenate([part.steps for part in parts]),
        np.concatenate([part.error for part in parts]),
    )
