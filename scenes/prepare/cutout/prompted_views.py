"""From what a person marks in views of a room to masks, with the room's shape to help.

Colour alone takes the floor between a stool's legs for the stool. Where the splats lie says better
what cannot be the thing: what lies in the level plane around it and looks like it, and what is seen
in its box in one view but lies outside its box in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.lifting import MaskedView
from scenes.prepare.cutout.masks import Masks, Prompt
from scenes.prepare.cutout.silhouettes import in_box, points_drawn
from scenes.prepare.cutout.support import LevelPlane, levels, on_planes
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Rendering
from scenes.splats import SplatCloud

AROUND = 0.4
"""Of a box's size: how far around it the plane that the thing stands on is looked for."""
LEAST_MASK = 0.1
"""Of what may be the thing by the room's shape: a smaller mask was not found but lost."""
PLAIN_COLOUR, SHADOW, GLOSS = 12.0, 45.0, 15.0
"""How far, in CIELAB, the hue of a thing in a plane may be from the plane's, and how much darker or
lighter it may be: a book is no thicker than the splats of the table under it are blurred."""
PLANE_SAMPLES, COMMON = 500, 0.1
"""A hue counts as the plane's if so much of it has the like: not a sheet of paper on the table."""
FAR_OUTSIDE = 0.1
"""Of a box's size: what lies so far outside another view's box is not the thing."""


@dataclass(frozen=True, slots=True, eq=False)
class PromptedView:
    """A view of the room in which somebody marked one thing.

    Attributes:
        name: of the view, for messages.
        camera: its lens.
        world_from_camera: its pose.
        prompt: what was marked.
        picture: (H, W, 3) the photo taken there, or None to look at the splats instead.
    """

    name: str
    camera: Pinhole | Fisheye
    world_from_camera: Pose
    prompt: Prompt
    picture: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        wanted = (self.camera.height_px, self.camera.width_px, 3)
        if self.picture is not None and self.picture.shape != wanted:
            raise ValueError(
                f"view {self.name}: a picture of {self.picture.shape}, wanted {wanted}"
            )


def masked_views(
    cloud: SplatCloud, views: Sequence[PromptedView], *, masks: Masks, renderer: NativeRenderer
) -> tuple[MaskedView, ...]:
    """The thing's mask in each view.

    Args:
        cloud: the whole room, metres, Z up.
        views: where it was marked.
        masks: finds it in a picture.
        renderer: draws the room.

    Raises:
        ValueError: a prompt lies outside its view.
    """
    masked = []
    for view in views:
        drawing = renderer.render(
            [PosedSplats(cloud, Pose.identity())], view.camera, view.world_from_camera
        )
        others = [other for other in views if other is not view and other.prompt.box_px is not None]
        picture = _as_picture(drawing) if view.picture is None else view.picture
        background = _known_background(view, drawing, picture, others)
        mask = masks.mask(picture, view.prompt, background)
        if view.prompt.box_px is not None:
            possible = _within(view.prompt.box_px, mask.shape) & ~background
            if mask.sum() < LEAST_MASK * possible.sum():
                # The room's shape may be wrong where the splats are hazy.
                mask = masks.mask(picture, view.prompt)
            if mask.sum() < LEAST_MASK * possible.sum():
                # Colours tell nothing apart here; the room's shape still may.
                mask = possible
        masked.append(
            MaskedView(
                view.name,
                view.camera,
                view.world_from_camera,
                mask,
                view.prompt.box_px,
                view.prompt.inside_px,
            )
        )
    return tuple(masked)


def _within(box_px: tuple[float, float, float, float], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(H, W) pixels whose centre lies in the box."""
    left, top, right, bottom = box_px
    row, column = np.ogrid[: shape[0], : shape[1]]
    across = (column + 0.5 > left) & (column + 0.5 < right)
    return across & (row + 0.5 > top) & (row + 0.5 < bottom)


def drawn_picture(
    cloud: SplatCloud, view: PromptedView, renderer: NativeRenderer
) -> NDArray[np.uint8]:
    """(H, W, 3) what the splats look like from there."""
    posed = [PosedSplats(cloud, Pose.identity())]
    return _as_picture(renderer.render(posed, view.camera, view.world_from_camera))


def _as_picture(drawing: Rendering) -> NDArray[np.uint8]:
    return (np.clip(drawing.rgb, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _known_background(
    view: PromptedView,
    drawing: Rendering,
    picture: NDArray[np.uint8],
    others: Sequence[PromptedView],
) -> NDArray[np.bool_]:
    """(H, W) True where the splats show something that cannot be the thing."""
    background = np.zeros(drawing.depth.shape, dtype=bool)
    if view.prompt.box_px is None:
        return background
    width, height = view.camera.width_px, view.camera.height_px
    left, top, right, bottom = view.prompt.box_px
    across, down = AROUND * (right - left), AROUND * (bottom - top)
    x0, y0 = int(max(left - across, 0)), int(max(top - down, 0))
    x1, y1 = int(min(right + across, width)), int(min(bottom + down, height))
    if x1 - x0 < 2 or y1 - y0 < 2:
        return background
    x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    points, drawn = points_drawn(view.camera, view.world_from_camera, drawing.depth, pixels)
    inner = (x.ravel() > left) & (x.ravel() < right) & (y.ravel() > top) & (y.ravel() < bottom)
    beside = points[drawn & ~inner]
    planes: tuple[LevelPlane, ...] = levels(beside[:, 2], np.ones(len(beside)))
    known = on_planes(points, planes)
    colours = picture[y0:y1, x0:x1].reshape(-1, 3)
    known[inner] &= looks_like(colours[inner], colours[known & drawn & ~inner])
    for other in others:
        assert other.prompt.box_px is not None
        known |= ~in_box(
            points, other.camera, other.world_from_camera, other.prompt.box_px, FAR_OUTSIDE
        )
    known &= drawn
    # Single pixels come from noise of the splats; an outline drawn by them would be ragged.
    patch = known.reshape(y1 - y0, x1 - x0).astype(np.uint8)
    background[y0:y1, x0:x1] = cv2.morphologyEx(patch, cv2.MORPH_OPEN, np.ones((3, 3))) > 0
    return background


def looks_like(colours: NDArray[np.uint8], surface: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(N,) whether RGB colours may be those of a surface, in light or in shadow.

    Args:
        colours: (N, 3) in question.
        surface: (M, 3) seen on it.
    """
    if not len(colours) or not len(surface):
        return np.ones(len(colours), dtype=bool)
    asked = cv2.cvtColor(colours[None].astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[0]
    known = cv2.cvtColor(surface[None].astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[0]
    known = known[:: max(1, len(known) // PLANE_SAMPLES)]
    like = max(1, round(COMMON * len(known)))
    hue, _ = KDTree(known[:, 1:]).query(asked[:, 1:], k=like)
    darkest, lightest = np.quantile(known[:, 0], (COMMON, 1 - COMMON))
    lit = (asked[:, 0] > darkest - SHADOW) & (asked[:, 0] < lightest + GLOSS)
    return lit & (hue.reshape(len(asked), like)[:, -1] < PLAIN_COLOUR)
