"""The one likelihood: nats by which a window speaks for an object at a pose.

Every pixel of the object's silhouette is accounted for three ways: by the empty room, by something
that is in no scan, and by the object, drawn there in the light that fits best. The log likelihood
ratio of the object against its absence is summed over the silhouette and divided by the number of
pixels that share one error. It is 0 for what cannot be seen, negative where the empty room shows,
and comparable over objects, sizes, distances and frames.

What hides the object is accounted for too: the static room and tracked objects by their distance,
anything else as an occlusion mixture, which a pixel that shows the empty room cannot be part of.
An unknown object is coherent: what is changed around a silhouette goes on inside it up to an edge.
A passer-by who covers an object is thus neither for nor against it, and who stands behind a
supposed object is no evidence for it unless its outline shows.
A flat patch of an unknown object is nearly as likely as a flat patch of this one: it says at most
`-ln FOREIGN` a sample. Most evidence comes from where outline and pattern are, as their
surroundings do not predict those.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scenes.pose import Pose
from scenes.render.renderer import Renderer
from tracking.evidence.observation import Observation
from tracking.kernels.native import PoseLikelihood
from tracking.likelihood.drawn_object import RING, DrawnObject, draw_object, radius_px
from tracking.likelihood.pixel_model import (
    EXACTLY,
    NOT_IN_VIEW,
    UNKNOWN_REACH,
    PoseSupport,
    Terms,
    Tolerance,
    for_native,
)
from tracking.model.object_model import TrackModel

if TYPE_CHECKING:
    from tracking.kernels.native import ComparedPictures, ObservedWindow

SHARED_PX = 9.0
"""Side, px, of the square of pixels that share one error of lens, codec and exposure."""

SHARED_M = 0.03
"""Side, m on the object, of the patch that shares one error of its scan: colours, light, shape."""

LIKELIHOOD = PoseLikelihood(for_native())
"""Native likelihood; `tests.twins.likelihood.support_of` is its numpy twin."""


def pose_support(
    observation: Observation,
    model: TrackModel,
    world_from_object: Pose,
    renderer: Renderer,
    *,
    tolerance: Tolerance = EXACTLY,
    is_coarse: bool = False,
) -> PoseSupport:
    """Support of an observation for an object at a pose.

    Args:
        observation: of a window around the pose.
        model: the object.
        world_from_object: the pose.
        renderer: draws splats.
        tolerance: how exactly the pose has to be right.
        is_coarse: whether the object is drawn coarsely, for poses that are compared in hundreds.
    """
    drawn = draw_object(observation, model, world_from_object, renderer, is_coarse=is_coarse)
    if drawn is None:
        return NOT_IN_VIEW
    terms = terms_of(observation, model, world_from_object, tolerance)
    return support_of(observation, drawn, terms)


def terms_of(
    observation: Observation, model: TrackModel, world_from_object: Pose, tolerance: Tolerance
) -> Terms:
    """How an object at a pose is compared with an observation."""
    radius = radius_px(observation, model, world_from_object)
    scan_px = radius * SHARED_M / model.radius_m
    shared_px2 = (SHARED_PX / observation.lens_px) ** 2 + scan_px**2
    ring_px = max(round(RING * radius), 1)
    return Terms(tolerance, ring_px, UNKNOWN_REACH * radius, shared_px2)


def support_of(observation: Observation, drawn: DrawnObject, terms: Terms) -> PoseSupport:
    """Support of an observation for an object that is drawn at a pose; as the numpy twin."""
    rows, columns = drawn.part
    left, top = columns.start, rows.start
    return PoseSupport(
        *LIKELIHOOD.support(
            _window(observation),
            _pictures(drawn),
            {
                "part": (left, top, columns.stop - left, rows.stop - top),
                "ring_px": terms.ring_px,
                "reach_px": terms.reach_px,
                "shared_px2": terms.shared_px2,
                "sigma": terms.tolerance.sigma,
                "most_misfit": terms.tolerance.most_misfit,
                "occluded": terms.tolerance.occluded,
            },
        )
    )


def _window(observation: Observation) -> ObservedWindow:
    height, width = observation.changed.shape
    whole = np.ascontiguousarray
    return {
        "size": (width, height),
        "live": whole(observation.live),
        "empty": whole(observation.empty),
        "expected": whole(observation.expected),
        "changed": whole(observation.changed),
        "room_misfit": whole(observation.room_misfit),
        "foreign_misfit": whole(observation.foreign_misfit),
        "hidden": whole(observation.hidden),
        "range_m": whole(observation.range_m),
        "in_any_light": observation.in_any_light,
    }


def _pictures(drawn: DrawnObject) -> ComparedPictures:
    return {
        "finer": drawn.finer,
        "rgb": drawn.colours.rgb,
        "alpha": drawn.colours.alpha,
        "depth": drawn.colours.depth,
        "compass": drawn.compass.rgb,
        "compass_alpha": drawn.compass.alpha,
    }
