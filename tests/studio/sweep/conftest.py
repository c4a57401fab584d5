"""Runs that take no time: their figures follow from their values alone."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from studio.sweep.plan import parse_sweep

SWEEP = """
[sweep]
scenario = "lab-short"
seeds = [0, 1]
methods = ["own", "paper"]
[faults]
blur = { px = [1, 2, 4] }
exposure = { ev = [-1, 1] }
"""


def made_up(run):
    """What a run may give."""
    rows = [
        {
            "fault": run.fault,
            "unit": run.unit,
            "size": run.size,
            "seed": run.seed,
            "method": method,
            "frames": 30,
            "frames_lost_on_the_way": 0,
            "world_cm_mean": 1.0 + abs(run.size) + run.seed + 3 * place,
            "world_cm_p95": 2.0 + abs(run.size) + run.seed + 3 * place,
            "yaw_deg_mean": None if place else 0.5 + abs(run.size),
            "yaw_deg_p95": None if place else 1.5 + abs(run.size),
            "shown_cm_mean": 4.0,
            "shown_cm_p95": 5.0,
            "lost_share": 0.25 * place,
        }
        for place, method in enumerate(run.methods)
    ]
    return {"rows": rows, "seconds": 0.1}


@pytest.fixture
def fake():
    """A plan of 12 runs, and what each gives."""
    plan = parse_sweep(SWEEP, source="fake.toml", scene="lab")
    return SimpleNamespace(plan=plan, give=made_up)
