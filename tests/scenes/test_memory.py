"""Memory that nobody uses goes back to the operating system."""

import gc
import subprocess
import sys
import weakref

import pytest

from scenes.memory import (
    collect_due,
    give_back_memory,
    growth_percent,
    resident_kib,
    share_one_heap,
)


class Holder:
    """Holds itself, so that only the collector frees it."""

    def __init__(self) -> None:
        self.itself = self


def test_what_holds_only_itself_is_gone() -> None:
    held = weakref.ref(Holder())
    give_back_memory()
    assert held() is None


def test_objects_are_collected_when_there_are_as_many_as_python_waits_for() -> None:
    gc.collect()
    gc.disable()
    try:
        held = weakref.ref(Holder())
        collect_due()
        assert held() is not None
        kept = [Holder() for _ in range(gc.get_threshold()[0])]
        collect_due()
        assert held() is None
        assert kept
    finally:
        gc.enable()


LEAVE_GAPS = """
import threading
import numpy as np
from pathlib import Path
from scenes.memory import return_free_pages, share_one_heap

share_one_heap()
kept = []
together = threading.Barrier(8)

def work():
    for _ in range(40):
        together.wait()
        pictures = [np.ones(3 << 19, np.uint8) for _ in range(4)]
        together.wait()
        kept.append(np.ones(600, np.uint8))
        del pictures[1::2]
        kept.append(np.ones(3000, np.uint8))

def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20

before = resident_mb()
for _ in range(3):
    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
return_free_pages()
print(resident_mb() - before)
"""
"""Eight threads at once make and free pictures, and keep a little between them: 4 MB more in the
end, and 48 to 68 MB if the free pages are not given back."""

TAKE_PICTURES = """
import resource
import numpy as np
from scenes.memory import share_one_heap

share_one_heap()

def take(count):
    for _ in range(count):
        np.ones(9 << 20, np.uint8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

print(take(1), take(50))
"""
"""Pictures of 9 MB, each freed before the next one: 2,304 pages of 4 KiB each."""


@pytest.mark.skipif(sys.platform != "linux", reason="the option is glibc's")
def test_pictures_that_threads_have_freed_leave_nothing_between_what_stays() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LEAVE_GAPS], check=True, capture_output=True, text=True
    )
    assert float(done.stdout) < 20.0


@pytest.mark.skipif(sys.platform != "linux", reason="the option is glibc's")
def test_the_next_picture_takes_the_pages_of_the_last_one() -> None:
    done = subprocess.run(
        [sys.executable, "-c", TAKE_PICTURES], check=True, capture_output=True, text=True
    )
    first, last = map(int, done.stdout.split())
    assert last - first < 2304
    assert first > 2304


def test_a_library_without_trimming_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ctypes.CDLL", lambda _name: object())
    share_one_heap()
    give_back_memory()


def test_memory_of_children_counts_unless_they_are_left_out() -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL
    )
    try:
        with_child, without = resident_kib(), resident_kib(but={child.pid})
        assert without > 1000
        assert with_child >= without
    finally:
        child.communicate(b"\n")


def test_growth_is_from_the_second_quarter_to_the_last() -> None:
    assert growth_percent([1.0] * 19) is None
    samples = [500.0] * 10 + [100.0] * 20 + [110.0] * 10
    assert growth_percent(samples) == pytest.approx(10.0)


def test_memory_that_swings_and_keeps_nothing_has_not_grown() -> None:
    swinging = [100.0 + 10.0 * (second % 15) for second in range(120)]
    assert abs(growth_percent(swinging) or 0.0) < 1.0
