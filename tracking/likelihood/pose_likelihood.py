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

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scenes.pose import Pose
from scenes.render.native import NativeRenderer, cameras_from_objects
from tracking.evidence.observation import Observation
from tracking.kernels.native import PoseLikelihood
from tracking.likelihood.drawn_object import (
    FINE_PX,
    MARGIN_PX,
    RING,
    levels_for,
    radii_at,
)
from tracking.likelihood.pixel_model import (
    EXACTLY,
    UNKNOWN_REACH,
    PoseSupport,
    Tolerance,
    for_native,
)
from tracking.model.object_model import RENDER_OPTIONS, TrackModel

if TYPE_CHECKING:
    from tracking.kernels.native import ObservedWindow

SHARED_PX = 7.0
"""Side, px, of the square of pixels that share one error of lens, codec and exposure. Log loss of
the true pose among those that a search finds (60 objects in the room lab, 86 in four random
rooms): 0.92 with 9, 0.77 with 7. With 6 a pushed chair of which a fifth shows is lost in one run
of four."""

SHARED_M = 0.03
"""Side, m on the object, of the patch that shares one error of its scan: colours, light, shape."""

MIN_SHARED = 16
"""Poses from which the processors share them: one takes 0.1 to 1 ms, handing over 0.02."""

SHARED_OPTIONS = replace(RENDER_OPTIONS, threads=0)
"""Of a drawing that they share: the likelihoods are the same to the bit."""

LIKELIHOOD = PoseLikelihood(for_native())
"""Native likelihood; `tests.twins.likelihood.support_of` is its numpy twin."""


def pose_support(
    observation: Observation,
    model: TrackModel,
    world_from_object: Pose,
    renderer: NativeRenderer,
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
    (support,) = pose_supports(
        observation,
        model,
        poses=[world_from_object],
        renderer=renderer,
        tolerance=tolerance,
        is_coarse=is_coarse,
    )
    return support


def pose_supports(
    observation: Observation,
    model: TrackModel,
    *,
    poses: Sequence[Pose],
    renderer: NativeRenderer,
    tolerance: Tolerance = EXACTLY,
    is_coarse: bool = False,
) -> list[PoseSupport]:
    """`pose_support` of an object at each of some poses, in one native call.

    Args:
        observation: of a window around the poses.
        model: the object.
        poses: `world_from_object`.
        renderer: draws splats.
        tolerance: how exactly a pose has to be right.
        is_coarse: whether the object is drawn coarsely, for poses that are compared in hundreds.
    """
    if not poses:
        return []
    radii_px = radii_at(observation, model, poses=poses)
    levels, level_of_pose = levels_for(model, radii_px, is_coarse=is_coarse)
    drawing = renderer.drawn_by_kernel(
        [cloud for level in levels for cloud in (level.splats, level.relightable.compass)],
        camera=observation.camera,
        options=RENDER_OPTIONS if len(poses) < MIN_SHARED else SHARED_OPTIONS,
    )
    found = LIKELIHOOD.supports(
        _window(observation),
        {
            "corners": model.corners_m.tolist(),
            "radius_m": model.radius_m,
            "levels": list(zip(drawing["clouds"][::2], drawing["clouds"][1::2], strict=True)),
        },
        {
            "camera_from_object": cameras_from_objects(poses, observation.world_from_camera),
            "radius_px": radii_px,
            "level": level_of_pose,
            "margin_px": MARGIN_PX,
            "ring": RING,
            "fine_px": 0 if is_coarse else FINE_PX,
            "reach": UNKNOWN_REACH,
            "shared_px": SHARED_PX / observation.lens_px,
            "shared_m": SHARED_M,
            "sigma": tolerance.sigma,
            "most_misfit": tolerance.most_misfit,
            "occluded": tolerance.occluded,
        },
        drawing,
    )
    return [PoseSupport(*said) for said in found]


def _window(observation: Observation) -> ObservedWindow:
    height, width = observation.changed.shape
    whole = np.ascontiguousarray
    return {
        "size": (width, height),
        "live": whole(observation.live),
        "empty": whole(observation.empty),
        "expected": whole(observation.expected),
        "changed": whole(observation.changed),
        "foreground": whole(observation.foreground),
        "room_misfit": whole(observation.room_misfit),
        "foreign_misfit": whole(observation.foreign_misfit),
        "hidden": whole(observation.hidden),
        "claimed": whole(observation.claimed),
        "range_m": whole(observation.range_m),
        "in_any_light": observation.in_any_light,
    }
