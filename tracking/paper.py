"""The paper's tracker (section 4.4)."""

from __future__ import annotations

from collections.abc import Sequence

from scenes.render.renderer import Renderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tracking.output import Stopwatch, no_stopwatch
from tracking.tracker import Tracker


class PaperTracker(Tracker):
    """Same API as Tracker."""

    def __init__(
        self,
        room: SplatCloud,
        objects: Sequence[ObjectModel],
        renderer: Renderer,
        *,
        stopwatch: Stopwatch = no_stopwatch,
    ) -> None:
        super().__init__(room, objects, renderer, stopwatch=stopwatch)
