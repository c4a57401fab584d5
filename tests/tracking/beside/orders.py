"""Searches that stand in for real ones; the search process imports them."""

import os
import threading
import time

import numpy as np

from tracking.hypotheses.budget import Step


def doubled(values, budget):
    """Twice some numbers."""
    return budget.do(Step.ALIGN, np.multiply, values, 2)


def endless(budget):
    """Ends only if it is given up."""
    while True:
        budget.do(Step.ALIGN, time.sleep, 0.01)


def fails(budget):
    """Raises."""
    del budget
    raise ValueError("no floor at 2.5 m")


def gives_a_lock(budget):
    """Gives what cannot leave a process."""
    del budget
    return threading.Lock()


def dies(budget):
    """Takes its process with it."""
    del budget
    os._exit(3)


def scattered(pictures, budget):
    """The size of what came, after as much was made in pieces of 100 kB and let go but for one."""
    pieces = [np.ones(100_000, np.uint8) for _ in range(len(pictures) // 100_000)]
    kept = pieces[-1]
    pieces.clear()
    return len(pictures) * int(kept[0])


def process_id(budget):
    """Of the process that computes it."""
    del budget
    return os.getpid()
