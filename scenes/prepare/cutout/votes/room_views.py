# pyright: standard
"""A first guess of an object's splats, held against every view of the room that shows the object.

A splat of a trained room need not lie on the surface that it paints, and faint ones fill the air.
Where its light falls decides: the guess is drawn as a silhouette in many views, a splat is
the object's if most of its light falls into the silhouettes, and the next silhouettes are drawn
from those. The light of a faint splat says little: most of what is drawn where it is seen comes
from others. It goes with the surface that it hangs at, the object's or another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.package.records import ViewPoint
from scenes.prepare.cutout.votes.cropped_views import (
    CloseView,
    close_views,
    evenly,
    light_in_masks,
)
from scenes.prepare.cutout.votes.framed import framed
from scenes.prepare.cutout.votes.lifting import share
from scenes.prepare.cutout.votes.seen_surface import seen_surface
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

MAX_VIEWS = 16
"""Views that vote, evenly out of those that frame the object."""
MIN_VIEWS = 3
"""Views below which none vote."""
ROUNDS = 2
"""Rounds in which silhouettes of the last labels vote for the next."""
MIN_PX = 60
"""A smaller silhouette says nothing."""
SEEN_PX = 0.5
"""Light, in pixels of all views, below which a splat is seen in none."""
BARELY = 0.25
"""Of the light that a splat of the guess typically has: so much has to fall outside the
silhouettes to take a hidden splat away. Light leaks between the splats of a wall and along its
foot, and what it shows of undersides falls outside as often as inside."""
FAINT = 0.3
"""Opacity below which a splat follows the surface beside it."""
UNSURE = 0.2
"""How near to half a splat's light may lie inside the silhouettes to do so too: many of a leg's lie
on its outline."""
BESIDE_M = 0.03
"""How far from a surface a splat may hang to follow it."""
MAJORITY = 0.5
"""Share of a splat's light inside the silhouettes from which on it is the object's."""


def held_against_views(
    cloud: SplatCloud,
    guess: BoolArray,
    within: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    hidden: BoolArray,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the object's splats by where their light falls; the guess where too few views show it.

    Args:
        cloud: the whole room, metres.
        guess: (N,) a first idea of the object's splats.
        within: (N,) the splats that may be the object's.
        viewpoints: of the room; those that frame the object are used, evenly chosen.
        hidden: (N,) what the splats are that no view shows; where True, barely shown ones too.
        renderer: draws the room.
    """
    solid = guess & (cloud.opacities >= FAINT)
    framing = close_views(viewpoints, cloud.means[solid].astype(np.float64))
    if len(framing) < MIN_VIEWS:
        return guess | hidden
    views = evenly(framing, MAX_VIEWS)
    labels = guess
    share_inside, seen = np.zeros((2, len(cloud)))
    for _ in range(ROUNDS):
        inside, seen = _light(cloud, labels, views, renderer)
        held = BARELY * float(np.median(seen[guess])) if guess.any() else 0.0
        share_inside = (inside + held * hidden) / np.maximum(seen + held * hidden, 1e-9)
        labels = (within | hidden) & (share_inside > MAJORITY)
    unsure = np.abs(share_inside - MAJORITY) < UNSURE
    follows = within & ((cloud.opacities < FAINT) | unsure) & (seen > SEEN_PX)
    surface = seen_surface(cloud, labels, viewpoints, renderer=renderer)
    if not len(surface.own) or not len(surface.around):
        return labels
    at = cloud.means[follows].astype(np.float64)
    to_object, _ = KDTree(surface.own).query(at, workers=-1)
    to_rest, _ = KDTree(surface.around).query(at, workers=-1)
    labels[follows] = (to_object < to_rest) & (to_object < BESIDE_M)
    return labels


def painting(
    cloud: SplatCloud,
    labels: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the splats most of whose light falls into the labelled splats' silhouettes."""
    framing = close_views(viewpoints, cloud.means[labels].astype(np.float64))
    inside, seen = _light(cloud, labels, evenly(framing, MAX_VIEWS), renderer)
    return inside > MAJORITY * np.maximum(seen, 1e-9)


def _light(
    cloud: SplatCloud, labels: BoolArray, views: Sequence[CloseView], renderer: NativeRenderer
) -> tuple[FloatArray, FloatArray]:
    """(N,) each splat's light inside the labelled splats' silhouettes, and all of it.

    In pixels of the views as they were before they were cropped.
    """

    def silhouettes() -> Iterator[tuple[CloseView, BoolArray]]:
        for view in views:
            shown = framed(cloud, view.camera, view.world_from_camera)
            drawn = share(
                cloud.select(shown),
                labels[shown],
                view.camera,
                view.world_from_camera,
                renderer=renderer,
            )
            mask = drawn > MAJORITY
            if mask.sum() >= MIN_PX:
                yield view, mask

    return light_in_masks(cloud, silhouettes(), renderer=renderer)
