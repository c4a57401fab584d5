"""`nexus bench hub`: people in a session on loopback: latency, processor time, memory."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the machine is described with it, which takes a moment
    from benchmarks.wire.hub_load import LoadFigures
    from studio.console.rows import Row

P95_MS = 20.0
"""Bar of a hand's way to another client at 72 Hz: within two pictures of a headset."""

PUBLISH_MS = 1.0
"""Bar of the tracker's time that publishing takes."""

GROWTH_PERCENT = 5.0
"""Bar of memory's growth: what one heap of Python moves by itself."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("--clients", type=int, default=16, metavar="N", help="people (16)")
    parser.add_argument("--hz", type=float, default=72.0, metavar="N", help="bodies a second (72)")
    parser.add_argument("--seconds", type=float, default=20.0, metavar="N", help="how long (20)")
    parser.add_argument(
        "--streams", type=int, default=1000, metavar="N", help="hostile connections after it (1000)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the first of them (0)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure; exit 1 if a figure misses its bar."""
    from benchmarks.wire.attack_hub import attack_hub
    from benchmarks.wire.hub_load import load_hub
    from studio.console.rows import Row, as_json, as_table, at_most, exit_code

    if not 2 <= args.clients <= 256 or args.seconds < 1 or args.hz <= 0 or args.streams < 0:
        raise ValueError("wanted --clients of 2..256, --seconds of 1 or more, --hz above 0")
    print(f"{args.clients} people for {args.seconds:g} s …", file=sys.stderr)
    rows = load_rows(load_hub(args.clients, hz=args.hz, seconds=args.seconds), args.clients)
    if args.streams:
        print(f"{args.streams} hostile streams …", file=sys.stderr)
        counts = attack_hub(args.streams, args.seed)
        rows.append(at_most("live.hub_fuzz.crashes", counts.crashes, "", bar=0))
        rows.append(Row("live.hub_fuzz.rss_growth_mb", counts.growth_mb, "MB"))
    if args.json:
        print(json.dumps(as_json("bench hub", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def load_rows(figures: LoadFigures, clients: int) -> list[Row]:
    """Return the figures of a crowd as rows."""
    from studio.console.rows import Row, at_most

    crowd = figures.crowd
    p50, p95, p99, _most = crowd.latency_ms
    due = max(1, crowd.sent * (clients - 1))
    return [
        Row("hub.body_to_client_ms.p50", p50, "ms"),
        at_most("hub.body_to_client_ms.p95", p95, "ms", bar=P95_MS),
        Row("hub.body_to_client_ms.p99", p99, "ms"),
        Row("hub.bodies_left_out_percent", 100 * max(0.0, 1 - crowd.received / due), "%"),
        Row("hub.late_bodies_percent", 100 * crowd.late / max(1, crowd.sent), "%"),
        Row("hub.cpu_percent", figures.cpu_percent, "%"),
        at_most("hub.rss_growth_percent", figures.growth_percent, "%", bar=GROWTH_PERCENT),
        at_most("hub.publish_ms.p99", figures.publish_ms[1], "ms", bar=PUBLISH_MS),
        Row("hub.take_ms.p50", figures.take_ms[0], "ms"),
        Row("hub.take_ms.p99", figures.take_ms[1], "ms"),
        Row("hub.sent_mb", figures.sent_bytes / 1e6, "MB"),
        Row("hub.refused", figures.refused, ""),
    ]
