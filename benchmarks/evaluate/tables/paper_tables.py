"""The paper's two tables (section 5.2): a chair in a room, a book on a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.findings import (
    TITLES,
    Drawing,
    Findings,
    error_rows,
    own_bar,
    paper_columns,
    row_name,
)
from benchmarks.evaluate.protocols.stations import ROOM, TABLE, Protocol, Sample, samples
from scenes.pose import wrap_angle
from scenes.state import TrackedObject
from studio.console.rows import Row, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.evaluate.metrics import PAPER_ROOM, PAPER_TABLE, error_table

ROOM_BARS = {"world_cm.mean": 2.0, "yaw_deg.mean": 1.0, "yaw_deg.max": 3.0, "flips": 0.0}
TRUE_CAMERA_BARS = {"world_cm.mean": 1.5, "yaw_deg.mean": 0.8}
TABLE_BARS = {"world_cm.mean": 0.8, "yaw_deg.mean": 0.6, "flips": 0.0}

CHI2_95_OF_4 = 9.487729
"""95 % of errors in four unknowns lie within this squared Mahalanobis distance."""

COVERAGE = (0.90, 0.99)
"""Shares of errors that a 95 % ellipsoid may hold."""


def room(asked: Asked) -> Findings:
    """Table 1, with the camera's pose as a marker gives it and with the true one."""
    found = samples(ROOM, asked)
    findings = _report("room", ROOM, found, bars=ROOM_BARS, printed=PAPER_ROOM)
    for method, seen in found.items():
        findings.rows.append(coverage_row(method, "covariance.inside_95", seen))
    if asked.conditions.pose_error_deg or asked.conditions.pose_error_cm:
        exact = replace(asked.conditions, pose_error_deg=0.0, pose_error_cm=0.0)
        exact_samples = samples(ROOM, replace(asked, conditions=exact))
        true_camera = _report(
            "room_true_camera", ROOM, exact_samples, bars=TRUE_CAMERA_BARS, printed={}
        )
        findings.rows.extend(true_camera.rows)
        findings.text.extend(true_camera.text)
    return findings


def table(asked: Asked) -> Findings:
    """Table 2."""
    found = samples(TABLE, asked)
    findings = _report("table", TABLE, found, bars=TABLE_BARS, printed=PAPER_TABLE)
    for method, seen in found.items():
        findings.rows.append(coverage_row(method, "table.covariance.inside_95", seen))
    return findings


def coverage_row(method: str, name: str, seen: Sequence[Sample]) -> Row:
    """Share of errors within the 95 % ellipsoid of the reported covariance."""
    inside = [squared_distance(sample) <= CHI2_95_OF_4 for sample in seen]
    share = float(np.mean(inside))
    passed = COVERAGE[0] <= share <= COVERAGE[1] if method == "own" else None
    return Row(row_name(method, name), share, "", own_bar(method, COVERAGE[0]), passed)


def squared_distance(sample: Sample) -> float:
    """Squared Mahalanobis distance of a pose's error in x, y, z and yaw."""
    estimated, true = sample.track.world_from_object, sample.station.world_from_object
    yaw = wrap_angle(estimated.yaw() - true.yaw())
    error = np.append(estimated.translation - true.translation, yaw)
    return float(error @ np.linalg.solve(sample.track.covariance, error))


def _report(
    prefix: str,
    protocol: Protocol,
    found: Mapping[str, Sequence[Sample]],
    *,
    bars: Mapping[str, float],
    printed: Mapping[str, tuple[float, float]],
) -> Findings:
    findings = Findings()
    for method, seen in found.items():
        errors = [sample.error for sample in seen]
        findings.rows.extend(error_rows(method, prefix, errors, bars=bars))
        groups = {
            f"P{index} ({x:+.2f}, {y:+.2f}) m": [
                s.error for s in seen if s.station.position == index
            ]
            for index, (x, y) in enumerate(protocol.positions_m, 1)
        }
        for index, group in enumerate(groups.values(), 1):
            mean = float(np.mean([error.world_cm for error in group]))
            findings.rows.append(
                at_most(row_name(method, f"{prefix}.P{index}.world_cm"), mean, "cm")
            )
        title = f"{prefix}: {TITLES[method]}"
        findings.text.append(paper_columns(title, groups, printed=printed))
        if method == "paper":
            findings.rows.extend(_noticed_rows(prefix, seen))
    findings.drawings.append(
        Drawing(prefix, lambda figure: _draw_positions(figure, protocol, found))
    )
    return findings


def noticed(seen: Sequence[Sample]) -> list[Sample]:
    """Stations at which the pose is another one than at the station before.

    The paper's method estimates only what it has noticed to move; the others carry the error of not
    having noticed, which says nothing of its optimiser.
    """
    fresh = []
    before: Sample | None = None
    for sample in seen:
        if before is None or before.seed != sample.seed or not _is_same(before.track, sample.track):
            fresh.append(sample)
        before = sample
    return fresh


def _is_same(a: TrackedObject, b: TrackedObject) -> bool:
    return np.allclose(a.world_from_object.matrix(), b.world_from_object.matrix(), atol=1e-9)


def _noticed_rows(prefix: str, seen: Sequence[Sample]) -> list[Row]:
    fresh = noticed(seen)
    base = f"paper.{prefix}.noticed"
    rows = [Row(base, len(fresh) / len(seen), "")]
    if fresh:
        table = error_table([sample.error for sample in fresh])
        rows.append(Row(f"{base}.world_cm.mean", table["world_cm"].mean, "cm"))
        rows.append(Row(f"{base}.yaw_deg.mean", table["yaw_deg"].mean, "deg"))
    return rows


def _draw_positions(
    figure: Figure, protocol: Protocol, found: Mapping[str, Sequence[Sample]]
) -> None:
    """Figure 6 of the paper: where each method saw the object, from above."""
    axes = figure.add_subplot()
    places = np.array(protocol.positions_m)
    for method, colour in (("paper", OTHER), ("own", OWN)):
        if method not in found:
            continue
        seen = np.array([s.track.world_from_object.translation[:2] for s in found[method]])
        true = np.array([s.station.world_from_object.translation[:2] for s in found[method]])
        axes.plot(*np.stack([true, seen]).transpose(2, 0, 1), color=colour, lw=0.7, alpha=0.5)
        axes.plot(seen[:, 0], seen[:, 1], ".", color=colour, ms=7, alpha=0.7, label=TITLES[method])
    axes.plot(places[:, 0], places[:, 1], "+", ms=13, color="black", label="truth", zorder=3)
    for index, place in enumerate(places, 1):
        axes.annotate(f"P{index}", (place[0], place[1]), (6, 6), textcoords="offset points")
    axes.margins(0.12)
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m (away from the camera)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=3)
