"""Model of a tracked object, made from its splats once per session."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tracking.model.colours import ANY_LIGHT_FACTORS, ColourModel
from tracking.model.relighting import RELIGHTING, RelightableModel, relightable_of
from tracking.model.symmetry import are_same, nats_of_turns, symmetry_of
from tracking.model.templates import (
    ELEVATIONS_RAD,
    HALF_WIDTH,
    Templates,
    drawn_around,
    templates_of,
)

COARSEST_PX = 12.0
"""Radius in px for which the coarsest level is made: what is smaller is drawn with it, too."""

STEP = math.sqrt(2.0)
"""Factor between the radii of two levels: no level has more than twice the splats it needs."""

LEVELS = 5
"""Merged levels, up to `COARSEST_PX * STEP**4` = 48 px; from there on single splats are a pixel."""


@dataclass(frozen=True, slots=True, eq=False)
class DetailLevel:
    """An object's splats for pictures up to some size.

    At twenty pixels the splats of a scan are finer than a pixel, and drawing them all is most of
    what a search takes. Where splats that share a pixel are merged, the likelihood of a pose
    changes by a third of a nat at most, and takes a third of the time (measured on a book, a mug
    and a box).

    Attributes:
        max_radius_px: radius of the object in a picture up to which splats are merged by less than
            a pixel; inf for the scan itself.
        splats: in the object's frame.
        relightable: the same for any light.
    """

    max_radius_px: float
    splats: SplatCloud
    relightable: RelightableModel


def detail_levels_of(source: ObjectModel, radius_m: float) -> tuple[DetailLevel, ...]:
    """Levels of an object, the coarsest first, the scan itself last.

    Args:
        source: the scanned object.
        radius_m: of the sphere around it.
    """
    whole = DetailLevel(math.inf, source.splats, relightable_of(source))
    levels = [whole]
    for step in reversed(range(LEVELS)):
        radius_px = COARSEST_PX * STEP**step
        splats = merged(levels[0].splats, radius_m / radius_px)
        relightable = relightable_of(replace(source, splats=splats, coverage=None))
        levels.insert(0, DetailLevel(radius_px, splats, relightable))
    return tuple(levels)


RENDER_OPTIONS = RenderOptions(threads=1, antialias=True)
"""How model pictures are drawn: one thread, since a crop is small."""

TEXTURED_VARIATION = 0.1
"""Standard deviation of fine inner colour structure, 0..1, above which an object is textured."""

TURN_SIDE_PX = 48
"""Side, px, of the pictures in which an object is compared with itself turned: about as large as it
is aligned at in a search."""

TURN_ELEVATIONS_RAD = (0.25, 0.75)
"""Above the horizon, rad: a chair across the room, and a book on a table."""

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""(8, 3) of a box from its middle, in halves of its sides."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackModel:
    """An object, ready to be tracked.

    Attributes:
        source: the scanned object.
        colours: what its pixels look like where it was scanned.
        colours_in_any_light: the same anywhere in a room.
        centre_m: (3,) centre of its box in its own frame.
        radius_m: of the sphere around that centre which holds it.
        symmetry: number of indistinguishable yaws in a turn: 1 none, n-fold, or `ROUND`.
        turn_nats: (Y,) nats a pixel by which it looks different after each step of a turn.
        textured: whether its inner picture is rich enough to identify it.
        templates: what it looks like from afar.
        levels: its splats for pictures of it, small ones first.
    """

    source: ObjectModel
    colours: ColourModel
    colours_in_any_light: ColourModel
    centre_m: NDArray[np.float64]
    radius_m: float
    symmetry: int
    turn_nats: NDArray[np.float64]
    textured: bool
    templates: Templates
    levels: tuple[DetailLevel, ...]

    @property
    def object_id(self) -> str:
        """Of the scanned object."""
        return self.source.object_id

    def centre_at(self, world_from_object: Pose) -> NDArray[np.float64]:
        """(3,) centre of the object in the world at a pose."""
        return world_from_object @ self.centre_m

    @property
    def corners_m(self) -> NDArray[np.float64]:
        """(8, 3) corners of the object's box in its own frame."""
        return self.centre_m + 0.5 * CORNERS * np.array(self.source.box_m)

    def box_at(self, world_from_object: Pose) -> NDArray[np.float64]:
        """(8, 3) corners of the object's box in the world at a pose."""
        return world_from_object @ self.corners_m

    def are_same(self, turn_rad: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,) whether turns about up (rad) leave it looking the same."""
        return are_same(self.turn_nats, turn_rad)

    def level_for(self, radius_px: float) -> DetailLevel:
        """Its splats for a picture in which its sphere has a radius in px."""
        return next(level for level in self.levels if radius_px <= level.max_radius_px)

    def splats_at(self, world_from_object: Pose) -> PosedSplats:
        """The object's splats at a pose, for a renderer."""
        return PosedSplats(self.source.splats, world_from_object)


def make_model(source: ObjectModel, renderer: Renderer) -> TrackModel:
    """Colours, extent and symmetry of a scanned object, from pictures all around it."""
    centre = np.array([0.0, 0.0, 0.5 * source.box_m[2]])
    radius = 0.5 * float(np.linalg.norm(source.box_m))
    around = [
        drawn_around(source.splats, renderer, centre, radius, elevation)
        for elevation in ELEVATIONS_RAD
    ]
    pictures = around[1]
    shown = shown_colours(pictures)
    levels = detail_levels_of(source, radius)
    turn_nats = _turn_nats(levels, renderer, centre, radius)
    return TrackModel(
        source=source,
        colours=ColourModel.of_pixels(shown),
        colours_in_any_light=ColourModel.of_pixels(shown, ANY_LIGHT_FACTORS),
        centre_m=centre,
        radius_m=radius,
        symmetry=symmetry_of(turn_nats),
        turn_nats=turn_nats,
        textured=_is_textured(pictures),
        templates=templates_of(around),
        levels=levels,
    )


def shown_colours(pictures: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, 3) colours of an object in (V, H, W, 4) pictures; black if it shows nowhere."""
    shown = pictures[pictures[..., 3] > 0.6]
    return shown[:, :3] / shown[:, 3:] if len(shown) else np.zeros((1, 3), np.float32)


def _is_textured(pictures: NDArray[np.float32]) -> bool:
    """Whether colours vary a lot inside the silhouette, from one place to the next."""
    variations: list[float] = []
    for picture in pictures[::4]:
        inner = cv2.erode((picture[..., 3] > 0.95).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        if inner.sum() > 20:
            smooth = np.asarray(cv2.GaussianBlur(picture[..., :3], (0, 0), 4.0), np.float32)
            detail = picture[..., :3] - smooth
            variations.append(float(np.sqrt((detail[inner] ** 2).mean())))
    return bool(variations) and float(np.mean(variations)) > TEXTURED_VARIATION


def _turn_nats(
    levels: Sequence[DetailLevel], renderer: Renderer, centre: NDArray[np.float64], radius_m: float
) -> NDArray[np.float64]:
    """`nats_of_turns` of an object seen from low and from high."""
    radius_px = 0.5 * TURN_SIDE_PX / HALF_WIDTH
    level = next(level for level in levels if radius_px <= level.max_radius_px)
    drawn = [
        np.stack(
            [
                drawn_around(splats, renderer, centre, radius_m, elevation, side_px=TURN_SIDE_PX)
                for elevation in TURN_ELEVATIONS_RAD
            ]
        )
        for splats in (level.splats, level.relightable.compass)
    ]
    known = drawn[1][..., 3:]
    facing = (2.0 * drawn[1][..., :3] / np.maximum(known, 1e-3) - 1.0) * (known > RELIGHTING.seen)
    return nats_of_turns(drawn[0], facing.astype(np.float32), radius_px=radius_px)
