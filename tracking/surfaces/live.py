"""Live surfaces: quads in the room that show what the 360° camera sees there now (paper 4.3).

Per surface and frame: the picture straight from the lens's pixels by a table that is kept while the
camera stands, and a coarse picture with a margin in which is decided what is in the way:

- a tracked object, drawn where it is, nearer to the lens than the surface;
- a change that comes from beyond the surface's edge. What changes on the surface only is what it
  shows, such as new writing; a hand that writes it reaches in from outside.

Where something is in the way, the last clean picture stays. What keeps still for long enough is
taken for a part of the surface, so no mistake lasts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.state import LiveSurface
from tracking.background.images import (
    BackgroundImages,
    difference,
    expose,
    fit_exposure,
)
from tracking.kernels.background import LEARNING
from tracking.surfaces.view import SurfaceView, surface_view
from tracking.window.filters import grey, slopes
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

COARSE_SIDE_PX = 96
"""Longest side of the coarse picture between the corners."""

MARGIN = 0.15
"""Of the longest side: how far beyond the edge the coarse picture looks."""

DOUBLED = 2
"""The coarse picture is looked up so many times finer and averaged, or thin lines would flicker."""

NEARER_M = 0.03
"""Distance in m in front of a surface below which something lies on it."""

SOLID = 0.3
"""Alpha from which a drawn object hides what is behind it."""

MIN_OUTSIDE_PX = 4
"""Coarse pixels that a change must have beyond the edge to count as coming from there."""

LEARNED_PER_FRAME = 0.15
"""How fast what is expected follows what is seen."""

SETTLED_S = 8.0
"""Time in which something that hides a surface and keeps still becomes part of it: a poster."""

SAME_COLOUR = 0.04
"""Of a 0..1 channel: less is no motion."""

LARGEST_GAIN = 1.6
"""Exposure that changes by more than this from frame to frame is rejected."""


@dataclass(frozen=True, slots=True, eq=False)
class Occluders:
    """Objects known to be in front of surfaces.

    Attributes:
        layers: per lens, the tracked objects as they are drawn into it; empty if none are tracked.
        background: the empty room from the camera's place; without them, a surface is taken to be
            free in the first frame that shows it.
    """

    layers: tuple[Sequence[Layer], ...] = ()
    background: BackgroundImages | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePicture:
    """Picture of a live surface at one frame.

    Attributes:
        surface_id: which surface.
        t_ns: capture time of the frame.
        picture: (H, W, 3) uint8 RGB, the surface without what is in the way.
        fresh: (H, W) bool, the pixels that this frame gave; the others are older, or show what is
            in the way where the surface was never seen, or are black where no lens looks.
        lens: index of the lens that gives most of it; None if no lens sees it.
    """

    surface_id: str
    t_ns: int
    picture: NDArray[np.uint8]
    fresh: BoolArray
    lens: int | None


@dataclass(frozen=True, slots=True, eq=False)
class _Expected:
    """Coarse picture expected of a surface when nothing is in the way.

    Attributes:
        picture: (h, w, 3) float32 0..1.
        known: (h, w) bool.
        restless: (h, w) float32, how much it changes by itself: a film plays.
        before: (h, w, 3) float32, what each pixel has shown since `still_since_ns`.
        still_since_ns: (h, w) int64 times.
    """

    picture: FloatArray
    known: BoolArray
    restless: FloatArray
    before: FloatArray
    still_since_ns: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class _Memory:
    """One surface from frame to frame.

    Attributes:
        surface: where it is.
        world_from_rig: where the camera was for the tables.
        fine: table of the picture.
        coarse: table of the coarse picture and its margin, finer by `DOUBLED`.
        visible: (h, w) bool, what the coarse picture shows.
        inner: the part of the coarse picture that is between the corners.
        expected: what the coarse picture should show; None before the first frame.
        picture: (H, W, 3) as last published.
        clean: (H, W) bool, the pixels that were fresh at least once.
    """

    surface: LiveSurface
    world_from_rig: Pose
    fine: SurfaceView
    coarse: SurfaceView
    visible: BoolArray
    inner: tuple[slice, slice]
    expected: _Expected | None
    picture: NDArray[np.uint8]
    clean: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class SurfacesState:
    """State of the surfaces between frames, by id."""

    memories: Mapping[str, _Memory] = field(default_factory=lambda: MappingProxyType({}))


def step(
    state: SurfacesState,
    frame: Frame,
    surfaces: Sequence[LiveSurface],
    world_from_rig: Pose,
    occluders: Occluders | None = None,
) -> tuple[SurfacesState, tuple[SurfacePicture, ...]]:
    """The pictures of all live surfaces at one frame.

    Args:
        state: after the frame before; surfaces may come, go and move between frames.
        frame: pictures of all lenses; surfaces of other streams are left out.
        surfaces: of the session.
        world_from_rig: the camera's pose, best the refined one (`TrackOutput.world_from_rig`).
        occluders: what is known to be in front.

    Raises:
        ValueError: a surface's corners span no flat convex quad.
    """
    known = occluders or Occluders()
    memories: dict[str, _Memory] = {}
    pictures: list[SurfacePicture] = []
    for surface in surfaces:
        if surface.stream_id != frame.stream_id:
            continue
        memory = _looking(state.memories.get(surface.surface_id), surface, frame, world_from_rig)
        memory, fresh = _seen(memory, frame, known)
        memories[surface.surface_id] = memory
        lens = memory.fine.tables[0].lens if memory.fine.tables else None
        pictures.append(SurfacePicture(surface.surface_id, frame.t_ns, memory.picture, fresh, lens))
    return SurfacesState(MappingProxyType(memories)), tuple(pictures)


def _looking(
    memory: _Memory | None, surface: LiveSurface, frame: Frame, world_from_rig: Pose
) -> _Memory:
    """The memory with tables for where surface and camera are now.

    Pictures are in the surface's own pixels, so they outlive the camera's moves.
    """
    if memory is not None and _is_same(memory.surface, surface):
        if memory.world_from_rig is world_from_rig or np.array_equal(
            memory.world_from_rig.matrix(), world_from_rig.matrix()
        ):
            return memory
        expected, picture, clean = memory.expected, memory.picture, memory.clean
    else:
        expected = None
        picture = np.zeros((surface.size_px[1], surface.size_px[0], 3), np.uint8)
        clean = np.zeros(picture.shape[:2], bool)
    quad = quad_of(surface.corners_in_world)
    width, height = surface.size_px
    shrink = min(1.0, COARSE_SIDE_PX / max(width, height))
    inner = (max(4, round(shrink * width)), max(4, round(shrink * height)))
    margin = max(2, round(MARGIN * max(inner)))
    doubled = (DOUBLED * inner[0], DOUBLED * inner[1])
    fine = surface_view(quad, frame.rig, world_from_rig, surface.size_px)
    around = (DOUBLED * margin, DOUBLED * margin)
    coarse = surface_view(quad, frame.rig, world_from_rig, doubled, margin_px=around)
    part = (slice(margin, margin + inner[1]), slice(margin, margin + inner[0]))
    visible = _any_of_four((~coarse.seen).astype(np.uint8)) == 0
    return _Memory(surface, world_from_rig, fine, coarse, visible, part, expected, picture, clean)


def _is_same(first: LiveSurface, second: LiveSurface) -> bool:
    return first is second or (
        first.size_px == second.size_px
        and bool(np.array_equal(first.corners_in_world, second.corners_in_world))
    )


def _seen(memory: _Memory, frame: Frame, known: Occluders) -> tuple[_Memory, BoolArray]:
    """The memory after a frame, and the (H, W) pixels that the frame gave."""
    live = memory.fine.picture(frame.images)
    coarse = _halved(memory.coarse.picture(frame.images))
    expected = memory.expected or _at_first(memory, frame, known.background, coarse)
    covered = _covered(memory, known)
    changed, likely = _changed(coarse, expected, memory.visible & ~covered)
    hidden = covered | _reaching_in(changed, memory.inner)
    fresh = memory.fine.seen & ~_at_full_size(hidden[memory.inner], memory.surface.size_px)
    picture = live
    clean = memory.clean | fresh
    if not fresh.all():
        # Somebody in the way is better than nothing at all.
        kept = memory.clean & ~fresh
        picture = np.where(kept[..., None], memory.picture, live)
    outside = np.ones(changed.shape, bool)
    outside[memory.inner] = False
    believed = memory.visible & ~hidden & ~(changed & outside)
    following = _learned(expected, likely, believed, covered=covered, t_ns=frame.t_ns)
    return replace(memory, expected=following, picture=picture, clean=clean), fresh


def _at_first(
    memory: _Memory, frame: Frame, background: BackgroundImages | None, coarse: FloatArray
) -> _Expected:
    """Picture expected before the first frame: the scanned room, or else the frame itself."""
    restless = np.zeros(memory.visible.shape, np.float32)
    since = np.full(memory.visible.shape, frame.t_ns, np.int64)
    if background is None:
        return _Expected(coarse, memory.visible, restless, coarse, since)
    pictures: list[NDArray[np.uint8]] = []
    for index, lens in enumerate(frame.rig.lenses):
        exposure = fit_exposure(
            frame.images[index], background.images[index], background.coverage[index]
        )
        x = (np.arange(lens.width_px, dtype=np.float32) + 0.5) / lens.width_px * 2 - 1
        y = (np.arange(lens.height_px, dtype=np.float32) + 0.5) / lens.height_px * 2 - 1
        radius2 = np.asarray(x[None, :] ** 2 + y[:, None] ** 2, dtype=np.float32)
        drawn = expose(background.images[index].whole(), exposure, radius2=radius2)
        pictures.append((255.0 * np.clip(drawn, 0, 1) + 0.5).astype(np.uint8))
    picture = _halved(memory.coarse.picture(tuple(pictures)))
    return _Expected(picture, memory.visible, restless, coarse, since)


def _covered(memory: _Memory, known: Occluders) -> BoolArray:
    """(h, w) coarse pixels where a tracked object is nearer than the surface."""
    if not any(known.layers):
        return np.zeros(memory.visible.shape, bool)
    hidden = np.zeros(memory.coarse.seen.shape, np.uint8)
    for table in memory.coarse.tables:
        for layer in known.layers[table.lens]:
            corner = np.array([layer.left, layer.top], dtype=np.float32)
            x, y = cv2.split(table.map_xy - corner)
            solid = np.where(layer.alpha > SOLID, layer.range_m, np.float32(0))
            range_m = cv2.remap(solid, x, y, cv2.INTER_NEAREST, borderValue=0)
            nearer = (range_m > 0) & (range_m < table.range_m - NEARER_M)
            hidden |= (nearer & table.taken).astype(np.uint8)
    return cv2.dilate(_any_of_four(hidden), _square(3)) > 0


def _changed(
    coarse: FloatArray, expected: _Expected, compared: BoolArray
) -> tuple[BoolArray, FloatArray]:
    """(h, w) where the picture is not what was expected, and the picture at its exposure."""
    usable = compared & expected.known
    if not usable.any():
        return np.zeros(compared.shape, bool), coarse
    before, now = expected.picture[usable], coarse[usable]
    gain = np.median((before + 0.02) / (now + 0.02), axis=0)
    believed = ((gain > 1 / LARGEST_GAIN) & (gain < LARGEST_GAIN)).all()
    likely = coarse * gain.astype(np.float32) if believed else coarse
    gx, gy = slopes(grey(expected.picture))
    steep = np.float32(LEARNING.misalignment_px) * np.hypot(gx, gy)
    noise = np.sqrt(LEARNING.noise_floor**2 + steep**2 + expected.restless**2).astype(np.float32)
    probability = difference(likely, expected.picture, noise).probability
    changed = ((probability > 0.5) & usable).astype(np.uint8)
    return cv2.morphologyEx(changed, cv2.MORPH_OPEN, _square(2)) > 0, likely


def _reaching_in(changed: BoolArray, inner: tuple[slice, slice]) -> BoolArray:
    """Changes inside that hang together with changes beyond the edge, a pixel wider."""
    count, labels = cv2.connectedComponents(changed.astype(np.uint8), connectivity=8)
    beyond = labels.copy()
    beyond[inner] = 0
    outside_px = np.bincount(beyond.ravel(), minlength=count)
    from_beyond = outside_px >= MIN_OUTSIDE_PX
    from_beyond[0] = False
    hiding = np.take(from_beyond, np.asarray(labels, dtype=np.intp))
    return cv2.dilate(hiding.astype(np.uint8), _square(3)) > 0


def _learned(
    expected: _Expected,
    likely: FloatArray,
    believed: BoolArray,
    *,
    covered: BoolArray,
    t_ns: int,
) -> _Expected:
    """Update the picture that is expected of the next frame."""
    moved = np.abs(likely - expected.before).max(axis=2) > SAME_COLOUR
    since = np.where(moved | covered, np.int64(t_ns), expected.still_since_ns)
    settled = expected.known & (t_ns - since > SETTLED_S * 1e9)
    at_once = settled | ~expected.known
    rate = np.where(at_once, np.float32(1.0), np.float32(LEARNED_PER_FRAME))
    rate = np.where(believed | settled, rate, np.float32(0.0))
    apart = likely - expected.picture
    step_of = np.sqrt(np.einsum("hwc,hwc->hw", apart, apart) / 3.0)
    moving = np.where(expected.known, step_of, 0.0) - expected.restless
    return _Expected(
        (expected.picture + rate[..., None] * apart).astype(np.float32),
        expected.known | believed,
        (expected.restless + np.where(believed, LEARNED_PER_FRAME, 0.0) * moving).astype(
            np.float32
        ),
        np.where(moved[..., None], likely, expected.before).astype(np.float32),
        since,
    )


def _at_full_size(hidden: BoolArray, size_px: tuple[int, int]) -> BoolArray:
    if not hidden.any():
        return np.zeros((size_px[1], size_px[0]), bool)
    return cv2.resize(hidden.astype(np.uint8), size_px, interpolation=cv2.INTER_NEAREST) > 0


def _halved(picture: NDArray[np.uint8]) -> FloatArray:
    """A doubled coarse picture, averaged; float32 0..1."""
    size = (picture.shape[1] // DOUBLED, picture.shape[0] // DOUBLED)
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return small.astype(np.float32) / np.float32(255)


def _any_of_four(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Coarse pixels of which a part is set."""
    upper, lower = mask[0::DOUBLED], mask[1::DOUBLED]
    either = upper | lower
    return np.ascontiguousarray(either[:, 0::DOUBLED] | either[:, 1::DOUBLED])


def _square(side: int) -> NDArray[np.uint8]:
    return np.ones((side, side), np.uint8)
