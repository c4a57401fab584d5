"""A camera's picture passes few files, in few types, from the socket to the window."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.state import TrackedObject
from studio.console.display import why_no_window
from tests.passing import Passing
from tests.studio.live.conftest import LENS_PX

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]

MAX_FILES = 22
"""Files that a picture passes, the tracker's one among them. Lower it with every file less; never
raise it."""

MAX_TYPES = 18
"""Types of one picture today. Lower it, never raise it. The aim is 8."""

MIN_UNIT_BYTES = 300
"""Bytes of a picture's smallest encoded unit; messages that say something are shorter."""

BESIDE = (
    "sim/",  # the camera, before the socket
    "devices/video",  # its encoder
    "devices/recording",
    "studio/session/records/",
    "studio/session/trackers/",  # what is recorded of the pace, settings that are tried beside
    "studio/live/people/",  # the state for those who are connected
    "studio/live/shortfalls",
    "studio/live/checks",
    "scenes/formats/storage/",  # files of the checks
    "studio/app/live/",  # the thumbnails of the live panel
    "studio/app/twin/",
)
"""Beginnings of files in which a picture or its poses are looked at beside their way."""

AROUND = ("studio/app/shell/", "studio/app/model/jobs/live_job")
"""Callers that hand on nothing: the window's timer has everything in it look at what came, and the
job on whose thread the session runs looks for its checks whether a picture came."""

DRAWN_IN = (
    "studio/app/viewport/drawing/view_picture",
    "studio/app/viewport/drawing/mesh_picture",
    "studio/app/viewport/drawing/scene_drawing",
    "studio/app/viewport/by_hand/",
    "studio/app/viewport/view_overlay",
    "scenes/render/",
)
"""Where the way ends: the picture of the twin is drawn, and labels and handles over it."""


def is_of_a_picture(value):
    """Whether a value is an encoded picture, pixels of one, or a pose found in one."""
    if isinstance(value, bytes | bytearray | memoryview):
        return len(value) > MIN_UNIT_BYTES
    if isinstance(value, np.ndarray):
        return value.dtype == np.uint8 and value.ndim >= 2 and value.size >= LENS_PX**2 // 4
    return isinstance(value, TrackedObject)


def test_a_picture_passes_few_files_and_types_to_the_window(opened):
    passing = Passing(is_of_a_picture, ends_in=(*BESIDE, *DRAWN_IN), skips=AROUND)
    with passing.watching():
        opened.go_live()
        passing.is_on = True
        opened.until(lambda: "studio/app/viewport/drawing/shapes.py" in passing.files)
        begun = opened.live.session.status().frames
        opened.until(lambda: opened.live.session.status().frames >= begun + 20)
    passed = {**passing.files, "tracking/tracker.py": "Tracker.step"}
    print(f"files that a picture passes: {len(passed)}, types of it: {len(passing.types)}")
    print(*(f"{file}: {name}" for file, name in sorted(passed.items())), sep="\n")
    print(sorted(passing.types))
    assert len(passed) <= MAX_FILES, passed
    assert len(passing.types) <= MAX_TYPES, passing.types
