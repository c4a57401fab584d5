# pyright: standard
"""The backward pass in readable float64, by the chain rule: the twin of the native gradients.

`benchmarks.raster.reference.renderer` draws in three steps: a lens and a pose turn splats into
footprints, a footprint has an alpha at each pixel, and alphas blend into a picture. Here they are
undone, the last one first. A function that undoes a step is given dL/d(what the step made) and
finds dL/d(what the step was given); `d_x` is dL/dx for a loss L. What is held fixed and which
limits let no gradient through stands in `scenes.render.gradients`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from benchmarks.raster.reference.differences import ExactCloud, ExactPicture, drawable
from benchmarks.raster.reference.projection import project, undo_projection
from benchmarks.raster.reference.renderer import (
    Footprints,
    blend_layers,
    centre_offsets,
    footprints_of,
)
from scenes.cameras import Fisheye, Pinhole
from scenes.harmonics import basis, slopes
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.gradients import Gradients, ObjectGradients, checked_picture_gradients
from scenes.render.pose_step import twists_of_camera, twists_of_object
from scenes.render.renderer import ALPHA_MAX, LOW_PASS_PX2, PosedSplats, RenderOptions
from scenes.render.request import check_request, refuse_exact

FloatArray = NDArray[np.float64]

PriceOfLight = Callable[[float], tuple[FloatArray, FloatArray]]
"""For a splat at a depth: (H, W) what a unit of its weight costs at each pixel, and the slope of
that by the depth."""


def backward(
    objects: Sequence[PosedSplats],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions,
    *,
    d_rgb: NDArray[np.float32] | None = None,
    d_alpha: NDArray[np.float32] | None = None,
    d_depth: NDArray[np.float32] | None = None,
    price: PriceOfLight | None = None,
) -> Gradients:
    """Gradients of a loss, as `scenes.render.gradients.record(...).gradients(...)` gives them.

    Everything is found in float64 and rounded once, at the end.

    Args:
        objects: drawn, as for `ReferenceRenderer.render`.
        camera: the lens.
        world_from_camera: where it is.
        options: what to draw.
        d_rgb: (H, W, 3) float32, dL/d rendering.rgb; None where it does not matter.
        d_alpha: (H, W) float32, dL/d rendering.alpha.
        d_depth: (H, W) float32, dL/d rendering.depth, per metre; ignored where alpha is 0.
        price: of blend weight by where it lies; None where that does not matter.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """
    check_request(objects, camera, options)
    refuse_exact(options, "gradients are those of EWA")
    shape = (camera.height_px, camera.width_px)
    checked = checked_picture_gradients(shape, d_rgb=d_rgb, d_alpha=d_alpha, d_depth=d_depth)
    d_picture = ExactPicture(*(values.astype(np.float64) for values in checked))
    camera_from_world = world_from_camera.inverse()
    poses = [camera_from_world @ posed.world_from_object for posed in objects]
    prints = [
        footprints_of(posed.cloud, camera_from_object, camera, options)
        for posed, camera_from_object in zip(objects, poses, strict=True)
    ]
    d_prints = _undo_blend(prints, camera, options, d_picture, price)
    found = []
    d_camera = np.zeros(6)
    for posed, camera_from_object, d_print in zip(objects, poses, d_prints, strict=True):
        drawn = drawable(posed.cloud, posed.world_from_object, camera, world_from_camera, options)
        cloud = ExactCloud.of(posed.cloud).select(drawn)
        d_cloud, d_twist = _undo_footprints(cloud, camera_from_object, camera, options, d_print)
        d_step = twists_of_object(world_from_camera, posed.world_from_object) @ d_twist
        d_camera += twists_of_camera(world_from_camera) @ d_twist
        found.append(_at_their_places(d_cloud, drawn, d_step))
    return Gradients(tuple(found), d_camera)


def _undo_blend(
    prints: Sequence[Footprints],
    camera: Pinhole | Fisheye,
    options: RenderOptions,
    d_picture: ExactPicture,
    price: PriceOfLight | None,
) -> list[Footprints]:
    """Each object's `Footprints`, with dL/d(each value) in its place, as in `d_picture`.

    Splat i has the blend weight wᵢ = αᵢ Tᵢ, with Tᵢ the product of 1 - αⱼ over all j in front. A
    pixel's rgb is Σ wᵢ cᵢ + (1 - Σ wᵢ) · background, its alpha A = Σ wᵢ, its depth
    D = Σ wᵢ zᵢ / A. So a unit of weight of splat i is worth

        sᵢ = dL/dwᵢ = d_rgb · (cᵢ - background) + d_alpha + d_depth · (zᵢ - D) / A + price(zᵢ).

    More of αᵢ adds to wᵢ and takes from the weights of all splats behind, which have 1 - αᵢ as a
    factor: dL/dαᵢ = sᵢ Tᵢ - (Σ sⱼ wⱼ over all j behind) / (1 - αᵢ).
    """
    transmittance = np.ones_like(d_picture.alpha)
    layers = list(blend_layers(prints, camera, options, transmittance))
    alpha_sum = 1.0 - transmittance
    is_hit = alpha_sum > 0
    d_depth_sum = np.where(is_hit, d_picture.depth / np.where(is_hit, alpha_sum, 1.0), 0.0)
    depth_sum = np.zeros_like(alpha_sum)
    for layer in layers:
        depth_sum[layer.window] += layer.weight * prints[layer.object_id].depths[layer.splat]
    mean_depth = depth_sum / np.where(is_hit, alpha_sum, 1.0)
    # The part of sᵢ that is the same for all splats.
    background = np.asarray(options.background, dtype=np.float64)
    worth_of_any = d_picture.alpha - (d_picture.rgb * background).sum(axis=2)
    worth_of_any -= d_depth_sum * mean_depth

    d_prints = [_zeros_like(p) for p in prints]
    worth_behind = np.zeros_like(alpha_sum)
    for layer in reversed(layers):
        seen, d_seen = prints[layer.object_id], d_prints[layer.object_id]
        i, at, weight = layer.splat, layer.window, layer.weight
        worth = worth_of_any[at] + d_picture.rgb[at] @ seen.colours[i]
        worth += d_depth_sum[at] * seen.depths[i]
        d_depth = d_depth_sum
        if price is not None:
            cost, slope = price(float(seen.depths[i]))
            worth += cost[at]
            d_depth = d_depth_sum + slope
        # By the logarithm of alpha: what its factors need.
        d_log_alpha = weight * worth - layer.alpha / (1.0 - layer.alpha) * worth_behind[at]
        d_log_alpha[layer.alpha >= ALPHA_MAX] = 0.0
        worth_behind[at] += weight * worth
        d_seen.colours[i] = np.einsum("yx,yxc->c", weight, d_picture.rgb[at])
        d_seen.depths[i] = (weight * d_depth[at]).sum()
        d_seen.opacities[i] = d_log_alpha.sum() / seen.opacities[i]
        d_seen.pixels[i], d_seen.covariances[i] = _undo_falloff(seen, i, at, d_log_alpha)
    return d_prints


def _zeros_like(p: Footprints) -> Footprints:
    return Footprints(*(np.zeros_like(getattr(p, field.name)) for field in fields(p)))


def _undo_falloff(
    prints: Footprints, i: int, window: tuple[slice, slice], d_log_alpha: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gradients of one splat's centre (2,) and covariance (2, 2).

    ln α = ln opacity - ½ dᵀ Σ⁻¹ d with d from the centre to the pixel. With the offset whitened
    twice, e = Σ⁻¹ d, its slopes are e by the centre and ½ e eᵀ by Σ.
    """
    offsets = np.stack(np.broadcast_arrays(*centre_offsets(prints, i, window)), axis=-1)
    whitened = offsets @ np.linalg.inv(prints.covariances[i])
    d_centre = np.einsum("yx,yxa->a", d_log_alpha, whitened)
    d_covariance = 0.5 * np.einsum("yx,yxa,yxb->ab", d_log_alpha, whitened, whitened)
    return d_centre, d_covariance


def _undo_footprints(
    cloud: ExactCloud,
    camera_from_object: Pose,
    camera: Pinhole | Fisheye,
    options: RenderOptions,
    d_prints: Footprints,
) -> tuple[ExactCloud, FloatArray]:
    """An `ExactCloud` of gradients, and the gradient of the object's twist (6,).

    Forwards: p = R m + t, J the lens's Jacobian at p, M = J R, C the splat's covariance,
    Σ_sharp = M C Mᵀ.
    """
    turn = camera_from_object.rotation
    points = camera_from_object @ cloud.means
    _, _, jacobians, _ = project(camera, points)
    picture_from_object = jacobians @ turn
    covariances = cloud.covariances()
    sharp = picture_from_object @ covariances @ np.swapaxes(picture_from_object, 1, 2)

    d_opacities, d_sharp = _undo_opacity(cloud.opacities, sharp, options.antialias, d_prints)
    d_covariances = np.swapaxes(picture_from_object, 1, 2) @ d_sharp @ picture_from_object
    d_scales, d_rotations = _undo_covariances(cloud, d_covariances)
    d_picture_from_object = 2.0 * d_sharp @ picture_from_object @ covariances
    d_jacobians = d_picture_from_object @ turn.T
    d_points = undo_projection(camera, points, d_prints.pixels, d_prints.depths, d_jacobians)

    eye_in_object = camera_from_object.inverse().translation
    d_sh, d_offsets = _undo_colours(cloud, eye_in_object, options.sh_degree, d_prints.colours)
    d_means = d_points @ turn + d_offsets
    # A shift moves the points. A turn moves them by turn × p and goes with R where J R stands; the
    # vector from the eye, seen in the object's own axes, only feels the shift.
    d_shift = (d_means @ turn.T).sum(axis=0)
    d_turned = np.einsum("nia,nib->ab", jacobians, d_jacobians)
    d_turn = np.cross(points, d_points).sum(axis=0) + _axial(d_turned)
    d_cloud = ExactCloud(d_means, d_scales, d_rotations, d_opacities, d_sh)
    return d_cloud, np.concatenate([d_shift, d_turn])


def _axial(matrix: FloatArray) -> FloatArray:
    """Slopes (3,) of the sum of the entries of [t]ₓ times those of a matrix (3, 3), by t."""
    difference = matrix - matrix.T
    return np.array([difference[2, 1], difference[0, 2], difference[1, 0]])


def _undo_opacity(
    opacities: FloatArray, sharp: FloatArray, antialias: bool, d_prints: Footprints
) -> tuple[FloatArray, FloatArray]:
    """Gradients of the cloud's opacities (N,) and of the covariances without low pass (N, 2, 2).

    With antialias, opacity · √(det Σ_sharp / det Σ); the logarithm of that factor has the slope
    ½ (Σ_sharp⁻¹ - Σ⁻¹), since Σ = Σ_sharp + low pass and d ln det Σ = tr(Σ⁻¹ dΣ).
    """
    limited = np.minimum(opacities, 1.0)
    is_free = opacities <= 1.0
    if not antialias:
        return np.where(is_free, d_prints.opacities, 0.0), d_prints.covariances
    soft = sharp + LOW_PASS_PX2 * np.eye(2)
    factor = np.sqrt(np.maximum(np.linalg.det(sharp), 0.0) / np.linalg.det(soft))
    d_log_factor = (d_prints.opacities * limited * factor)[:, None, None]
    d_sharp = d_prints.covariances + 0.5 * d_log_factor * (_inverse(sharp) - _inverse(soft))
    return np.where(is_free, d_prints.opacities * factor, 0.0), d_sharp


def _inverse(covariances: FloatArray) -> FloatArray:
    """(N, 2, 2); 0 where there is none, which are splats too thin to be drawn."""
    determinants = np.linalg.det(covariances)
    adjugates = np.trace(covariances, axis1=1, axis2=2)[:, None, None] * np.eye(2) - covariances
    return adjugates / np.where(determinants > 0, determinants, np.inf)[:, None, None]


def _undo_covariances(
    cloud: ExactCloud, d_covariances: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gradients of scales (N, 3) and quaternions (N, 4): C = F Fᵀ with F = R(q / |q|) · diag(s)."""
    rotations = rotation_from_quaternion(cloud.rotations)
    d_factors = 2.0 * d_covariances @ (rotations * cloud.scales[:, None, :])
    d_scales = (d_factors * rotations).sum(axis=1)
    d_matrices = d_factors * cloud.scales[:, None, :]

    norms = np.linalg.norm(cloud.rotations, axis=1, keepdims=True)
    unit = cloud.rotations / norms
    d_unit = np.einsum("nqij,nij->nq", _rotation_slopes(unit), d_matrices)
    # Along itself a quaternion may grow without turning anything.
    along = (d_unit * unit).sum(axis=1, keepdims=True)
    return d_scales, (d_unit - along * unit) / norms


def _rotation_slopes(unit: FloatArray) -> FloatArray:
    """(N, 4, 3, 3) derivatives of the entries of R by w, x, y, z of unit quaternions (N, 4)."""
    w, x, y, z = unit.T
    o = np.zeros_like(w)
    by_entries = [
        [[o, -z, y], [z, o, -x], [-y, x, o]],
        [[o, y, z], [y, -2 * x, -w], [z, w, -2 * x]],
        [[-2 * y, x, w], [x, o, z], [-w, z, -2 * y]],
        [[-2 * z, -w, x], [w, -2 * z, y], [x, y, o]],
    ]
    return 2.0 * np.moveaxis(np.array(by_entries), -1, 0)


def _undo_colours(
    cloud: ExactCloud, eye_in_object: FloatArray, degree: int, d_colours: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gradients of the coefficients (N, K, 3) and of the vectors from the eye to the means (N, 3).

    Forwards: colour = max(0, ½ + Σₖ basisₖ(direction) · shₖ).
    """
    offsets = cloud.means - eye_in_object
    lengths = np.linalg.norm(offsets, axis=1, keepdims=True)
    directions = offsets / np.where(lengths > 0, lengths, 1.0)
    degree = min(cloud.sh_degree, degree)
    used = (degree + 1) ** 2
    values = basis(directions, degree)
    is_clamped = 0.5 + np.einsum("nk,nkc->nc", values, cloud.sh[:, :used]) <= 0
    d_colours = np.where(is_clamped, 0.0, d_colours)

    d_sh = np.zeros_like(cloud.sh)
    d_sh[:, :used] = values[:, :, None] * d_colours[:, None, :]
    d_values = np.einsum("nkc,nc->nk", cloud.sh[:, :used], d_colours)
    d_directions = np.einsum("nka,nk->na", slopes(directions, degree), d_values)
    radial = (d_directions * directions).sum(axis=1, keepdims=True)
    return d_sh, (d_directions - radial * directions) / np.where(lengths > 0, lengths, np.inf)


def _at_their_places(
    drawn_only: ExactCloud, drawn: NDArray[np.bool_], d_step: FloatArray
) -> ObjectGradients:
    """Gradients of all splats from those of the drawn ones; the others have none."""

    def placed(values: FloatArray) -> NDArray[np.float32]:
        everywhere = np.zeros((len(drawn), *values.shape[1:]), dtype=np.float32)
        everywhere[drawn] = values
        return everywhere

    return ObjectGradients(
        placed(drawn_only.means),
        placed(drawn_only.scales),
        placed(drawn_only.rotations),
        placed(drawn_only.opacities),
        placed(drawn_only.sh),
        d_step,
    )
