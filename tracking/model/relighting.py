# pyright: standard
"""Relighting: how much lighter each side of an object is seen than it was scanned.

The light that a side receives is nearly linear in its normal (spherical harmonics of order 1;
Ramamoorthi & Hanrahan, "An efficient representation for irradiance environment maps", 2001). With
the light fitted, a dark side of a scan is not mistaken for another side, and light cannot account
for a printed pattern.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.splats import SH_C0, SplatCloud
from scenes.state import ObjectModel
from tracking.kernels.native import Relighter
from tracking.kernels.photometry import RELIGHTING
from tracking.model.similarity import LENS_BLUR_PX, LENS_REACH_PX
from tracking.window.filters import bell_blurred

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

FOOT = 0.08
"""Share of an object's height that was scanned with the shadow it stood in, and is left out."""

NEIGHBOURS = 6
"""Nearest splats, the splat included, from which a normal is estimated."""


LIGHT_SIGMA = (0.6, 0.7, 0.05)
"""Standard deviations of an object's light relative to its scan: overall gain, gain of a side over
the opposite one, tint of a channel. Fitted freely at the true poses of 50 objects that were moved
in three random rooms, they are 0.64, 0.5 to 0.9 by axis, and 0.04 to 0.07: what stood with a side
in the shade is turned into the light."""

OPTIONS = RenderOptions(threads=1, antialias=True)

RELIGHTER = Relighter(RELIGHTING.for_native())
"""Native relighter; `LitView` is its readable twin."""


@dataclass(frozen=True, slots=True, eq=False)
class RelightableModel:
    """An object's splats with a normal each.

    Attributes:
        splats: without those at its foot.
        facing: (N, 3) unit outward normals, in the object's frame.
        compass: the same splats, coloured by their normals: 0.5 + 0.5 x, y and z.
    """

    splats: SplatCloud
    facing: Points
    compass: SplatCloud


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """Illumination of an object relative to its scan.

    Attributes:
        by_side: (4,) gain: constant, and linear in x, y and z of the normal, in the object's frame.
        tint: (3,) added per colour.
    """

    by_side: Points
    tint: Points

    def gains(self, facing: FloatArray | Points) -> FloatArray:
        """(..., 3) gains per colour of surfaces with normals (..., 3)."""
        gain = self.by_side[0] + facing @ self.by_side[1:]
        return np.clip(gain[..., None] + self.tint, *RELIGHTING.light_range).astype(np.float32)


def relightable_of(source: ObjectModel) -> RelightableModel:
    """The relightable model of an object, made once."""
    cloud = source.splats
    is_above = cloud.means[:, 2] > FOOT * source.box_m[2]
    splats = cloud.select(is_above) if is_above.any() else cloud
    centre = np.array([0.0, 0.0, 0.5 * source.box_m[2]])
    facing = _facing(splats, centre)
    colours = ((0.5 * facing) / SH_C0).astype(np.float32)[:, None, :]
    return RelightableModel(splats, facing, replace(splats, sh=colours))


@dataclass(frozen=True, slots=True, eq=False)
class LitView:
    """A part of the live picture from which an object's light is fitted.

    The readable twin of `RELIGHTER`.

    Attributes:
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) the picture without the object.
        free: (H, W) 0..1, not occluded by a nearer object.
        camera: of the picture.
        world_from_camera: its pose.
        renderer: renders the object.
    """

    live: FloatArray
    empty: FloatArray
    free: FloatArray
    camera: Fisheye
    world_from_camera: Pose
    renderer: NativeRenderer

    def light(self, relightable: RelightableModel, world_from_object: Pose) -> Light:
        """The light that fits the picture best, the object at a pose."""
        return self._light(self._drawn(relightable, world_from_object))

    def relit(self, relightable: RelightableModel, world_from_object: Pose) -> SplatCloud:
        """The object in that light; a side seen from behind, through gaps, gets the mean gain."""
        light = self.light(relightable, world_from_object)
        eye_in_object = world_from_object.inverse() @ self.world_from_camera.translation
        is_seen = ((eye_in_object - relightable.splats.means) * relightable.facing).sum(
            axis=1
        ) > 0.0
        gains = light.gains(relightable.facing * is_seen[:, None])
        sh = relightable.splats.sh * gains[:, None, :]
        sh[:, 0] += (gains - 1.0) * (0.5 / SH_C0)
        return replace(relightable.splats, sh=sh)

    def lit(
        self, relightable: RelightableModel, world_from_object: Pose
    ) -> tuple[FloatArray, FloatArray]:
        """(H, W, 3) the object alone in that light and its (H, W) alpha; faster and coarser."""
        drawn = self._drawn(relightable, world_from_object)
        return drawn.rgb * self._light(drawn).gains(drawn.facing), drawn.alpha

    def _picture(self, splats: SplatCloud, world_from_object: Pose) -> Rendering:
        posed = (PosedSplats(splats, world_from_object),)
        return self.renderer.render(posed, self.camera, self.world_from_camera, OPTIONS)

    def _drawn(self, relightable: RelightableModel, world_from_object: Pose) -> _Drawn:
        scanned = self._picture(relightable.splats, world_from_object)
        compass = self._picture(relightable.compass, world_from_object)
        facing = compass.rgb / np.maximum(compass.alpha, 1e-3)[..., None] * 2.0 - 1.0
        return _Drawn(scanned.rgb, scanned.alpha, facing.astype(np.float32))

    def _light(self, drawn: _Drawn) -> Light:
        rgb = bell_blurred(drawn.rgb, LENS_BLUR_PX, LENS_REACH_PX)
        alpha = bell_blurred(drawn.alpha, LENS_BLUR_PX, LENS_REACH_PX)
        shown = (self.live - (1.0 - alpha)[..., None] * self.empty).astype(np.float32)
        return fit_light(rgb, drawn.facing, shown, self.free * alpha)[1]


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """An object drawn alone: (H, W, 3) colours, (H, W) alpha, (H, W, 3) where it faces."""

    rgb: FloatArray
    alpha: FloatArray
    facing: FloatArray


@dataclass(frozen=True, slots=True)
class LightPrior:
    """Gaussian prior of an object's light relative to its scan, against what pixels are worth.

    Attributes:
        sigma: standard deviations of the overall gain, of the gain of a side over the opposite one,
            and of a channel's tint; the means are 1, 0 and 0.
        pixel_information: inverse variance that one pixel's channel contributes.
    """

    sigma: tuple[float, float, float]
    pixel_information: float

    def information(self) -> Points:
        """(7,) inverse variances of gain, three sides, three tints."""
        whole, side, tint = self.sigma
        return np.array([whole, side, side, side, tint, tint, tint]) ** -2.0

    def nats(self, light: Light) -> float:
        """Log of the prior density, relative to its peak."""
        apart = np.concatenate([light.by_side - LIGHT_AS_SCANNED[:4], light.tint])
        return -0.5 * float(self.information() @ apart**2)


LIGHT_AS_SCANNED = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Gain, sides and tints of an object in the light that it was scanned in."""


def fit_light(
    rgb: FloatArray,
    facing: FloatArray,
    shown: FloatArray,
    weight: FloatArray,
    *,
    prior: LightPrior | None = None,
) -> tuple[int, Light]:
    """The light that accounts best for how an object is seen, and from how many pixels.

    Args:
        rgb: (H, W, 3) the object alone, as scanned, over black.
        facing: (H, W, 3) where its surface faces, in its own frame.
        shown: (H, W, 3) the live picture less what shows through the object.
        weight: (H, W) of each pixel; those below `RELIGHTING.seen` are left out.
        prior: of the light; a weak one on its evenness if None.
    """
    here = np.flatnonzero(weight.ravel() > RELIGHTING.seen)
    step = max(len(here) // RELIGHTING.enough_px, 1)
    here = here[::step]
    at = np.unravel_index(here, weight.shape)
    if prior is not None:
        prior = replace(prior, pixel_information=prior.pixel_information * step)
    light = _fitted(rgb[at], facing[at], shown[at].astype(np.float32), weight[at], prior=prior)
    return len(here), light


def _fitted(
    rgb: FloatArray,
    facing: FloatArray,
    shown: FloatArray,
    weight: FloatArray,
    *,
    prior: LightPrior | None,
) -> Light:
    """Reweighted least squares (Geman-McClure) of `shown = rgb · gains(facing)`.

    Args:
        rgb: (N, 3) of pixels, as scanned.
        facing: (N, 3) where they face.
        shown: (N, 3) as seen.
        weight: (N,) of each.
        prior: of the light, if it is known.
    """
    sides = np.column_stack([np.ones(len(facing)), facing])
    unknowns = np.concatenate(
        [rgb[:, :, None] * sides[:, None, :], rgb[:, :, None] * np.eye(3)], axis=2
    )
    flat, seen = unknowns.reshape(-1, unknowns.shape[2]), shown.astype(np.float64).ravel()
    firm = np.array(
        [
            0.0,
            RELIGHTING.even,
            RELIGHTING.even,
            RELIGHTING.even,
            RELIGHTING.white,
            RELIGHTING.white,
            RELIGHTING.white,
        ]
    )
    light: Points = np.zeros(len(firm))
    trusted: Points = weight.astype(np.float64)
    for _ in range(RELIGHTING.fits):
        weighed = flat * np.repeat(trusted, 3)[:, None]
        power = weighed.T @ flat
        right = weighed.T @ seen
        if prior is None:
            power += np.diag(firm * power[0, 0] + RELIGHTING.least_power)
        else:
            information = prior.information() / prior.pixel_information
            power += np.diag(information)
            right += information * LIGHT_AS_SCANNED
        light = np.asarray(np.linalg.solve(power, right), dtype=np.float64)
        apart2 = ((flat @ light - seen).reshape(-1, 3) ** 2).sum(axis=1)
        trusted = (
            weight * (RELIGHTING.residual_scale**2 / (RELIGHTING.residual_scale**2 + apart2)) ** 2
        )
    return Light(light[:4], light[4:])


def _facing(splats: SplatCloud, centre: Points) -> Points:
    """(N, 3) where splats face: across the thinnest side of each and its neighbours, outwards."""
    if len(splats) == 0:
        return np.zeros((0, 3))
    rotations = rotation_from_quaternion(splats.rotations.astype(np.float64))
    scales = np.sort(splats.scales.astype(np.float64), axis=1)
    thinnest = splats.scales.argmin(axis=1)
    across = rotations[np.arange(len(splats)), :, thinnest]
    flat = splats.opacities * scales[:, 1] * scales[:, 2] * (1.0 - scales[:, 0] / scales[:, 1])
    count = min(NEIGHBOURS, len(splats))
    apart, near = KDTree(splats.means).query(splats.means, k=count)
    apart, near = apart.reshape(-1, count), near.reshape(-1, count)
    weight = flat[near] * np.exp(-2.0 * (apart / np.maximum(apart[:, -1:], 1e-9)) ** 2)
    spread = np.einsum("nk,nka,nkb->nab", weight, across[near], across[near])
    facing = np.linalg.eigh(spread)[1][:, :, 2]
    outwards = np.einsum("na,na->n", splats.means - centre, facing)
    return np.asarray(facing * np.where(outwards < 0.0, -1.0, 1.0)[:, None], dtype=np.float64)
