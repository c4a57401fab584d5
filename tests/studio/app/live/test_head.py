"""The top of the live panel keeps its height while a session plays: warnings shift no tabs."""

import pytest

from devices.camera.receiver import CameraState, CameraStatus
from studio.app.live.words import Banner
from studio.console.display import why_no_window
from studio.live.status import LiveState, LiveStatus

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def test_banners_that_come_and_go_leave_the_tabs_where_they_are(opened, qapp):
    dock = opened.dock
    head, tabs = dock.head, dock.tabs
    dock._timer.stop()  # the panel is shown what follows, not the session that there is none of

    def top_after(state, banner):
        camera = CameraStatus(CameraState.LIVE, "")
        status = LiveStatus(state, "waits for the camera", camera)
        head.show_status(status, banner, drawing="", is_locating=False)
        for _ in range(10):
            qapp.processEvents()
        return tabs.y()

    quiet = top_after(LiveState.CONNECTING, None)
    long = "pictures have stopped: " + "the last one is older than it should be, " * 2
    banners = [Banner("warning", long), None, Banner("bad", "the camera was moved"), None]
    assert {top_after(LiveState.CONNECTING, banner) for banner in banners} == {quiet}
    head.show_idle(None)
    opened.until(lambda: tabs.y() < quiet)
