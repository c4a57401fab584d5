import subprocess
import sys
import threading

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenes.workers.task import Task

LIMIT_S = 10.0


def test_result_and_share():
    def work(task):
        task.report(0.5)
        return 7

    task = Task("seven", work)
    assert task.join()
    assert not task.is_running
    assert task.start().outcome() == 7
    assert task.result == 7
    assert (task.share, task.error, task.problem) == (0.5, None, "")


def test_it_starts_once():
    task = Task("once", lambda _: None).start()
    with pytest.raises(RuntimeError):
        task.start()


def test_expected_errors_are_kept(monkeypatch):
    told = []
    monkeypatch.setattr(threading, "excepthook", told.append)

    def work(task):
        raise ValueError("no such room")

    task = Task("fails", work, expected=(ValueError, OSError)).start()
    assert task.join(LIMIT_S)
    assert task.problem == "no such room"
    with pytest.raises(ValueError, match="no such room"):
        task.outcome()
    assert not told


def test_other_errors_are_also_told(monkeypatch):
    told = []
    monkeypatch.setattr(threading, "excepthook", told.append)
    task = Task("defect", lambda _: 1 // 0, expected=ValueError).start()
    assert task.join(LIMIT_S)
    assert [args.exc_type for args in told] == [ZeroDivisionError]
    assert isinstance(task.error, ZeroDivisionError)


def test_an_error_without_words_has_its_name():
    def work(task):
        raise KeyError

    task = Task("wordless", work, expected=KeyError).start()
    task.join(LIMIT_S)
    assert task.problem == "KeyError"


def test_a_limited_join_says_whether_it_ended():
    task = Task("waits", lambda own: own.cancelled.wait()).start()
    assert not task.join(0.01)
    assert task.is_running
    task.cancel()
    assert task.join(LIMIT_S)


def test_it_does_not_wait_for_itself():
    task = Task("joins itself", lambda own: own.join()).start()
    assert task.join(LIMIT_S)
    assert task.result is False


@pytest.mark.parametrize(("is_awaited", "printed"), [(True, b"whole"), (False, b"")])
def test_a_program_waits_at_its_end_only_if_told(is_awaited, printed):
    program = (
        "import time; from scenes.workers.task import Task\n"
        "def work(task): time.sleep(0.5); print('whole', end='', flush=True)\n"
        f"Task('file', work, is_awaited={is_awaited}).start()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert done.stdout == printed


STEPS = ("start", "cancel", "join", "finish", "fail")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.sampled_from(STEPS), max_size=8))
def test_any_order_of_calls_ends_in_one_outcome_and_no_thread(steps):
    """Cancelled, finished or failed at any moment: one of result and error, and nothing runs."""
    told = threading.Event()
    shall_fail = False

    def work(own):
        while not told.is_set() and not own.pause(0.001):
            pass
        if shall_fail:
            raise ValueError("told to")
        return "cancelled" if own.is_cancelled else "finished"

    task = Task("any order", work, expected=ValueError)
    has_started = False
    for step in steps:
        if step == "start" and not has_started:
            has_started = True
            task.start()
        elif step == "cancel":
            task.cancel()
        elif step == "join":
            assert task.join(0.0) is not task.is_running
        elif step == "fail" and not told.is_set() and not task.is_cancelled:
            shall_fail = True
            told.set()
        elif step == "finish":
            told.set()
    if not has_started:
        assert task.join()
        return
    told.set()
    assert task.join(LIMIT_S)
    assert (task.result is None) is shall_fail
    assert (task.error is None) is not shall_fail
    assert all(thread.name != "any order" for thread in threading.enumerate())
