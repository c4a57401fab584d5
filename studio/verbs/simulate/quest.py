"""`nexus simulate quest URL`: people with headsets who join a live session."""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.workers.task import Task

if TYPE_CHECKING:
    from sim.headset.crowd import CrowdPlan
    from sim.headset.scripted import Script
    from sim.headset.tally import Tally
    from studio.console.rows import Row

MAX_WAITING = 64
"""Codes that may wait for people; more wait in the pipe."""

FROM_INPUT = "-"
"""In place of codes: they come as lines of standard input."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("url", help="address of the hub, as `nexus live --people` prints it")
    parser.add_argument(
        "--code",
        action="append",
        default=[],
        metavar="C",
        help="of six digits, one a person; repeatable; '-': lines of standard input",
    )
    parser.add_argument("--clients", type=int, metavar="N", help="people (1)")
    parser.add_argument(
        "--scenario",
        metavar="F",
        help="they are the remote people of a scenario, who do as it says",
    )
    parser.add_argument("--seconds", type=float, metavar="S", help="how long (until Ctrl-C)")
    parser.add_argument("--hz", type=float, default=72.0, metavar="F", help="bodies a second (72)")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument("--speakers", type=int, default=0, metavar="N", help="so many speak (0)")
    parser.add_argument("--rtc", action="store_true", help="voices by WebRTC, not the WebSocket")
    parser.add_argument(
        "--answers", action="store_true", help="the first of them answers what a study asks"
    )
    parser.add_argument("--no-lines", action="store_true", help="they draw nothing")
    parser.add_argument(
        "--faults",
        nargs="+",
        default=[],
        metavar="KIND:at=S,for=S,size=V",
        help="loss, jitter, sleep, off (headset taken off), black_hole",
    )
    parser.add_argument(
        "--trust", type=Path, metavar="FILE", help="root certificate of a hub with TLS"
    )
    parser.add_argument("--json", action="store_true", help="print events and figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Let them join, and print the figures at the end; exit 1 if somebody left before it.

    Raises:
        ValueError, OSError: bad input, or the hub is not reached or lets nobody in.
    """
    from sim.headset.connection import HubRefusedError

    plan = _plan(args)
    if not args.code:
        raise ValueError("--code is missing: `nexus live --people` prints one")
    try:
        tally = asyncio.run(_play(plan, args))
    except HubRefusedError as error:
        raise ValueError(f"{args.url}: {error}") from None
    except OSError as error:
        raise ValueError(f"{args.url}: the hub is not reached: {error}") from None
    _print(tally, args)
    return int(bool(tally.failures))


def quest_rows(tally: Tally) -> list[Row]:
    """Return the figures of people who have been connected; those that were not measured are none.

    Delays of bodies are from one person of this process to another; those of states from the
    picture's arrival in the studio, by the fastest of all pings.
    """
    from studio.console.rows import Row

    rows = [
        Row("quest.sent", float(tally.sent), ""),
        Row("quest.left_out", float(tally.left_out), ""),
        Row("quest.received", float(tally.received), ""),
        Row("quest.states", float(tally.states), ""),
        Row("quest.log", float(tally.log), ""),
        Row("quest.done", float(tally.done), ""),
        Row("quest.refused", float(tally.refused), ""),
        Row("quest.unreadable", float(tally.unreadable), ""),
        Row("quest.connections", float(tally.connections), ""),
    ]
    if tally.spoken or tally.heard:
        rows.append(Row("quest.spoken", float(tally.spoken), ""))
        rows.append(Row("quest.heard", float(tally.heard), ""))
    times = (("hand_ms", tally.hand), ("state_ms", tally.state), ("voice_ms", tally.voice))
    for name, delays in times:
        for share in (50, 95):
            rows.append(Row(f"quest.{name}.p{share}", delays.percentile(share), "ms"))
    joins = (
        ("join_s", tally.joins_s),
        ("whole_s", tally.wholes_s),
        ("return_s", tally.returns_s),
    )
    for name, values in joins:
        rows.append(Row(f"quest.{name}", max(values, default=None), "s"))
    if tally.wholes_s:
        each_mb = tally.downloaded_bytes / 1e6 / len(tally.wholes_s)
        rows.append(Row("quest.room_mb", each_mb, "MB"))
    return [row for row in rows if row.value is not None]


def _plan(args: argparse.Namespace) -> CrowdPlan:
    from sim.headset.connection import HubAddress
    from sim.headset.crowd import CrowdPlan
    from sim.headset.faults import read_headset_faults
    from sim.headset.voice.speech import Speech

    scripts = () if args.scenario is None else _scripts(args.scenario)
    return CrowdPlan(
        HubAddress(args.url, args.trust),
        (len(scripts) or 1) if args.clients is None else args.clients,
        args.seconds,
        args.seed,
        args.hz,
        read_headset_faults(args.faults),
        not args.no_lines,
        scripts,
        speech=Speech(args.speakers, args.rtc),
        answers=args.answers,
    )


def _scripts(scenario: str) -> tuple[Script, ...]:
    """Return the parts of a scenario's remote people."""
    from sim.headset.scripted import scripts_of
    from sim.scenarios.scenario import load_scenario

    return scripts_of(load_scenario(scenario))


async def _play(plan: CrowdPlan, args: argparse.Namespace) -> Tally:
    from sim.headset.crowd import run_crowd

    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError, RuntimeError, ValueError):  # not on every system
            loop.add_signal_handler(number, over.set)

    def joined(count: int) -> None:
        if args.json:
            print(json.dumps({"event": "joined", "count": count}), flush=True)
        else:
            print(f"{count} of {plan.clients} here", file=sys.stderr, flush=True)

    return await run_crowd(plan, _codes(args, over), over=over, joined=joined)


async def _codes(args: argparse.Namespace, over: asyncio.Event) -> AsyncIterator[str]:
    """Give the codes in turn; those of standard input as they come, until it ends."""
    if args.code != [FROM_INPUT]:
        for code in args.code:
            yield code
        return
    # A thread of its own that nobody waits for: an end must not hang on an open pipe.
    waiting: asyncio.Queue[str] = asyncio.Queue(MAX_WAITING)
    loop = asyncio.get_running_loop()

    def read(_task: Task[None]) -> None:
        with suppress(RuntimeError):  # the loop has ended
            for line in sys.stdin:
                asyncio.run_coroutine_threadsafe(waiting.put(line.strip()), loop).result()
            asyncio.run_coroutine_threadsafe(waiting.put(""), loop)

    Task("codes", read).start()
    if not args.json:
        print("waiting for codes, one a line", file=sys.stderr, flush=True)
    over_soon = asyncio.create_task(over.wait())
    while True:
        line = asyncio.create_task(waiting.get())
        await asyncio.wait([line, over_soon], return_when=asyncio.FIRST_COMPLETED)
        if not line.done() or not line.result():
            line.cancel()
            return
        yield line.result()


def _print(tally: Tally, args: argparse.Namespace) -> None:
    from studio.console.rows import as_json, as_table

    rows = quest_rows(tally)
    if args.json:
        said: dict[str, Any] = as_json("simulate quest", rows, args.seed)
        print(json.dumps({"event": "ended", "failures": tally.failures, **said}), flush=True)
        return
    print(as_table(rows))
    for failure in tally.failures:
        print(f"nexus simulate quest: {failure}", file=sys.stderr)
