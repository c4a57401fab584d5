"""Did the camera move, or what it sees? A motion that all of the room shares is the camera's.

The turn and shift of the rig that account best for the details of all lenses together are
estimated, robustly, from a small picture to a large one. People and moved objects are outliers. It
is believed if the sectors of the pictures that say anything prefer it to a camera that stands: what
moves before a camera speaks in its own sectors, a moved camera in all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector
from tracking.camera.watch import SECTORS, Watch, pictured, residual

Points = NDArray[np.float64]

STEPS = (15, 40)
"""Gauss-Newton steps at each size, at most. With few, what people hide leaves 0.2° of 1° and 4 mm;
twelve at the large size leave 0.003° and 0.2 mm, as do forty."""

PRIOR = np.repeat((math.radians(3.0), 0.05), 3)
"""(6,) standard deviations of a bump about and along each axis, radians and metres: what is to be
noticed. It only decides between a turn and a shift where the pictures do not."""

OUTLIER_SCALES = 3.0
"""Tukey's cut-off in units of the residuals' scale."""

MIN_NOISE = 0.01
"""Least residual scale, log grey."""

MIN_POINTS = 60
"""Least number of points in all lenses together."""

MIN_CORRELATION = 0.6
"""Correlation of the aligned details, where they agree, below which no motion is given."""

CORRELATED_POINTS = 4.0
"""Neighbouring points that count as one: a coarse blur spans two cells each way."""

CLEAR_NATS = 3.0
"""Log odds from which a sector prefers one or the other: 20 to 1."""

COMMON_SHARE = 0.75
"""Share of the sectors with a preference that must prefer the motion."""

MOVED_RAD = math.radians(0.05)
"""Motion of the picture, root mean square, from which the camera was moved. Of cameras that stand
before people 0.001° to 0.003° was measured; an object 4 m away on the floor, seen from 1.3 m above
it, would be placed 1 cm off by a camera turned by 0.05°."""

FEWEST_SECTORS = 3
"""Sectors that must prefer it: one more than a person fills of one lens from 1 m on, two."""


def can_watch(watches: Sequence[Watch]) -> bool:
    """Whether the room has details enough to see a motion of the camera."""
    return sum(len(watch.sizes[-1].rays) for watch in watches) >= MIN_POINTS


@dataclass(frozen=True, slots=True, eq=False)
class CommonMotion:
    """How the rig moved since it was watched.

    Attributes:
        twist: (6,) turn in radians and shift in metres, in the rig's axes then.
        flow_rad: root mean square, over the room, by which the picture moved with it.
        preferring: sectors that prefer it to a camera that stands.
        opposing: sectors that prefer that.
    """

    twist: Points
    flow_rad: float
    preferring: int
    opposing: int

    @property
    def is_common(self) -> bool:
        """Whether the room as a whole says so."""
        said = self.preferring + self.opposing
        return self.preferring >= max(FEWEST_SECTORS, COMMON_SHARE * said)

    @property
    def is_small(self) -> bool:
        """Whether it is what a camera that stands scatters by."""
        return self.flow_rad < MOVED_RAD

    @property
    def then_from_now(self) -> Pose:
        """The rig's pose now in its axes then."""
        return Pose(rotation_from_vector(self.twist[:3]), self.twist[3:])


def common_motion(
    watches: Sequence[Watch], images: Sequence[NDArray[np.uint8]]
) -> CommonMotion | None:
    """The rig's motion since it was watched; None where too little of what was seen then is seen.

    Args:
        watches: of all lenses.
        images: (H, W, 3) uint8 live pictures of the same.
    """
    pictures = [pictured(image) for image in images]
    twist, noise = np.zeros(6), MIN_NOISE
    for size, steps in enumerate(STEPS):
        details = [watch.sizes[size] for watch in watches]
        by_twist = np.concatenate([d.by_twist for d in details])
        if len(by_twist) < MIN_POINTS:
            return None
        for _ in range(steps):
            left = _residuals(watches, pictures, size, twist)
            noise = max(1.5 * float(np.median(np.abs(left))), MIN_NOISE)
            agree = _agreement(left, noise)
            weighted = by_twist * (agree / noise**2)[:, None]
            information = weighted.T @ by_twist + np.diag(PRIOR**-2)
            step = np.linalg.solve(information, -weighted.T @ left - twist / PRIOR**2)
            twist = twist + step
            if float(np.abs(step).max()) < 1e-5:
                break
    return _judge(watches, pictures, twist, noise)


def _judge(
    watches: Sequence[Watch],
    pictures: Sequence[tuple[NDArray[np.float32], ...]],
    twist: Points,
    noise: float,
) -> CommonMotion | None:
    """Judge a motion by the sectors, at the largest size."""
    size = len(STEPS) - 1
    details = [watch.sizes[size] for watch in watches]
    left = _residuals(watches, pictures, size, twist)
    then = np.concatenate([d.values for d in details]).astype(np.float64)
    now, agree = then + left, _agreement(left, max(noise, 1e-9))
    power = math.sqrt(float(agree @ then**2) * float(agree @ now**2))
    correlation = float(agree @ (then * now)) / max(power, 1e-12)
    if correlation < MIN_CORRELATION or float((agree > 0).mean()) < 1.0 - MIN_CORRELATION:
        return None
    before = _residuals(watches, pictures, size, np.zeros(6))
    gain = (_cost(before, noise) - _cost(left, noise)) / CORRELATED_POINTS
    sector = np.concatenate([d.sector + SECTORS * k for k, d in enumerate(details)])
    nats = np.bincount(sector, gain, SECTORS * len(details))
    flow = np.concatenate([d.flow_by_twist for d in details]) @ twist
    return CommonMotion(
        twist,
        math.sqrt(float((flow**2).sum(axis=1).mean())),
        int((nats > CLEAR_NATS).sum()),
        int((nats < -CLEAR_NATS).sum()),
    )


def _residuals(
    watches: Sequence[Watch],
    pictures: Sequence[tuple[NDArray[np.float32], ...]],
    size: int,
    twist: Points,
) -> Points:
    return np.concatenate([
        residual(watch.sizes[size], watch.rig_from_lens, twist, picture[size])
        for watch, picture in zip(watches, pictures, strict=True)
    ])  # fmt: skip


def _agreement(left: Points, noise: float) -> Points:
    """(N,) Tukey's weights."""
    return np.clip(1.0 - (left / (OUTLIER_SCALES * noise)) ** 2, 0.0, None) ** 2


def _cost(left: Points, noise: float) -> Points:
    """(N,) nats that residuals cost, those of outliers the same however large they are."""
    limit = OUTLIER_SCALES**2 / 6.0
    return limit * (1.0 - np.clip(1.0 - (left / (OUTLIER_SCALES * noise)) ** 2, 0.0, None) ** 3)
