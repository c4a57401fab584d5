"""What tests of the window share."""

import time

import pytest


@pytest.fixture
def until(qapp):
    """Waits for a condition while the window goes on; fails with how long it waited."""

    def wait(condition, limit_s=120):
        deadline = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < deadline, f"not there in {limit_s} s"
            qapp.processEvents()
            time.sleep(0.002)

    return wait
