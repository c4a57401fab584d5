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


def process_id(budget):
    """Of the process that computes it."""
    del budget
    return os.getpid()
