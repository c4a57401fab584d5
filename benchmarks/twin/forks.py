"""Forks at ten instants that change nothing: how many give the original to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from devices.recording_codec import track_to_json
from studio.console.rows import Row, at_least
from studio.session.fork import open_fork
from studio.session.opening import open_session
from studio.session.plan import SessionPlan
from studio.session.session import SessionOutput

SEED = 5
INSTANTS_S = (0.0, 0.3, 0.55, 0.8, 1.0, 1.37, 1.75, 2.0, 2.6, 3.2)
"""Of a 4 s session, chosen: on frames and between them, before and after the bump, while a chair is
pushed and a book is held."""

SCENARIO = """# Two people at work, a bump and lost frames, in small pictures.
room = "lab"
duration_s = 4.0
[camera]
fps = 4
lens_size_px = 240
bitrate_mbps = 2.0
[[people]]
id = "pusher"
start = [-1.15, 1.4]
facing_deg = -40.0
actions = [{ do = "push", object = "chair-1", to = [-0.45, 0.4] }]
[[people]]
id = "carrier"
start = [1.85, 0.3]
facing_deg = 0.0
actions = [{ do = "carry", object = "book-1", to = [2.4, 0.74] }]
[[remote]]
id = "watcher"
path = [[-0.6, -1.7, 1.6], [0.2, 0.2, 1.65]]
points_at = ["chair-1"]
[faults]
dropped_frames = [3]
drop_share = 0.1
bump_s = 0.7
"""

Frame = tuple[int, bytes, list[Any], list[Any]]
"""Of one frame: its number, its video packet, tracks and true poses."""


def measure_forks(folder: Path, *, instants_s: Sequence[float] = INSTANTS_S) -> list[Row]:
    """Rehearse, and fork at every instant with the same scenario given anew.

    Every fork runs the simulator and the tracker again, through a switch that must not show.

    Args:
        folder: for the recording and the scenario.
        instants_s: where to fork, seconds.
    """
    scenario, recording = folder / "forks.toml", folder / "recording.mcap"
    scenario.write_text(SCENARIO, encoding="utf-8")
    plan = SessionPlan(scenario=str(scenario), seed=SEED, methods=("own",), record_to=recording)
    original = play(plan)
    identical = 0
    for at_s in instants_s:
        fork = open_fork(recording, at_s=at_s, scenario=str(scenario))
        identical += play(SessionPlan(seed=SEED, methods=("own",), fork=fork)) == original
    return [at_least("twin.fork_identical", identical, "", bar=len(instants_s))]


def play(plan: SessionPlan) -> list[Frame]:
    """Everything of a session that a fork must not change."""
    frames: list[Frame] = []

    def watch(output: SessionOutput) -> None:
        truth = output.message.truth
        poses = {} if truth is None else truth.recorded.world_from_object
        frames.append(
            (
                output.input.frame.seq,
                b"" if output.input.packet is None else output.input.packet.data,
                [track_to_json(track) for track in output.shown.objects],
                [(name, pose.matrix().tolist()) for name, pose in poses.items()],
            )
        )

    open_session(plan).run(watch)
    return frames
