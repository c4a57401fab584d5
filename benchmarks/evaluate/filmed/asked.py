"""Request for an evaluation: methods, seeds, conditions."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.takes import TakeCache
from studio.console.progress import Progress


@dataclass(frozen=True, slots=True)
class Asked:
    """Request for an evaluation.

    Attributes:
        methods: names of `studio.session.trackers.methods.METHODS`, in the order of the tables.
        seeds: one run each; they decide noise, drift and the camera pose's error.
        conditions: see `Conditions`.
        cache: where takes are kept.
        progress: shows how far the evaluation is.
    """

    methods: tuple[str, ...]
    seeds: tuple[int, ...]
    conditions: Conditions
    cache: TakeCache
    progress: Progress
