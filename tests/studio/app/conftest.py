"""What tests of the window share."""

import sys
import time

import pytest


@pytest.fixture(autouse=True)
def deleted():
    """Delete what earlier tests have left to be deleted, for which Qt waits for an event loop.

    Every window and dock that is left makes a change of theme or text size slower for all that come
    later: 15 windows of 900 widgets each made it eight times as slow.
    """
    if "PySide6.QtWidgets" in sys.modules:
        from PySide6.QtCore import QCoreApplication, QEvent

        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def until(qapp):
    """Waits for a condition while the window goes on; fails with how long it waited."""

    def wait(condition, limit_s=120):
        deadline = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < deadline, f"not there in {limit_s} s"
            qapp.processEvents()
            time.sleep(0.005)

    return wait
