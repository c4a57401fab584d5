"""Gaussian splats as plain arrays: read by formats, drawn by renderers, followed by trackers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_quaternion

FloatArray = NDArray[np.float32]

SH_C0 = 0.28209479177387814
"""Degree-0 spherical-harmonic basis value; colour = 0.5 + SH_C0 · sh[:, 0]."""

SH_COUNTS = (1, 4, 9, 16)


@dataclass(frozen=True, slots=True, eq=False)
class SplatCloud:
    """N anisotropic Gaussians in one frame.

    Attributes:
        means: (N, 3) float32, metres.
        scales: (N, 3) float32, metres, linear standard deviations, > 0.
        rotations: (N, 4) float32, unit quaternions (w, x, y, z).
        opacities: (N,) float32, 0..1.
        sh: (N, K, 3) float32 spherical-harmonic RGB coefficients, K in {1, 4, 9, 16}.

    Raises:
        ValueError: a shape or dtype is wrong. Values are checked by `validate`, since the
            renderer must survive damaged clouds but a file reader must refuse them.
    """

    means: FloatArray
    scales: FloatArray
    rotations: FloatArray
    opacities: FloatArray
    sh: FloatArray

    def __post_init__(self) -> None:
        n = len(self.means)
        wanted = {
            "means": (n, 3),
            "scales": (n, 3),
            "rotations": (n, 4),
            "opacities": (n,),
        }
        for name in (*wanted, "sh"):
            array = np.ascontiguousarray(getattr(self, name), dtype=np.float32)
            if name == "sh":
                if array.ndim != 3 or array.shape[0] != n or array.shape[2] != 3:
                    raise ValueError(f"SplatCloud.sh: shape {array.shape}, wanted ({n}, K, 3)")
                if array.shape[1] not in SH_COUNTS:
                    raise ValueError(f"SplatCloud.sh: K = {array.shape[1]}, wanted {SH_COUNTS}")
            elif array.shape != wanted[name]:
                raise ValueError(f"SplatCloud.{name}: shape {array.shape}, wanted {wanted[name]}")
            if array is getattr(self, name) and array.flags.writeable:
                array = array.copy()
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        """0 to 3."""
        return SH_COUNTS.index(self.sh.shape[1])

    def colours(self) -> FloatArray:
        """(N, 3) view-independent RGB, 0..1 where in gamut: the degree-0 term."""
        return (0.5 + SH_C0 * self.sh[:, 0, :]).astype(np.float32)

    def select(self, index: NDArray[np.bool_] | NDArray[np.integer]) -> SplatCloud:
        """The splats chosen by a boolean mask or an index array, in that order."""
        return SplatCloud(
            self.means[index],
            self.scales[index],
            self.rotations[index],
            self.opacities[index],
            self.sh[index],
        )

    def covariances(self) -> NDArray[np.float64]:
        """(N, 3, 3) float64 covariance R S Sᵀ Rᵀ, square metres."""
        factor = rotation_from_quaternion(self.rotations) * self.scales[:, None, :].astype(
            np.float64
        )
        return factor @ np.swapaxes(factor, 1, 2)

    def transformed(self, a_from_b: Pose) -> SplatCloud:
        """The cloud in frame a. Only for view-independent colour (K = 1).

        Raises:
            ValueError: the cloud has higher spherical harmonics, which would have to be rotated;
                pose it at render time instead (`PosedSplats`).
        """
        if self.sh.shape[1] != 1:
            raise ValueError(f"SplatCloud.transformed: K = {self.sh.shape[1]}, only K = 1 can turn")
        turned = _quaternion_product(a_from_b.quaternion(), self.rotations.astype(np.float64))
        return SplatCloud(
            (a_from_b @ self.means.astype(np.float64)).astype(np.float32),
            self.scales,
            turned.astype(np.float32),
            self.opacities,
            self.sh,
        )


def concatenate(clouds: Sequence[SplatCloud]) -> SplatCloud:
    """One cloud of all splats; lower degrees are padded with zero coefficients.

    Raises:
        ValueError: no cloud was given.
    """
    if not clouds:
        raise ValueError("concatenate: no clouds")
    k = max(cloud.sh.shape[1] for cloud in clouds)
    padded = [
        np.pad(cloud.sh, ((0, 0), (0, k - cloud.sh.shape[1]), (0, 0)))
        if cloud.sh.shape[1] < k
        else cloud.sh
        for cloud in clouds
    ]
    return SplatCloud(
        np.concatenate([c.means for c in clouds]),
        np.concatenate([c.scales for c in clouds]),
        np.concatenate([c.rotations for c in clouds]),
        np.concatenate([c.opacities for c in clouds]),
        np.concatenate(padded),
    )


def validate(cloud: SplatCloud, where: str, *, start: int = 0) -> None:
    """Refuse values that no scan can have.

    Args:
        cloud: the splats to check.
        where: what to call the source in messages, such as a file name.
        start: what the first splat is numbered in messages, if the cloud is a block of more.

    Raises:
        ValueError: names the field, the first bad index, its value and the limit.
    """
    for fault in faults(cloud):
        if fault.bad.any():
            raise ValueError(
                f"{where}: {fault.what}: {int(fault.bad.sum())} of {len(fault.bad)} splats are "
                f"bad; the first is {fault.first(start)}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """Field of splats whose values are outside its limits.

    Attributes:
        what: the field.
        wanted: its limits.
        bad: (N,) splats outside of them.
        values: (N, ...) of the field.
    """

    what: str
    wanted: str
    bad: NDArray[np.bool_]
    values: FloatArray

    def first(self, start: int = 0) -> str:
        """The first bad one, its number counted from `start`."""
        first = int(np.argmax(self.bad))
        value = np.asarray(self.values[first]).tolist()
        return f"number {start + first} with {self.what} {value}, wanted {self.wanted}"


def faults(cloud: SplatCloud) -> Iterator[Fault]:
    """Everything that can be wrong with a cloud's values, whether or not it is."""
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        array = getattr(cloud, name)
        finite = np.isfinite(array).reshape(len(cloud), int(array.size / max(len(cloud), 1)))
        bad = np.asarray(~finite.all(axis=1), dtype=np.bool_)
        yield Fault(name, "finite values", bad, array)
    flat = np.asarray(np.min(cloud.scales, axis=1, initial=np.inf) <= 0, dtype=np.bool_)
    yield Fault("scales", "> 0 m", flat, cloud.scales)
    norms = np.linalg.norm(cloud.rotations, axis=1)
    loose = np.asarray(np.abs(norms - 1) > 1e-2, dtype=np.bool_)
    yield Fault("quaternion norm", "1 ± 0.01", loose, norms)
    outside = (cloud.opacities < 0) | (cloud.opacities > 1)
    yield Fault("opacities", "0..1", outside, cloud.opacities)


def _quaternion_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hamilton product of one quaternion (4,) with many (N, 4), wxyz."""
    w, x, y, z = a
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return b @ left.T
