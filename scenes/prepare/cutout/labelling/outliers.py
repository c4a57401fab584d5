"""Splats that hang in the air beside an object and were found with it.

What stands above the ground inside all boxes is taken for the object, whatever the masks say, for
masks lose legs. So is what a trained room leaves hanging a few centimetres above its floor. Masks
that show it beside the object decide, where it has the ground's colours too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.colour_similarity import log_likelihood_ratio
from scenes.prepare.cutout.labelling.above_ground import above_and_ground
from scenes.prepare.cutout.votes.lifting import FULL_SIGHT, Vote, inside_share
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

BESIDE = 0.2
"""Share of a splat's light inside the masks below which they show it beside the object."""
PLAINLY = 2
"""How many views have to see it for that."""
MAX_OUTLIER_SHARE = 0.1
"""Of the object's opacity: where more lies beside its masks, they have lost a part of it."""


def outliers(
    cloud: SplatCloud, labels: BoolArray, votes: Sequence[Vote], *, in_boxes: BoolArray
) -> BoolArray:
    """(N,) the labelled splats that hang beside the object; none where masks are not to be trusted.

    Args:
        cloud: the whole room, metres, Z up.
        labels: (N,) the object's splats.
        votes: of the masks in the photos that were marked.
        in_boxes: (N,) what lies in all boxes that were drawn.
    """
    none = np.zeros(len(cloud), dtype=bool)
    plainly = np.sum([vote.seen > FULL_SIGHT for vote in votes], axis=0) >= PLAINLY
    beside = labels & plainly & (inside_share(votes) < BESIDE)
    if not beside.any():
        return none
    above, ground = above_and_ground(cloud, labels, in_boxes)
    near = np.flatnonzero(labels | ground)
    like, unlike = (labels & ~beside & above)[near], ground[near]
    ratio = log_likelihood_ratio(cloud.colours()[near], like=like, unlike=unlike)
    beside[near] &= ratio < 0
    much = cloud.opacities[beside].sum() > MAX_OUTLIER_SHARE * cloud.opacities[labels].sum()
    return none if much else beside
