# pyright: standard
"""Messages of structure from motion to people: which pictures failed, what to film again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from scenes.prepare.footage.capture import Capture, CaptureKind
from scenes.prepare.poses.sfm.job import JobResult

LINK_INLIERS = 25
"""Two pictures with at least so many verified matches show the same surfaces."""
FEW_FEATURES = 200
"""Features of a picture below which its lack of them is why it failed."""
MOSTLY_TURNING = 0.6
"""Share of pairs without parallax from which on the camera only turned."""
LISTED = 6
"""Passages that are named one by one."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a reconstruction came out.

    Attributes:
        placed: names of the pictures that found their place, in order.
        failed: names of the others.
        groups: sets of pictures that share nothing with those of another set, largest first.
        advice: sentences that say what to film again; empty if all is well.
    """

    placed: tuple[str, ...]
    failed: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    advice: tuple[str, ...]


def judge_result(capture: Capture, result: JobResult) -> Verdict:
    """Turn what the mapper found into what its user should know."""
    names = [frame.name for frame in capture.frames]
    models = result.attempts[-1].models if result.attempts else ()
    found = set(models[0]) if models else set()
    placed = tuple(name for name in names if name in found)
    failed = tuple(name for name in names if name not in found)
    groups = _groups(names, result)
    advice: list[str] = []
    if failed:
        advice.append(f"no sure place was found for {describe(capture, failed)}")
        bare = [name for name in failed if result.features.get(name, 0) < FEW_FEATURES]
        if bare:
            advice.append(
                f"{describe(capture, bare)} show hardly any texture: stand back so that furniture "
                "or corners are in the picture too"
            )
    linked = [group for group in groups if len(group) > 1]
    if len(linked) > 1:
        parts = " and ".join(describe(capture, group) for group in linked[:3])
        advice.append(
            f"the pictures fall into {len(linked)} groups that show nothing in common ({parts}): "
            "film the way from one to the other in one go"
        )
    elif failed:
        advice.append(
            "film these passages again, more slowly, so that each picture shows two thirds of the "
            "one before"
            if capture.kind is not CaptureKind.PHOTOS
            else "take more photos between these and their neighbours, each showing two thirds of "
            "the one before"
        )
    if result.turning_share > MOSTLY_TURNING:
        advice.append(
            f"{result.turning_share:.0%} of the pairs show a camera that only turned on the spot: "
            "walk sideways while filming, turning alone gives no depth"
        )
    return Verdict(placed, failed, groups, tuple(advice))


def describe(capture: Capture, names: Sequence[str]) -> str:
    """The pictures in words: runs of neighbours, by time for a video, by file for photos."""
    order = {frame.name: i for i, frame in enumerate(capture.frames)}
    indices = sorted(order[name] for name in names)
    runs: list[tuple[int, int]] = []
    for index in indices:
        if runs and runs[-1][1] == index - 1:
            runs[-1] = (runs[-1][0], index)
        else:
            runs.append((index, index))

    def label(index: int) -> str:
        return capture.frames[index].source.rpartition(" at ")[2]

    words = [label(a) if a == b else f"{label(a)}–{label(b)}" for a, b in runs[:LISTED]]
    more = f" and {len(runs) - LISTED} more passages" if len(runs) > LISTED else ""
    kind = "pictures" if len(indices) > 1 else "picture"
    return f"{len(indices)} {kind} ({', '.join(words)}{more})"


def _groups(names: Sequence[str], result: JobResult) -> tuple[tuple[str, ...], ...]:
    links = np.array(
        [(i, j) for i, j, inliers in result.matches if inliers >= LINK_INLIERS], dtype=np.int64
    ).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(len(names),) * 2)
    count, label = connected_components(graph, directed=False)
    groups = [tuple(names[int(i)] for i in np.flatnonzero(label == k)) for k in range(count)]
    return tuple(sorted(groups, key=len, reverse=True))
