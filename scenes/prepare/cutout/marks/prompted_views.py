"""From what a person marks in views of a room to masks.

The photo alone decides. The room's shape is heeded later, splat by splat: as a hint in the picture
it took a book's edges and a box's lower half for the table that they lie on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.marks.masks import Masks, Prompt
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

MIN_MASK_SHARE = 0.1
"""Of a box: a smaller mask was not found but lost."""


@dataclass(frozen=True, slots=True, eq=False)
class PromptedView:
    """A view of the room in which somebody marked one object.

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
    """The object's mask in each view.

    Args:
        cloud: the whole room, metres, Z up.
        views: where it was marked.
        masks: finds it in a picture.
        renderer: draws the room.

    Raises:
        ValueError: a prompt lies outside its view.
    """
    return tuple(_mask(cloud, view, masks, renderer) for view in views)


def _mask(
    cloud: SplatCloud, view: PromptedView, masks: Masks, renderer: NativeRenderer
) -> MaskedView:
    picture = drawn_picture(cloud, view, renderer) if view.picture is None else view.picture
    prompt = view.prompt
    mask = masks.mask(picture, prompt)
    if prompt.box_px is not None:
        box = _within(prompt.box_px, mask.shape)
        if mask.sum() < MIN_MASK_SHARE * box.sum():
            # Colours separate nothing here; the box still says where.
            mask = box
    return MaskedView(
        view.name, view.camera, view.world_from_camera, mask,
        prompt.box_px, prompt.inside_px, prompt.outside_px,
    )  # fmt: skip


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
    drawing = renderer.render(posed, view.camera, view.world_from_camera)
    return (np.clip(drawing.rgb, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
