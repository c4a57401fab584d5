"""Appearance memory: live colours of an object, applied to its rendering.

A scan has faults, such as a side that no photo saw. Where an object's pose is known, the live
picture shows its true appearance from there; seen from about the same side, every rendered point
takes its colour from that (image-based rendering on the scan's own depth).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_angle
from scenes.render.native import lens_of
from scenes.render.renderer import Rendering
from tracking.evidence.evidence import Evidence
from tracking.kernels import native
from tracking.kernels.arrays import arrays_of, rows_of
from tracking.window.contour import lift, sample

FloatArray = NDArray[np.float32]

SHOWN = 0.5
"""Foreground probability from which a pixel shows the object."""


SOLID = 0.9
"""Alpha of a rendered pixel from which its live colour is remembered."""


SAME_DEPTH = 0.2
"""Depth tolerance, in radii of the object, beyond which a point is another side."""


FADES_RAD = math.radians(20)
"""Change of viewing direction in rad up to which the memory has full weight. Chosen on the rooms
lab and desk."""

GONE_RAD = math.radians(40)
"""Change of viewing direction in rad from which it has none. Chosen on the rooms lab and desk."""


SAME_PLACE_M = 0.001
"""Displacement in m below which a resting object's memory stays valid."""

SAME_TURN_RAD = math.radians(0.3)
"""Turn in rad below which a resting object's memory stays valid."""


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceMemory:
    """The live picture of an object whose pose is known.

    Attributes:
        camera: of the picture; depth is range.
        camera_from_object: pose of the object at the time of the picture.
        world_from_object: the same in the world.
        shown: (H, W, 4) float32 0..1: RGB, and the weight of each pixel (1: certainly the object).
        depth: (H, W) metres from the camera to the rendered object.
        slack_m: a point deeper than this behind `depth` belongs to another side of the object.
        colour_correlation: -1..1, between the picture and the object rendered with this memory; 1
            until it is measured.
        was_at_rest: whether the object rested, so that its pose is known well.
    """

    camera: Fisheye
    camera_from_object: Pose
    world_from_object: Pose
    shown: FloatArray
    depth: FloatArray
    slack_m: float
    colour_correlation: float = 1.0
    was_at_rest: bool = True

    def applied_to(self, drawn: Rendering, camera: Fisheye, camera_from_object: Pose) -> Rendering:
        """The object's rendering with the remembered colours.

        Args:
            drawn: the object alone, (H, W).
            camera: of the rendering.
            camera_from_object: pose of the object in it.
        """
        view_weight = self.view_weight(camera_from_object)
        if view_weight <= 0.0:
            return drawn
        there_from_here = self.camera_from_object @ camera_from_object.inverse()
        rgb = native.laid_on(
            arrays_of(drawn),
            {
                "shown": self.shown,
                "depth": self.depth,
                "lens": lens_of(self.camera),
                "there_from_here": rows_of(there_from_here),
                "slack_m": self.slack_m,
                "worth": view_weight,
            },
            lens=lens_of(camera),
            least_alpha=SHOWN,
        )
        return Rendering(rgb.reshape(drawn.rgb.shape), drawn.alpha, drawn.depth)

    def is_valid_at(self, world_from_object: Pose) -> bool:
        """Whether the memory is of this rest pose, to a small fraction of a pixel."""
        apart = self.world_from_object.inverse() @ world_from_object
        away_m = float(np.linalg.norm(apart.translation))
        is_here = away_m < SAME_PLACE_M and rotation_angle(apart.rotation) < SAME_TURN_RAD
        return self.was_at_rest and is_here

    def view_weight(self, camera_from_object: Pose) -> float:
        """0..1 weight of the memory for the object seen at another pose."""
        a, b = _sight(self.camera_from_object), _sight(camera_from_object)
        turned = math.acos(min(max(float(a @ b), -1.0), 1.0))
        return min(max((GONE_RAD - turned) / (GONE_RAD - FADES_RAD), 0.0), 1.0)


def applied_to(
    appearance: AppearanceMemory, drawn: Rendering, camera: Fisheye, camera_from_object: Pose
) -> Rendering:
    """The readable twin of `AppearanceMemory.applied_to`."""
    rows, columns = np.nonzero(drawn.alpha > SHOWN)
    pixels = np.stack([columns, rows], axis=1).astype(np.float64) + 0.5
    points = lift(camera, pixels, drawn.depth[rows, columns].astype(np.float64))
    here = appearance.camera_from_object @ camera_from_object.inverse() @ points
    places, _ = appearance.camera.project(here)
    seen = sample(appearance.shown, places)
    is_front = np.linalg.norm(here, axis=1) < sample(appearance.depth, places) + appearance.slack_m
    share = appearance.view_weight(camera_from_object) * seen[:, 3] * is_front
    rgb = drawn.rgb.copy()
    alpha = drawn.alpha[rows, columns, None]
    laid = share[:, None].astype(np.float32) * (alpha * seen[:, :3] - rgb[rows, columns])
    rgb[rows, columns] += laid
    return Rendering(rgb, drawn.alpha, drawn.depth)


def _sight(camera_from_object: Pose) -> NDArray[np.float64]:
    """(3,) unit direction to the camera, in the object's frame."""
    eye = camera_from_object.inverse().translation
    return np.asarray(eye / np.linalg.norm(eye), dtype=np.float64)


def remember_appearance(
    evidence: Evidence, drawn: Rendering, world_from_object: Pose, *, radius_m: float
) -> AppearanceMemory:
    """The appearance of an object at a known pose.

    Args:
        evidence: its window.
        drawn: the object alone in that window, at the pose.
        world_from_object: the pose.
        radius_m: radius of the object, m.
    """
    own = (drawn.alpha > SOLID) & (evidence.foreground > SHOWN) & (evidence.hidden < SHOWN)
    sure = cv2.erode(own.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.float32)
    shown = np.dstack([evidence.live, sure]).astype(np.float32)
    # Beside the object a neighbouring pixel's depth would be mixed with nothing's.
    depth = np.where(drawn.alpha > SHOWN, drawn.depth, 0.0).astype(np.float32)
    camera_from_object = evidence.world_from_camera.inverse() @ world_from_object
    slack_m = SAME_DEPTH * radius_m
    return AppearanceMemory(
        evidence.camera, camera_from_object, world_from_object, shown, depth, slack_m
    )
