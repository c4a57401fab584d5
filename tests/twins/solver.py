"""Numpy twins of the tracker's native kernels; tests hold the two together."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose, rotation_from_vector
from tracking.background.images import (
    Exposure,
    background_noise,
    difference,
    expose,
)
from tracking.background.learning import SHRINK
from tracking.evidence.evidence import Evidence
from tracking.kernels.background import LEARNING
from tracking.kernels.options import OPTIONS
from tracking.likelihood.edges import Rows, measure_contour, projection
from tracking.model.colours import BINS, ColourModel
from tracking.model.templates import HALF_WIDTH, SMALL_PX, Cuts
from tracking.solve.measurement import Measurement
from tracking.window.contour import Texture, sample
from tracking.window.filters import bell_blurred, box_blurred
from tracking.window.window import Layer, Window

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

TEXTURE_BLUR_PX = 0.8


def change(
    live: NDArray[np.uint8],
    background_image: FloatArray,
    noise: FloatArray,
    *,
    lens_size: tuple[int, int],
    window: Window,
    exposure: Exposure,
    layers: Sequence[Layer],
    colours: ColourModel,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Live picture, foreground, own colours and what is hidden, of a window of a lens picture.

    Args:
        live: (H, W, 3) uint8 at the lens's pixels, cut to the window.
        background_image: (H, W, 3) the empty room there.
        noise: (H, W) its standard deviation.
        lens_size: width and height of the lens picture.
        window: where it was cut.
        exposure: of the lens.
        layers: other objects, the farthest first.
        colours: of the object that the window is about.
    """
    seen, expected, rough = _compared(
        live, background_image, noise, lens_size=lens_size, window=window, exposure=exposure
    )
    hidden = np.zeros(rough.shape, np.float32)
    for layer in layers:
        rgb, alpha, nearer = (_laid(p, layer, window) for p in _pictures(layer, window))
        gain, offset = exposure.gain.astype(np.float32), exposure.offset.astype(np.float32)
        expected = expected * (1 - alpha) + rgb * gain + offset * alpha
        edge = cv2.dilate(alpha, np.ones((3, 3), np.uint8))
        rough = np.maximum(rough, OPTIONS.neighbour_noise * edge)
        hidden = np.maximum(hidden, nearer[..., 0])
    expected = np.asarray(expected, dtype=np.float32)
    foreground = difference(seen, expected, rough).probability
    bins = np.clip((seen * BINS).astype(int), 0, BINS - 1)
    similarity = bell_blurred(colours.table[bins[..., 0], bins[..., 1], bins[..., 2]], 0.7, 1)
    own = foreground * np.clip(similarity * OPTIONS.likeness_gain, 0.0, 1.0)
    return seen, foreground, own.astype(np.float32), hidden


def _compared(
    live: NDArray[np.uint8],
    background_image: FloatArray,
    noise: FloatArray,
    *,
    lens_size: tuple[int, int],
    window: Window,
    exposure: Exposure,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Live picture, empty room at its exposure, and noise of a window."""
    shrink = window.shrink
    seen = _shrunk(live.astype(np.float32) * np.float32(1 / 255), shrink)
    height, width = seen.shape[:2]
    columns: Points = np.arange(int(width), dtype=np.float64) + 0.5
    rows: Points = np.arange(int(height), dtype=np.float64) + 0.5
    x = (window.left + columns * shrink) * 2 / lens_size[0] - 1
    y = (window.top + rows * shrink) * 2 / lens_size[1] - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    expected = expose(_shrunk(background_image, shrink), exposure, radius2=radius2)
    return seen, expected, np.maximum(_shrunk(noise, shrink), 1e-3)


def _shrunk(picture: FloatArray, shrink: int) -> FloatArray:
    height, width = picture.shape[0] // shrink, picture.shape[1] // shrink
    blocks = picture.reshape(height, shrink, width, shrink, *picture.shape[2:])
    return blocks.mean(axis=(1, 3)).astype(np.float32)


def _pictures(layer: Layer, window: Window) -> tuple[FloatArray, FloatArray, FloatArray]:
    is_nearer = (layer.range_m > 0) & (layer.range_m < window.target_range_m)
    return layer.rgb, layer.alpha[..., None], (layer.alpha * is_nearer)[..., None]


def _laid(picture: FloatArray, layer: Layer, window: Window) -> FloatArray:
    """A layer's picture in the window, 0 around it."""
    _, _, width, height = window.corner_and_size
    whole = np.zeros((height * window.shrink, width * window.shrink, picture.shape[2]), np.float32)
    left, top = layer.left - window.left, layer.top - window.top
    rows = slice(max(top, 0), max(min(top + picture.shape[0], whole.shape[0]), 0))
    columns = slice(max(left, 0), max(min(left + picture.shape[1], whole.shape[1]), 0))
    if rows.start < rows.stop and columns.start < columns.stop:
        part = picture[rows.start - top : rows.stop - top, columns.start - left :]
        whole[rows, columns] = part[:, : columns.stop - columns.start]
    return _shrunk(whole, window.shrink)


def refined(
    evidence: Evidence,
    measurement: Measurement,
    world_from_object: Pose,
    silhouette_bias_m: float,
    *,
    rounds: Sequence[tuple[float, int]],
) -> tuple[Pose, float, Points]:
    """A pose after Gauss-Newton, its silhouette bias, and the information (7, 7) behind them.

    Args:
        evidence: the window.
        measurement: what to measure by.
        world_from_object: where to begin.
        silhouette_bias_m: where to begin.
        rounds: reach in pixels and number of steps, one after the other.
    """
    information = np.zeros((7, 7))
    for reach_px, steps in rounds:
        for _ in range(steps):
            step, information = _step(
                evidence, measurement, world_from_object, silhouette_bias_m, reach_px
            )
            if measurement.is_round:
                step[5] = 0.0
            world_from_object = Pose(
                rotation_from_vector(step[3:6]) @ world_from_object.rotation,
                world_from_object.translation + step[:3],
            )
            silhouette_bias_m += float(step[6])
            if np.abs(step[:3]).max() < 2e-4 and np.abs(step[3:6]).max() < 5e-4:
                break
    return world_from_object, silhouette_bias_m, information


def px_per_m(measurement: Measurement, world_from_object: Pose) -> float:
    """Pixels that a metre across the view takes at the object's distance."""
    camera = measurement.camera
    in_world = world_from_object @ measurement.centre_m
    centre = measurement.world_from_camera.inverse() @ in_world
    if isinstance(camera, Pinhole):
        return camera.fx / max(float(centre[2]), 0.1)
    return camera.f_px / max(float(np.linalg.norm(centre)), 0.1)


def _step(
    evidence: Evidence,
    measurement: Measurement,
    world_from_object: Pose,
    silhouette_bias_m: float,
    reach_px: float,
) -> tuple[Points, Points]:
    """One robust Gauss-Newton step (7,) and the information (7, 7) behind it."""
    information = np.diag(1.0 / measurement.prior_sigma**2)
    mean = measurement.prior_world_from_object
    turn = cv2.Rodrigues(mean.rotation @ world_from_object.rotation.T)[0].ravel()
    shift = mean.translation - world_from_object.translation
    right = information @ np.array(
        [*shift, *turn, measurement.prior_silhouette_bias_m - silhouette_bias_m]
    )
    scale = px_per_m(measurement, world_from_object)
    edges = measure_contour(
        evidence,
        measurement.outline,
        world_from_object,
        reach_px=reach_px,
        offset_px=measurement.low_pass_px + silhouette_bias_m * scale,
    )
    # A larger silhouette bias puts the drawn edge closer to the seen one.
    outline = np.column_stack([edges.rows.jacobian, -scale / edges.sigma_px])
    # Tukey's cut-off shrinks with the reach, from half of it down to about 2.5 σ.
    parts = [(outline, edges.rows, max(2.5, 1.3 * reach_px))]
    if measurement.texture is not None:
        inner = _texture_rows(evidence, measurement, world_from_object)
        parts.append((np.pad(inner.jacobian, ((0, 0), (0, 1))), inner, OPTIONS.texture_cutoff))
    for jacobian, rows, limit in parts:
        weight = rows.weight * np.clip(1.0 - (rows.residual / limit) ** 2, 0.0, None) ** 2
        weighted = jacobian * weight[:, None]
        information = information + weighted.T @ jacobian
        right = right + weighted.T @ rows.residual
    step = np.asarray(np.linalg.solve(information + 1e-9 * np.eye(7), right), dtype=np.float64)
    longest = max(float(np.abs(step[:3]).max()) / 0.15, float(np.abs(step[3:6]).max()) / 0.35, 1.0)
    return step / longest, information


def _texture_rows(evidence: Evidence, measurement: Measurement, world_from_object: Pose) -> Rows:
    assert measurement.texture is not None
    smooth = bell_blurred(evidence.live, TEXTURE_BLUR_PX, 3)
    return measure_texture(
        evidence, smooth, measurement.texture, world_from_object, textured=measurement.textured
    )


def exposure(
    background_image: Points, radius2: Points, seen: Points, iterations: int
) -> tuple[float, float, float]:
    """Gain, falloff and offset of one channel: robust least squares that ignores outliers."""
    a = np.stack(
        [background_image, background_image * radius2, np.ones(len(background_image))], axis=1
    )
    x = np.array([1.0, 0.0, float(np.median(seen - background_image))])
    for _ in range(iterations):
        residual = seen - a @ x
        scale = max(1.5 * float(np.median(np.abs(residual))), 0.01)
        weight = 1.0 / (1.0 + (residual / scale) ** 2) ** 2
        weighted = a * weight[:, None]
        x = np.linalg.solve(weighted.T @ a + 1e-9 * np.eye(3), weighted.T @ seen)
    return float(x[0]), float(x[1]), float(x[2])


def learned_rows(
    live: NDArray[np.uint8],
    background_image: FloatArray,
    learned: NDArray[np.bool_],
    usable: NDArray[np.bool_],
    *,
    lens_size: tuple[int, int],
    top: int,
    exposure: Exposure,
    sides: tuple[int, int, int],
    level: float,
    is_cautious: bool,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """New background image, noise and learned mask of some rows of one lens.

    Args:
        live: (H, W, 3) uint8 rows of the lens picture.
        background_image: (H, W, 3) the empty room so far.
        learned: (H, W) whether a pixel was learned before.
        usable: (H, W) whether a pixel may be learned from.
        lens_size: width and height of the lens picture.
        top: first of the rows.
        exposure: of the lens.
        sides: see `tracking.background.learning.surroundings`.
        level: a mean difference above this, of a 0..1 channel, shows an object.
        is_cautious: see `tracking.background.learning.Care`.
    """
    height, width = background_image.shape[:2]
    x = ((np.arange(width, dtype=np.float32) + 0.5) / lens_size[0] - 0.5) * 2
    y = ((np.arange(top, top + height, dtype=np.float32) + 0.5) / lens_size[1] - 0.5) * 2
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2)[..., None]
    gain = exposure.gain.astype(np.float32) + radius2 * exposure.falloff.astype(np.float32)
    neutral = (live.astype(np.float32) / 255.0 - exposure.offset.astype(np.float32)) / gain
    residual = np.asarray(neutral - background_image, dtype=np.float32)
    coherent_side, rough_side, wary_side = sides
    small_residual = _in_squares(residual)
    mean_residual = box_blurred(small_residual, coherent_side)
    shows_room = np.abs(mean_residual).max(axis=2) < level
    if is_cautious:
        shows_room = box_blurred(shows_room.astype(np.float32), wary_side) > 0.999
    else:
        shows_room |= _relit(
            box_blurred(_in_squares(background_image), coherent_side), mean_residual
        )
    take = usable & (_grown(shows_room.astype(np.float32), height, width) >= 0.5)
    share = np.where(learned, np.float32(LEARNING.blend), np.float32(1.0)) * take
    background_image = background_image + residual * share[..., None]
    known = learned | take
    noise = background_noise(background_image)
    if not known.all():
        speckle = np.abs(small_residual - mean_residual).mean(axis=2)
        weight = take[::SHRINK, ::SHRINK].astype(np.float32)
        total, count = box_blurred(speckle * weight, rough_side), box_blurred(weight, rough_side)
        rough = (total / np.maximum(count, 1e-3)).astype(np.float32)
        rough = _grown(rough, height, width)
        noise = np.where(known, noise, np.maximum(noise, rough))
    return background_image, noise.astype(np.float32), known


def _in_squares(picture: FloatArray) -> FloatArray:
    """Means of squares of `SHRINK` pixels; the border is repeated to fill the last ones."""
    missing = [(0, -side % SHRINK) for side in picture.shape[:2]]
    return _shrunk(np.pad(picture, [*missing, (0, 0)], mode="edge"), SHRINK)


def _grown(small: FloatArray, height: int, width: int) -> FloatArray:
    """A picture of squares at the size it was shrunk from."""
    size = (small.shape[1] * SHRINK, small.shape[0] * SHRINK)
    large = cv2.resize(small, size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large[:height, :width], dtype=np.float32)


def _relit(background_image: FloatArray, residual: FloatArray) -> NDArray[np.bool_]:
    """Mask of pixels whose colour is only lighter or darker: a shadow has come or gone."""
    live = background_image + residual
    power = np.einsum("hwc,hwc->hw", background_image, background_image) + 1e-4
    ratio = np.einsum("hwc,hwc->hw", live, background_image) / power
    hue = np.abs(live - ratio[..., None] * background_image).max(axis=2)
    return (
        (ratio > LEARNING.relit_ratio[0])
        & (ratio < LEARNING.relit_ratio[1])
        & (hue < LEARNING.relit_hue)
    )


def cut_out(
    picture: FloatArray,
    camera: Fisheye,
    world_from_lens: Pose,
    centres: Points,
    radius_m: float,
) -> Cuts:
    """Cut places out of one lens.

    Args:
        picture: (H, W, 5) red, green, blue, own, foreground.
        camera: of the picture.
        world_from_lens: its pose.
        centres: (P, 3) world places of the object's centre.
        radius_m: of the object.
    """
    eye = world_from_lens.translation
    away = centres - eye
    distance = np.linalg.norm(away, axis=1)
    forward = away / distance[:, None]
    level = np.hypot(away[:, 0], away[:, 1])
    right = np.stack([away[:, 1], -away[:, 0], np.zeros(len(away))], axis=1)
    right /= np.maximum(level, 1e-9)[:, None]
    down = np.cross(forward, right)
    steps = ((np.arange(SMALL_PX) + 0.5) / SMALL_PX * 2 - 1) * HALF_WIDTH * radius_m
    across, along = (grid.ravel() for grid in np.meshgrid(steps, steps))
    points = centres[:, None] + across[None, :, None] * right[:, None]
    points = points + along[None, :, None] * down[:, None]
    pixels, seen = camera.project(world_from_lens.inverse() @ points.reshape(-1, 3))
    step_px = 2 * HALF_WIDTH * radius_m / SMALL_PX / distance * camera.f_px
    samples = _sampled(picture, pixels.reshape(len(centres), -1, 2), step_px)
    samples *= seen.reshape(len(centres), -1, 1)
    own, foreground = samples[..., 3], samples[..., 4]
    free = (1.0 - np.maximum(foreground - own, 0.0)) * seen.reshape(len(centres), -1)
    return Cuts(
        samples[..., :3],
        own,
        free.astype(np.float32),
        np.arctan2(-away[:, 1], -away[:, 0]),
        np.arctan2(-away[:, 2], level),
    )


def _sampled(picture: FloatArray, pixels: Points, step_px: Points) -> FloatArray:
    """(P, N, C) of a picture, smoothed to the step between samples."""
    found = np.zeros((*pixels.shape[:2], picture.shape[2]), np.float32)
    octave = np.clip(np.floor(np.log2(np.maximum(step_px, 1.0)) + 0.5), 0, 3).astype(int)
    for k in range(4):
        chosen = octave == k
        if chosen.any():
            where = (pixels[chosen] / 2**k - 0.5).astype(np.float32)
            parts = [
                cv2.remap(part, where[..., 0], where[..., 1], cv2.INTER_LINEAR)
                for part in (picture[..., :3], picture[..., 3], picture[..., 4])
            ]
            found[chosen] = np.dstack(parts).reshape(*where.shape[:2], -1)
        if not (octave > k).any():
            break
        picture = _halved(picture)
    return found


def _halved(picture: FloatArray) -> FloatArray:
    size = (picture.shape[1] // 2, picture.shape[0] // 2)
    parts = (picture[..., :3], picture[..., 3], picture[..., 4])
    small = [cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in parts]
    return np.dstack(small).astype(np.float32)


def measure_texture(
    evidence: Evidence,
    smooth_live: FloatArray,
    texture: Texture,
    world_from_object: Pose,
    *,
    textured: bool,
) -> Rows:
    """Compare the object's own picture with the live one, after a fit of gain and offset.

    Args:
        evidence: the crop.
        smooth_live: (H, W, 3) its live picture, smoothed like the texture's values.
        texture: points drawn at a pose near `world_from_object`.
        world_from_object: where to compare.
        textured: whether the object has a pattern; shading alone is trusted less.
    """
    pixels, by_pose = projection(
        texture.points, world_from_object, evidence.camera, evidence.world_from_camera.inverse()
    )
    seen = sample(smooth_live, pixels).astype(np.float64)
    usable = sample(evidence.own, pixels) * (1 - sample(evidence.hidden, pixels)) > 0.25
    if usable.sum() < 12:
        return Rows(np.zeros((0, 6)), np.zeros(0), np.zeros(0))
    model = texture.values.astype(np.float64)
    gain, level = _gain_and_level(model[usable], seen[usable])
    residual = seen - (gain * model + level)
    slopes = gain * texture.slopes.astype(np.float64)
    jacobian = np.einsum("nci,nij->ncj", slopes, by_pose)
    shared = OPTIONS.texture_correlation if textured else OPTIONS.plain_correlation
    weight = np.repeat(usable.astype(np.float64), 3) / (3.0 * shared)
    # Light and blur that no gain accounts for: a bad match has a large sigma.
    sigma = max(OPTIONS.texture_sigma, 1.5 * float(np.median(np.abs(residual[usable]))))
    return Rows(jacobian.reshape(-1, 6) / sigma, -residual.reshape(-1) / sigma, weight)


def _gain_and_level(model: Points, seen: Points) -> tuple[float, Points]:
    """Robust shared gain and per-channel level of seen ≈ gain · model + level."""
    weight = np.ones(len(model))
    gain, level = 1.0, np.zeros(3)
    for _ in range(4):
        total = max(float(weight.sum()), 1e-9)
        mean_model = weight @ model / total
        mean_seen = weight @ seen / total
        a, b = model - mean_model, seen - mean_seen
        spread = float(np.einsum("n,nc->", weight, a * a))
        gain = float(np.einsum("n,nc->", weight, a * b)) / max(spread, 1e-6)
        gain = min(max(gain, 0.3), 1.8)
        level = mean_seen - gain * mean_model
        off = np.linalg.norm(seen - gain * model - level, axis=1)
        scale = max(1.5 * float(np.median(off)), 0.03)
        weight = 1.0 / (1.0 + (off / scale) ** 2)
    return gain, level
