"""Ways to cut an object out, each a function of the capture and the marks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cutouts import overlap
from benchmarks.evaluate.cuts.captures import Capture
from scenes.package import ScenePackage
from scenes.prepare.cutout.cutout import Cutout, cut_marked, make_object
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.marks.prompted_views import PromptedView
from scenes.prepare.cutout.proposals import Proposal, propose
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

OBJECT_ID = "cut"
"""Every object is cut from the room as it was prepared, so that none is in another's way."""


@dataclass(frozen=True, slots=True, eq=False)
class Cutting:
    """An object as a cut made it.

    Attributes:
        labels: (N,) the room's splats that became the object's.
        gone: (N,) the room's splats that left the room, those and stray ones.
        splats: the object's, in world metres; parts of the room's where these were divided.
        box_m: extents (x, y, z) of its upright box; None if it was not found.
    """

    labels: BoolArray
    gone: BoolArray
    splats: SplatCloud
    box_m: tuple[float, float, float] | None


Cut = Callable[[Capture, Sequence[PromptedView]], Cutting]
"""Cuts out what is marked; raises ValueError, with what a user reads, if it refuses."""


def cut_by_product(capture: Capture, prompted: Sequence[PromptedView]) -> Cutting:
    """The cut of `nexus cut` with boxes or a click in photos.

    Raises:
        ValueError: the marks show no object; says what to do.
    """
    package, renderer = capture.package, NativeRenderer()
    done = cut_marked(
        package, prompted, object_id=OBJECT_ID, name=OBJECT_ID, kind="", renderer=renderer
    )
    return _cutting(package, done)


def cut_labelled(package: ScenePackage, labels: BoolArray) -> Cutting:
    """The product's object of splats that are labelled already: by the truth, or by a proposal.

    Raises:
        ValueError: no object can be made of them.
    """
    none = np.zeros_like(labels)
    done = make_object(
        package,
        Separation(labels, none, none, ()),
        object_id=OBJECT_ID,
        name=OBJECT_ID,
        kind="",
        renderer=NativeRenderer(),
    )
    return _cutting(package, done)


def with_labels(package: ScenePackage, labels: BoolArray) -> Cutting:
    """The labelled splats as they are, without a box."""
    return Cutting(labels, labels, package.room.select(labels), None)


def best_proposal(proposals: Sequence[Proposal], labels: BoolArray) -> Proposal | None:
    """The proposal that most of an object's splats are in; None if none holds any."""
    shared = [overlap(proposal.found.labels, labels) for proposal in proposals]
    best = int(np.argmax(shared)) if shared else -1
    return proposals[best] if shared and shared[best] > 0 else None


def proposals_of(capture: Capture) -> tuple[Proposal, ...]:
    """The list of `nexus cut --propose`."""
    return propose(capture.package.room)


def _cutting(package: ScenePackage, done: Cutout) -> Cutting:
    last = done.package.cuts[-1]
    labels, gone = (np.zeros(len(package.room), dtype=bool) for _ in range(2))
    gone[last.places] = True
    labels[last.places[last.is_object]] = True
    return Cutting(labels, gone, last.taken.select(last.is_object), done.box.size_m)
