"""`nexus bench hololens`: a simulated HoloLens over loopback: delays, its clock, hostile bytes."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # the machine is described with it, which takes a moment
    from benchmarks.wire.hololens_load import HeadsetFigures
    from studio.console.rows import Row

VIDEO_MS = 60.0
"""Bar of a picture's way from glass to consumer, p95: within two pictures at 30 Hz."""

HANDS_MS = 10.0
"""Bar of the way of hands and head, p95: within a picture of a headset at 72 Hz."""

CLOCK_MS = 1.0
"""Bar of the clock's error after 10 s: far below the time between two samples of hands."""

JITTER_S, DRIFT_PPM = 0.005, 50.0
"""Faults under which the clock is measured: those of a Wi-Fi at home and of a usual crystal."""


HEADSET_SHARE = 25
"""Hostile clients for each hostile headset, chosen: both halves take about as long."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("--seconds", type=float, default=20.0, metavar="N", help="how long (20)")
    parser.add_argument(
        "--codec", choices=("h264", "hevc", "raw"), default="h264", help="of its video (h264)"
    )
    parser.add_argument(
        "--size", default="760x428", metavar="WxH", help="of its video, at 30 Hz (760x428)"
    )
    parser.add_argument(
        "--streams", type=int, default=500, metavar="N", help="hostile ones a port after it (500)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the first of them (0)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure; exit 1 if a figure misses its bar."""
    from benchmarks.wire.attack_hololens import attack_client, attack_simulator
    from benchmarks.wire.hololens_load import measure_clock, measure_streams, worst
    from devices.hololens.plan import VideoOptions
    from studio.console.rows import Row, as_json, as_table, at_most, exit_code

    width, mark, height = args.size.partition("x")
    if args.seconds < 1 or args.streams < 0 or not (mark and width.isdecimal()):
        raise ValueError("wanted --seconds of 1 or more, --streams of 0 or more, --size as 760x428")
    video = VideoOptions(int(width), int(height), codec=args.codec)
    print(f"everything for {args.seconds:g} s …", file=sys.stderr)
    rows = stream_rows(measure_streams(args.seconds, seed=args.seed, video=video))
    print("the clock …", file=sys.stderr)
    errors = measure_clock(seed=args.seed, jitter_s=JITTER_S, drift_ppm=DRIFT_PPM)
    rows.append(at_most("hololens.clock_ms", worst(errors), "ms", bar=CLOCK_MS))
    if args.streams:
        print(f"{args.streams} hostile streams a port, both ways …", file=sys.stderr)
        # A client waits a moment before each of its attempts.
        headsets = max(1, args.streams // HEADSET_SHARE)
        counts = [attack_simulator(args.streams, args.seed), attack_client(headsets, args.seed)]
        crashes = sum(count.crashes for count in counts)
        rows.append(at_most("session.fuzz.crashes", crashes, "", bar=0))
        rows.append(Row("session.fuzz.streams", float(sum(c.streams for c in counts)), ""))
        rows.append(Row("session.fuzz.growth_mb", max(c.growth_mb for c in counts), "MB"))
    if args.json:
        print(json.dumps(as_json("bench hololens", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def stream_rows(figures: HeadsetFigures) -> list[Row]:
    """Return the figures of pictures and hands as rows."""
    from studio.console.rows import Row, at_most

    rows: list[Row] = []
    named = (("video", figures.video_ms, VIDEO_MS), ("hands", figures.hands_ms, HANDS_MS))
    for name, delays, bar in named:
        found = delays or [float("inf")]
        p50, p95, p99 = (float(value) for value in np.percentile(found, (50, 95, 99)))
        rows.append(Row(f"hololens.{name}_ms.p50", p50, "ms"))
        rows.append(at_most(f"hololens.{name}_ms.p95", p95, "ms", bar=bar))
        rows.append(Row(f"hololens.{name}_ms.p99", p99, "ms"))
        rows.append(Row(f"hololens.{name}_hz", len(delays) / figures.seconds, "Hz"))
    streams = figures.status.streams.values()
    rows.append(Row("hololens.damaged", float(sum(each.damaged for each in streams)), ""))
    rows.append(Row("hololens.surfaces", float(figures.status.surfaces), ""))
    return rows
