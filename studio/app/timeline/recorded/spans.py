"""From when to when: states of objects, and faults of a rehearsal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.state import TrackState
from sim.scenarios.scenario import Scenario, parse_scenario
from sim.tables import ScenarioError
from studio.app.timeline.recorded.columns import STATE, STATES, Rows
from studio.app.timeline.recorded.index import RecordingIndex


@dataclass(frozen=True, slots=True)
class StateSpan:
    """An object's state from `from_ns` to before `to_ns`."""

    from_ns: int
    to_ns: int
    state: TrackState


@dataclass(frozen=True, slots=True)
class FaultSpan:
    """A fault of the scenario from `from_ns` to before `to_ns`.

    Attributes:
        from_ns: first frame's time at which it is there.
        to_ns: the first at which it is not any more.
        name: its key in the scenario.
        largest: its size where it is largest, in the unit of its key.
    """

    from_ns: int
    to_ns: int
    name: str
    largest: float


def state_spans(rows: Rows, *, end_ns: int) -> list[StateSpan]:
    """How an object's state changed.

    Args:
        rows: of the object, see `columns.track_row`.
        end_ns: where the last span ends.
    """
    if not len(rows):
        return []
    codes = rows.table()[:, STATE].astype(int)
    starts = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist()]
    ends = [*(int(rows.t_ns[i]) for i in starts[1:]), max(end_ns, int(rows.t_ns[-1]))]
    return [
        StateSpan(int(rows.t_ns[start]), end, STATES[codes[start]])
        for start, end in zip(starts, ends, strict=True)
    ]


def fault_spans(index: RecordingIndex) -> list[FaultSpan]:
    """Return spans of faults, of the recording's scenarios and of what the truth names.

    A scenario of another version of the program that cannot be read adds nothing.
    """
    step_ns = max(round(1e9 / max(index.session.fps, 0.1)), 1)
    times = np.arange(index.start_ns, index.end_ns + 1, step_ns, dtype=np.int64)
    sizes: list[dict[str, float]] = [{} for _ in times]
    for scenario, from_ns in _scenarios(index):
        for number in range(int(np.searchsorted(times, from_ns)), len(times)):
            sizes[number] = dict(scenario.faults.sizes(times[number] / 1e9))
    for t_ns, names in index.faults_ns:
        number = min(int(np.searchsorted(times, t_ns, side="right")) - 1, len(times) - 1)
        for name in names:
            sizes[max(number, 0)].setdefault(name, 0.0)
    return _runs(times, sizes, step_ns)


def _scenarios(index: RecordingIndex) -> list[tuple[Scenario, int]]:
    """The scenarios that can be read, each with the time from which it was followed."""
    info = index.session
    texts = [(info.scenario, info.scenario_name, index.start_ns)]
    texts += [(change.scenario, change.scenario_name, change.t_ns) for change in info.changes]
    found: list[tuple[Scenario, int]] = []
    for text, name, from_ns in texts:
        try:
            found.append((parse_scenario(text, source=f"{name}.toml"), from_ns))
        except ScenarioError:
            continue
    return found


def _runs(
    times: NDArray[np.int64], sizes: Sequence[Mapping[str, float]], step_ns: int
) -> list[FaultSpan]:
    spans: list[FaultSpan] = []
    open_at: dict[str, tuple[int, float]] = {}
    for t_ns, now in zip([*times.tolist(), None], [*sizes, {}], strict=True):
        end_ns = int(times[-1]) + step_ns if t_ns is None else t_ns
        for name in [name for name in open_at if name not in now]:
            from_ns, largest = open_at.pop(name)
            spans.append(FaultSpan(from_ns, end_ns, name, largest))
        for name, size in now.items():
            from_ns, largest = open_at.get(name, (end_ns, size))
            open_at[name] = from_ns, max(largest, size, key=abs)
    return sorted(spans, key=lambda span: (span.from_ns, span.name))
