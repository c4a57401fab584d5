"""Read a recorded session: what is in it, what happened, and the ways that objects took.

    ./nexus rehearse --scenario lab-short --headless --out out/demo
    .venv/bin/python examples/read_a_recording.py out/demo/recording.mcap --out ways.png

A recording is one MCAP file; values come out one by one in order of time, so an hour of it needs no
more memory than a minute. The picture shows the plan: true ways as lines, the tracker's as dots.
"""

import argparse
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from devices.messages import Event
from devices.recording import read_recording, read_session
from devices.recording_codec import RecordedTrack, RecordedTruth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    args = parser.parse_args()

    session = read_session(args.recording)
    shown = session.methods[0]
    print(f"scene {session.scene}, {session.fps:g} pictures a second, tracked by {shown!r}")
    counts: Counter[str] = Counter()
    true: dict[str, list[np.ndarray]] = defaultdict(list)
    found: dict[str, list[np.ndarray]] = defaultdict(list)
    for value in read_recording(args.recording):
        counts[type(value).__name__] += 1
        if isinstance(value, Event):
            print(f"{value.t_ns / 1e9:6.2f} s  {value.source}: {value.text}")
        elif isinstance(value, RecordedTruth):
            for object_id, pose in value.world_from_object.items():
                true[object_id].append(pose.translation)
        elif isinstance(value, RecordedTrack) and value.method == shown:
            found[value.track.object_id].append(value.track.world_from_object.translation)
    print(", ".join(f"{count} {name}" for name, count in counts.most_common()))

    figure = Figure(figsize=(6, 5), layout="constrained")
    axes = figure.add_subplot(xlabel="x, m", ylabel="y, m", aspect="equal", title=session.scene)
    for number, object_id in enumerate(sorted(true | found)):
        for ways, style, name in ((true, "-", object_id), (found, ".", None)):
            if object_id in ways:
                x, y, _ = np.array(ways[object_id]).T
                axes.plot(x, y, style, color=f"C{number}", label=name)
    axes.legend()
    figure.savefig(args.out)


if __name__ == "__main__":
    main()
