"""The trackers by the names that people give them on the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol

from devices.messages import Frame
from scenes.package import ScenePackage
from sim.truth import GroundTruth
from tracking.baseline.detect import Detector
from tracking.baseline.matcher import Matcher
from tracking.hypotheses.budget import NOMINAL_COSTS, StepCosts
from tracking.hypotheses.search_runner import IN_FRAMES, SearchRunner
from tracking.output import Stopwatch, TrackingMethod, no_stopwatch

METHODS = ("own", "paper")
"""Names of the trackers; the first is the default."""


MethodMaker = Callable[[ScenePackage], TrackingMethod[Any]]
"""Makes a tracker for the objects of a scene."""

NO_MORE: Mapping[str, MethodMaker] = MappingProxyType({})
"""No trackers beside those of `METHODS`."""


class TruthDetector(Detector, Protocol):
    """A detector that stands in for a trained network, made of the ground truth of each frame."""

    def see(self, frame: Frame, truth: GroundTruth) -> None:
        """Take the frame that the next calls of `detect` are about, and its ground truth."""
        ...


def make_method(
    name: str,
    scene: ScenePackage,
    detector: Detector | None = None,
    *,
    matcher: Matcher | None = None,
    stopwatch: Stopwatch = no_stopwatch,
    costs: StepCosts = NOMINAL_COSTS,
    searches: SearchRunner = IN_FRAMES,
    looks: SearchRunner = IN_FRAMES,
    more: Mapping[str, MethodMaker] = NO_MORE,
) -> TrackingMethod[Any]:
    """A tracker for the objects of a scene.

    Args:
        name: one of `METHODS`, or of `more`.
        scene: splats of the room and of its objects, with their last known poses.
        detector: finds the objects for the paper's method, such as a `TruthDetector` in place of
            its trained network; without one, the method finds what differs from the empty room.
        matcher: finds corresponding points for the paper's method; SIFT if None.
        stopwatch: for the stage durations.
        costs: of the steps of our tracker's searches; nominal ones make every run the same.
        searches: computes our tracker's searches for lost objects.
        looks: computes its looks around where objects were known.
        more: trackers beside `METHODS` by name, such as those of plug-ins.

    Raises:
        ValueError: no such method.
    """
    if name in more and name not in METHODS:
        return more[name](scene)
    from scenes.render.native import NativeRenderer
    from tracking.baseline.paper import PaperTracker
    from tracking.tracker import Tracker

    if name == "own":
        return Tracker(
            scene.room,
            scene.objects,
            NativeRenderer(),
            stopwatch=stopwatch,
            costs=costs,
            searches=searches,
            looks=looks,
        )
    if name == "paper":
        return PaperTracker(
            scene.room,
            scene.objects,
            NativeRenderer(),
            detector=detector,
            matcher=matcher,
            stopwatch=stopwatch,
        )
    raise ValueError(f"tracking method {name!r}: wanted one of {', '.join((*METHODS, *more))}")
