"""An optional renderer on CUDA devices: the kernels of gsplat (Apache-2.0), in our semantics.

gsplat's one-call `rasterization` drops what lies behind a fisheye's plane and sorts by z, so its
stages are called one by one: projection per object, then one list of splats, ordered by z or range,
for all of them. What differs from `scenes.render.renderer`, as of gsplat 1.5: alpha stops at 0.999
instead of 0.99; the splat that would take a pixel below its stop is left out instead of being the
last; samples near 1/255 are judged in float32; `ids` is None. A region or a tile mask is cut out of
the whole picture and costs as much; lenses with coefficients and exact wide splats are refused.
"""

from __future__ import annotations

import importlib
import math
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.reference.projection import ANGLE_MARGIN, POLE_MARGIN_RAD
from scenes.render.reference.renderer import (
    in_scope,
    inside_lens,
    is_sound,
)
from scenes.render.renderer import LOW_PASS_PX2, PosedSplats, Rendering, RenderOptions
from scenes.render.request import check_request, refuse_exact
from scenes.splats import SplatCloud

Tensor = Any
"""A torch tensor; torch is not there for type checkers."""

TILE_PX = 16
FAR_M = 1e10
KEPT_CLOUDS = 64
"""Clouds kept on the device; the one not drawn for longest goes first."""

INSTALL = "pip install 'gaussiannexus-studio[cuda]' on a machine with an NVIDIA driver and nvcc"


@dataclass(frozen=True, slots=True, eq=False)
class _Uploaded:
    """The sound splats of a cloud on the device, float32."""

    cloud: SplatCloud  # all of them: holding it keeps its id from being given to another one
    means: Tensor  # (N, 3)
    scales: Tensor  # (N, 3)
    rotations: Tensor  # (N, 4) wxyz
    opacities: Tensor  # (N,) at most 1
    sh: Tensor  # (N, K, 3)


@dataclass(frozen=True, slots=True, eq=False)
class _Projected:
    """Splats of one object on the picture plane; those of zero radius are not drawn."""

    pixels: Tensor  # (N, 2)
    radii: Tensor  # (N, 2) int32
    depths: Tensor  # (N,) z or range
    conics: Tensor  # (N, 3) inverse covariance: xx, xy, yy
    opacities: Tensor  # (N,)
    colours: Tensor  # (N, 3)


class GsplatRenderer:
    """Draws splats on a CUDA device. One instance may be used from several threads.

    Clouds stay on the device; the same `SplatCloud` object is found again by identity.
    `RenderOptions.threads` means nothing here.

    Args:
        device: torch's name of it.
        torch: stands in for the module in tests.
        gsplat: stands in for the module in tests.

    Raises:
        ImportError: torch or gsplat is not installed.
        RuntimeError: there is no CUDA device.
    """

    def __init__(self, *, device: str = "cuda", torch: Any = None, gsplat: Any = None) -> None:
        self._torch = torch or _imported("torch")
        if not self._torch.cuda.is_available():
            raise RuntimeError(
                "the gsplat renderer needs a CUDA device and torch finds none; "
                "use scenes.render.native.NativeRenderer, which needs no GPU"
            )
        self._gsplat = gsplat or _imported("gsplat")
        self._device = device
        self._clouds: OrderedDict[int, _Uploaded] = OrderedDict()
        self._lock = threading.Lock()

    def render(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions | None = None,
    ) -> Rendering:
        """Draw all objects in one global order; see `scenes.render.renderer` for the semantics.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        options = options or RenderOptions()
        check_request(objects, camera, options)
        refuse_exact(options, "gsplat's kernels draw by EWA")
        if isinstance(camera, Fisheye) and not camera.is_equidistant:
            raise ValueError(
                f"camera.distortion: got {camera.distortion}, wanted zeros: gsplat's fisheye is "
                "equidistant; use scenes.render.native.NativeRenderer"
            )
        camera_from_world = world_from_camera.inverse()
        with self._torch.no_grad():
            projected = [
                self._projected(
                    uploaded, camera_from_world @ posed.world_from_object, camera, options
                )
                for posed in objects
                if len((uploaded := self._uploaded(posed.cloud)).means)
            ]
            blended, alpha = self._blended(projected, camera)
        return _finished(blended, alpha, camera, options)

    def _uploaded(self, cloud: SplatCloud) -> _Uploaded:
        with self._lock:
            found = self._clouds.get(id(cloud))
            if found is not None:
                self._clouds.move_to_end(id(cloud))
                return found
        sound = cloud.select(is_sound(cloud))
        uploaded = _Uploaded(
            cloud,
            self._tensor(sound.means),
            self._tensor(sound.scales),
            self._tensor(sound.rotations),
            self._tensor(np.minimum(sound.opacities, np.float32(1.0))),
            self._tensor(sound.sh),
        )
        with self._lock:
            self._clouds[id(cloud)] = uploaded
            while len(self._clouds) > KEPT_CLOUDS:
                self._clouds.popitem(last=False)
        return uploaded

    def _tensor(self, values: NDArray[Any]) -> Tensor:
        plain = np.array(values, dtype=np.float32)  # torch wants memory that may be written
        return self._torch.as_tensor(plain, device=self._device)

    def _projected(
        self,
        splats: _Uploaded,
        camera_from_object: Pose,
        camera: Pinhole | Fisheye,
        options: RenderOptions,
    ) -> _Projected:
        is_pinhole = isinstance(camera, Pinhole)
        radii, pixels, depths, conics, compensations = self._gsplat.fully_fused_projection(
            splats.means,
            None,
            splats.rotations,
            splats.scales,
            self._tensor(camera_from_object.matrix()[None]),
            self._tensor(_intrinsics(camera)[None]),
            camera.width_px,
            camera.height_px,
            eps2d=LOW_PASS_PX2,
            # gsplat means z by near and far; a fisheye also sees what is behind it.
            near_plane=options.near_m if is_pinhole else -FAR_M,
            far_plane=FAR_M,
            calc_compensations=options.antialias,
            camera_model="pinhole" if is_pinhole else "fisheye",
            opacities=splats.opacities,
        )
        radii, depths = radii[0], depths[0]
        if isinstance(camera, Fisheye):
            depths, is_drawable = self._ranges(splats, camera_from_object, camera, options)
            radii = radii * is_drawable[:, None]
        opacities = splats.opacities
        if options.antialias:
            opacities = opacities * compensations[0]
        colours = self._colours(splats, camera_from_object, options)
        return _Projected(pixels[0], radii, depths, conics[0], opacities, colours)

    def _ranges(
        self,
        splats: _Uploaded,
        camera_from_object: Pose,
        camera: Fisheye,
        options: RenderOptions,
    ) -> tuple[Tensor, Tensor]:
        """(N,) distances, metres, and which splats are neither too near nor too far off axis."""
        rotation = self._tensor(camera_from_object.rotation.T)
        points = splats.means @ rotation + self._tensor(camera_from_object.translation)
        ranges = (points * points).sum(1) ** 0.5
        limit = min(ANGLE_MARGIN * camera.max_angle, math.pi - POLE_MARGIN_RAD)
        is_drawable = (ranges >= options.near_m) & (points[:, 2] >= ranges * math.cos(limit))
        return ranges, is_drawable

    def _colours(
        self, splats: _Uploaded, camera_from_object: Pose, options: RenderOptions
    ) -> Tensor:
        """(N, 3) as seen from the camera, by directions in the object's own frame."""
        degree = min(splats.cloud.sh_degree, options.sh_degree)
        eye = self._tensor(camera_from_object.inverse().translation)
        values = self._gsplat.spherical_harmonics(degree, splats.means - eye, splats.sh)
        return (values + 0.5).clip(min=0.0)

    def _blended(
        self, projected: Sequence[_Projected], camera: Pinhole | Fisheye
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(H, W, 4) sums of weighted colour and depth, and (H, W) alpha."""
        shape = (camera.height_px, camera.width_px)
        if not projected:
            return np.zeros((*shape, 4), np.float32), np.zeros(shape, np.float32)
        pixels, radii, depths, conics, opacities, colours = (
            self._torch.concatenate([getattr(part, name) for part in projected])[None]
            for name in _Projected.__slots__
        )
        columns, rows = (math.ceil(size / TILE_PX) for size in (camera.width_px, camera.height_px))
        _, crossings, order = self._gsplat.isect_tiles(
            pixels, radii, depths, TILE_PX, columns, rows
        )
        offsets = self._gsplat.isect_offset_encode(crossings, 1, columns, rows)
        channels = self._torch.concatenate([colours, depths[..., None]], -1)
        blended, alpha = self._gsplat.rasterize_to_pixels(
            pixels,
            conics,
            channels,
            opacities,
            camera.width_px,
            camera.height_px,
            TILE_PX,
            offsets,
            order,
        )
        return blended[0].cpu().numpy(), alpha[0, ..., 0].cpu().numpy()


def _intrinsics(camera: Pinhole | Fisheye) -> NDArray[np.float64]:
    """(3, 3) pixels; of a fisheye, focal is pixels per radian."""
    fx, fy = (camera.fx, camera.fy) if isinstance(camera, Pinhole) else (camera.f_px, camera.f_px)
    return np.array([[fx, 0.0, camera.cx], [0.0, fy, camera.cy], [0.0, 0.0, 1.0]])


def _finished(
    blended: NDArray[np.float32],
    alpha: NDArray[np.float32],
    camera: Pinhole | Fisheye,
    options: RenderOptions,
) -> Rendering:
    """Nothing outside the lens circle and the scope, a background everywhere, depths as means."""
    is_drawn = inside_lens(camera) & in_scope(camera, options)
    alpha = np.where(is_drawn, alpha, np.float32(0.0))
    sums = np.where(is_drawn[..., None], blended, np.float32(0.0))
    background = np.asarray(options.background, dtype=np.float32)
    depth = np.divide(sums[..., 3], alpha, out=np.zeros_like(alpha), where=alpha > 0)
    return Rendering(sums[..., :3] + (1 - alpha[..., None]) * background, alpha, depth)


def _imported(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"the gsplat renderer needs {name} ({error}); {INSTALL}") from error
