"""A first guess of a thing's splats, held against every view of the room that shows the thing.

A splat of a trained room need not lie on the surface that it paints, and faint ones fill the air.
What tells is where its light falls: the guess is drawn as a silhouette in many views, a splat is
the thing's if most of its light falls into the silhouettes, and the next silhouettes are drawn from
those. Haze between a chair's legs is seen against the floor in most views, and leaves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.package_records import ViewPoint
from scenes.prepare.cutout.lifting import MaskedView, lift, share
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

MOST_VIEWS = 14
LEAST_VIEWS = 3
ROUNDS = 2
FRAMED = 0.95
"""Of the guess: what a view has to frame to speak."""
LEAST_PX = 100
"""A smaller silhouette says nothing."""
BARELY = 0.25
"""Of the light that a splat of the guess typically has: so much has to fall outside the
silhouettes to take a hidden splat away. Light leaks between the splats of a wall and along its
foot, and what it shows of undersides falls outside as often as inside."""
MAJORITY = 0.5


def held_against_views(
    cloud: SplatCloud,
    guess: BoolArray,
    within: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    hidden: BoolArray,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the thing's splats by where their light falls; the guess where too few views show it.

    Args:
        cloud: the whole room, metres.
        guess: (N,) a first idea of the thing's splats.
        within: (N,) the splats that may be the thing's.
        viewpoints: of the room; those that frame the thing are used, evenly chosen.
        hidden: (N,) what the splats are that no view shows; where True, barely shown ones too.
        renderer: draws the room.
    """
    points = cloud.means[guess].astype(np.float64)
    framing = [view for view in viewpoints if len(points) and _framed(view, points) >= FRAMED]
    if len(framing) < LEAST_VIEWS:
        return guess | hidden
    picks = np.linspace(0, len(framing) - 1, min(MOST_VIEWS, len(framing))).round().astype(int)
    labels = guess
    for _ in range(ROUNDS):
        inside, seen = np.zeros((2, len(cloud)))
        for pick in picks:
            view = framing[pick]
            drawn = share(cloud, labels, view.camera, view.world_from_camera, renderer=renderer)
            mask = drawn > MAJORITY
            if mask.sum() < LEAST_PX:
                continue
            masked = MaskedView(view.name, view.camera, view.world_from_camera, mask)
            vote = lift(cloud, masked, renderer=renderer)
            inside += vote.inside
            seen += vote.seen
        held = BARELY * float(np.median(seen[guess])) if guess.any() else 0.0
        share_inside = (inside + held * hidden) / np.maximum(seen + held * hidden, 1e-9)
        labels = (within | hidden) & (share_inside > MAJORITY)
    return labels


def _framed(view: ViewPoint, points: NDArray[np.float64]) -> float:
    """Share of world points (N, 3) that the view frames."""
    _, valid = view.camera.project(view.world_from_camera.inverse() @ points)
    return float(valid.mean())
