import threading

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from scenes.workers.latest import Latest

LIMIT_S = 10.0


def unwanted(error):
    raise AssertionError(error)


def running(name):
    return [thread for thread in threading.enumerate() if thread.name == name]


def test_close_drops_what_waits_and_gives_back():
    began, go, done, ended = threading.Event(), threading.Event(), [], []

    def work(request, stale):
        began.set()
        go.wait(LIMIT_S)
        done.append((request, stale.is_set()))

    worker = Latest("closing", work, failed=unwanted, ended=lambda: ended.append(len(done)))
    assert worker.ask(1)
    assert began.wait(LIMIT_S)
    assert worker.ask(2)
    assert not worker.close(0.01)
    assert not worker.ask(3)
    go.set()
    assert worker.close(LIMIT_S)
    assert done == [(1, True)]
    assert ended == [1]


def test_errors_are_handed_on_and_the_next_request_is_served():
    failures, served = [], threading.Event()

    def work(request, stale):
        if request == "bad":
            raise ValueError(request)
        served.set()

    def failed(error):
        failures.append(str(error))
        worker.ask("good")

    worker = Latest("failing", work, failed=failed)
    worker.ask("bad")
    assert served.wait(LIMIT_S)
    assert worker.close(LIMIT_S)
    assert failures == ["bad"]


def test_an_error_while_it_is_closed_is_handed_on():
    began, go, failures = threading.Event(), threading.Event(), []

    def work(request, stale):
        began.set()
        go.wait(LIMIT_S)
        raise OSError("late")

    worker = Latest("late", work, failed=failures.append)
    worker.ask(1)
    assert began.wait(LIMIT_S)
    worker.close(0.0)
    go.set()
    assert worker.close(LIMIT_S)
    assert [str(error) for error in failures] == ["late"]


def test_it_takes_no_requests_after_a_defect_of_who_is_told(monkeypatch):
    told = threading.Event()
    monkeypatch.setattr(threading, "excepthook", lambda args: told.set())
    worker = Latest("defect", lambda request, stale: 1 // 0, failed=unwanted)
    worker.ask(1)
    assert told.wait(LIMIT_S)
    assert worker.close(LIMIT_S)
    assert not worker.ask(2)


def test_requests_that_never_stop_do_not_starve_it():
    """Requests come faster than they are done; answers come all the same, in order."""
    done, enough = [], threading.Event()

    def work(request, stale):
        done.append(request)
        if len(done) >= 20:
            enough.set()

    worker = Latest("flood", work, failed=unwanted)
    number = 0
    while not enough.is_set() and number < 10_000_000:
        worker.ask(number)
        number += 1
    assert worker.close(LIMIT_S)
    assert len(done) >= 20
    assert done == sorted(set(done))


class Requests(RuleBasedStateMachine):
    """Asks, begins and ends work in any order, against a model of one in hand and one waiting."""

    def __init__(self):
        super().__init__()
        self.began = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)
        self.worked = threading.Semaphore(0)
        self.done, self.failures, self.ended = [], [], []
        self.is_bad = self.is_stale = False
        self.asked = 0
        self.in_hand = self.waiting = None
        self.expected, self.expected_failures = [], []
        self.worker = Latest(
            "requests",
            self.work,
            failed=self.failures.append,
            ended=lambda: self.ended.append(True),
        )

    def work(self, request, stale):
        self.began.release()
        try:
            assert self.may_end.acquire(timeout=LIMIT_S)
            if self.is_bad:
                raise ValueError(request)
            self.done.append((request, stale.is_set()))
        finally:
            self.worked.release()

    @rule()
    def ask(self):
        self.asked += 1
        assert self.worker.ask(self.asked)
        if self.in_hand is None:
            self.in_hand = self.asked
            assert self.began.acquire(timeout=LIMIT_S)
        else:
            self.waiting, self.is_stale = self.asked, True

    @precondition(lambda self: self.in_hand is not None)
    @rule()
    def finish(self):
        self.let_go(is_bad=False)

    @precondition(lambda self: self.in_hand is not None)
    @rule()
    def fail(self):
        self.let_go(is_bad=True)

    def let_go(self, *, is_bad):
        self.is_bad = is_bad
        if is_bad:
            self.expected_failures.append(str(self.in_hand))
        else:
            self.expected.append((self.in_hand, self.is_stale))
        self.in_hand, self.waiting, self.is_stale = self.waiting, None, False
        self.may_end.release()
        assert self.worked.acquire(timeout=LIMIT_S)
        if self.in_hand is not None:
            assert self.began.acquire(timeout=LIMIT_S)

    @rule()
    def cancel(self):
        self.worker.cancel()
        self.waiting, self.is_stale = None, self.in_hand is not None

    @invariant()
    def busy_with_what_was_asked_for(self):
        if self.in_hand is not None:
            assert self.worker.is_busy

    def teardown(self):
        serves_last = self.asked % 2 == 0
        self.worker.close(0.0, serves_last=serves_last)
        if self.in_hand is not None:
            self.is_bad = False
            self.expected.append((self.in_hand, self.is_stale or not serves_last))
            self.may_end.release()
            if serves_last and self.waiting is not None:
                self.expected.append((self.waiting, False))
                self.may_end.release()
        assert self.worker.close(LIMIT_S, serves_last=serves_last)
        assert self.done == self.expected
        assert [str(error) for error in self.failures] == self.expected_failures
        assert self.ended == [True]
        assert not running("requests")


TestRequests = Requests.TestCase
TestRequests.settings = settings(
    max_examples=40,
    stateful_step_count=15,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)


@pytest.mark.parametrize("_attempt", range(20))
def test_close_right_after_a_request_leaves_no_thread(_attempt):
    worker = Latest("brief", lambda request, stale: None, failed=unwanted)
    worker.ask(1)
    assert worker.close(LIMIT_S)
    assert not running("brief")


def test_an_error_nobody_takes_ends_it(monkeypatch):
    told, ended = threading.Event(), []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.set())
    worker = Latest("alone", lambda request, stale: 1 // 0, ended=lambda: ended.append(True))
    worker.ask(1)
    assert told.wait(LIMIT_S)
    assert worker.close(LIMIT_S)
    assert not worker.ask(2)
    assert not worker.is_busy
    assert ended == [True]


def test_an_error_at_its_beginning_ends_it(monkeypatch):
    told, ended, done = threading.Event(), [], []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.set())
    worker = Latest(
        "unbegun",
        lambda request, stale: done.append(request),
        failed=unwanted,
        began=lambda: 1 // 0,
        ended=lambda: ended.append(True),
    )
    assert told.wait(LIMIT_S)
    assert worker.close(LIMIT_S)
    assert (worker.ask(1), done, ended) == (False, [], [True])


def test_the_last_request_can_be_served_at_the_end():
    began, go, done = threading.Event(), threading.Event(), []

    def work(request, stale):
        began.set()
        go.wait(LIMIT_S)
        done.append((request, stale.is_set()))

    worker = Latest("saves", work)
    worker.ask("old")
    assert began.wait(LIMIT_S)
    worker.ask("new")
    worker.close(0.0, serves_last=True)
    go.set()
    assert worker.close(LIMIT_S, serves_last=True)
    assert done == [("old", True), ("new", False)]
