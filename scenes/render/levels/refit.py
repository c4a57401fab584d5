"""Fitting fewer splats to pictures of more: what makes a pruned object look whole again.

Adam (Kingma & Ba 2015) on the squared difference of colour and alpha, picture after picture, with
all values of a splat free. The start is a subset of the splats, so a hundred steps are enough.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.gradients import ObjectGradients, record
from scenes.render.levels.object_views import ObjectView
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.splats import SplatCloud

Values = dict[str, NDArray[np.float64]]

STEPS = 128
RATES = {"means": 0.1, "scales": 0.03, "rotations": 0.01, "opacities": 0.05, "sh": 0.03}
"""Adam's rates: of means in median standard deviations, of scales and opacities behind log and
logit."""

GLOSS_RATE = 0.05
"""Of the rate of the colours: that of coefficients that depend on direction."""

LAST_RATE = 0.1
"""Of the first: what the rates have decayed to at the end."""

MOMENTS, EPSILON = (0.9, 0.99), 1e-12
OPACITY_LIMITS = (0.01, 0.995)
OPTIONS = RenderOptions(antialias=True)


def refit(
    cloud: SplatCloud,
    whole: SplatCloud,
    *,
    renderer: NativeRenderer,
    views: Sequence[ObjectView],
    steps: int = STEPS,
) -> SplatCloud:
    """The cloud with its values changed so that it looks like `whole` from the views.

    Deterministic. No splat is added or lost.

    Args:
        cloud: where to start; every splat must be sound (finite, scales above 0).
        whole: what it shall look like, in the same frame.
        renderer: draws and differentiates.
        views: pictures to compare; at least one.
        steps: pictures drawn; several rounds through the views.

    Raises:
        ValueError: there is no view.
    """
    if not views:
        raise ValueError("refit: views: got none, wanted at least one")
    targets = [_drawn(whole, view, renderer) for view in views]
    values = _free_values(cloud)
    unit_m = float(np.median(cloud.scales)) if len(cloud) else 1.0
    first = {name: np.zeros_like(value) for name, value in values.items()}
    second = {name: np.zeros_like(value) for name, value in values.items()}
    for step in range(1, steps + 1):
        index = _turn(step, len(views))
        slopes = _slopes(_cloud_of(values), views[index], targets[index], renderer)
        for name, slope in slopes.items():
            first[name] += (1 - MOMENTS[0]) * (slope - first[name])
            second[name] += (1 - MOMENTS[1]) * (slope**2 - second[name])
            mean = first[name] / (1 - MOMENTS[0] ** step)
            spread = np.sqrt(second[name] / (1 - MOMENTS[1] ** step))
            rate = RATES[name] * LAST_RATE ** (step / steps)
            if name == "means":
                rate *= unit_m
            change = rate * mean / (spread + EPSILON)
            if name == "sh":
                change[:, 1:] *= GLOSS_RATE
            values[name] -= change
    return _cloud_of(values)


def _turn(step: int, count: int) -> int:
    """Neighbours in the list are neighbours around the object: take them far apart."""
    stride = next(
        s for s in range(max(1, round(0.382 * count)), count + 1) if np.gcd(s, count) == 1
    )
    return step * stride % count


def _drawn(cloud: SplatCloud, view: ObjectView, renderer: NativeRenderer) -> Rendering:
    posed = (PosedSplats(cloud, Pose.identity()),)
    return renderer.render(posed, view.camera, view.object_from_camera, OPTIONS)


def _free_values(cloud: SplatCloud) -> Values:
    opacities = np.clip(cloud.opacities.astype(np.float64), *OPACITY_LIMITS)
    rotations = cloud.rotations.astype(np.float64)
    return {
        "means": cloud.means.astype(np.float64),
        "scales": np.log(cloud.scales.astype(np.float64)),
        "rotations": rotations / np.linalg.norm(rotations, axis=1, keepdims=True),
        "opacities": np.log(opacities / (1 - opacities)),
        "sh": cloud.sh.astype(np.float64),
    }


def _cloud_of(values: Mapping[str, NDArray[np.float64]]) -> SplatCloud:
    norms = np.linalg.norm(values["rotations"], axis=1, keepdims=True)
    plain = {
        "means": values["means"],
        "scales": np.exp(values["scales"]),
        "rotations": values["rotations"] / norms,
        "opacities": 1 / (1 + np.exp(-values["opacities"])),
        "sh": values["sh"],
    }
    return SplatCloud(**{name: value.astype(np.float32) for name, value in plain.items()})


def _slopes(
    cloud: SplatCloud, view: ObjectView, target: Rendering, renderer: NativeRenderer
) -> Values:
    """Gradients of the mean squared difference by the free values."""
    posed = (PosedSplats(cloud, Pose.identity()),)
    recording = record(renderer, posed, view.camera, view.object_from_camera, OPTIONS)
    drawn = recording.rendering
    share = np.float32(2.0 / max(np.count_nonzero(target.alpha), 1))
    (found,) = recording.gradients(
        share * (drawn.rgb - target.rgb), share * (drawn.alpha - target.alpha)
    ).objects
    return _by_free_values(cloud, found)


def _by_free_values(cloud: SplatCloud, found: ObjectGradients) -> Values:
    opacities = cloud.opacities.astype(np.float64)
    return {
        "means": found.means.astype(np.float64),
        "scales": found.scales.astype(np.float64) * cloud.scales,
        "rotations": found.rotations.astype(np.float64),
        "opacities": found.opacities * opacities * (1 - opacities),
        "sh": found.sh.astype(np.float64),
    }
