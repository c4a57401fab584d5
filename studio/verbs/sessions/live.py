"""`nexus live SCENE`: a live 360° camera in, objects followed, everything recorded."""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.workers.task import Task
from studio.verbs.flags import hololens as hololens_flags
from studio.verbs.flags.hololens import add_hololens_flags, wearing_of, with_hololens
from studio.verbs.flags.people import add_people_flags, hosting_of, sharing_of
from studio.verbs.flags.results import add_result_flags, check_free, next_free

if TYPE_CHECKING:
    from devices.clock import Clock
    from devices.hub.entry.tokens import Tokens
    from devices.hub.server import Hub
    from scenes.package import ScenePackage
    from studio.console.rows import Row
    from studio.live.hololens.wearing import Wearing
    from studio.live.live import LiveSession
    from studio.live.people.crowd import Crowd
    from studio.live.rehearsed import RehearsedLive
    from studio.live.setup import LiveSetup
    from studio.live.sites.shared_room import SharedRoom
    from studio.live.status import LiveResult
    from studio.session.preflight import Check
    from studio.session.session import SessionOutput

DEFAULT_CAMERA = "rtmp://:1935/live/room"
"""Address on which the studio listens when none is given: any camera's app can push there."""

DEFAULT_OUT = Path("out/live")

STATUS_S = 1.0
"""Seconds between two status lines."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("scene", nargs="?", default="lab", help="room or scene package")
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        "--camera", metavar="ADDRESS", help=f"where its pictures come from ({DEFAULT_CAMERA})"
    )
    source.add_argument("--devices", type=Path, metavar="FILE", help="devices as TOML")
    source.add_argument(
        "--simulated",
        action="store_true",
        help="a simulated camera in a process of its own, cut off for 20 s and bumped by 0.6°; "
        "the session is held against its truth",
    )
    parser.add_argument("--layout", default="auto", help="such as 'side_by_side 0 0' (auto)")
    parser.add_argument(
        "--place",
        choices=("find", "scan"),
        default="find",
        help="look for the camera in the room, or take it to stand where the scan has it",
    )
    parser.add_argument("--scenario", metavar="F", help="with --simulated: what happens")
    parser.add_argument("--seed", type=int, default=0, help="with --simulated: all that is random")
    parser.add_argument("--seconds", type=float, metavar="N", help="end after so long live")
    parser.add_argument("--headless", action="store_true", help="without a window")
    parser.add_argument("--no-record", action="store_true", help="leave no recording")
    add_hololens_flags(parser)
    add_people_flags(parser)
    add_result_flags(parser, DEFAULT_OUT)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Play it; exit 1 if a check or a figure fails."""
    from studio.console.display import why_no_window

    if args.seconds is not None and not args.seconds > 0:
        raise ValueError(f"--seconds {args.seconds:g}: wanted more than 0")
    if (args.scenario or args.seed) and not args.simulated:
        raise ValueError("--scenario and --seed go with --simulated: a real camera has neither")
    if args.clients and not args.headless:
        raise ValueError("--clients goes with --headless: simulated people are measured there")
    hololens_flags.check_hostile(args)
    if args.scenario_people:
        args.clients = _scenario_people(args)
    hosting = hosting_of(args)
    no_window = "" if args.headless else why_no_window()
    if no_window is None:
        from studio.app.model.jobs.live_job import LivePlan
        from studio.app.window import live_in_window

        plan = LivePlan(
            args.scene,
            setup_of(args),
            args.out or DEFAULT_OUT,  # every session gets a folder of its own in it
            is_simulated=args.simulated,
            scenario=args.scenario,
            seed=args.seed,
            seconds=args.seconds,
            records=not args.no_record,
            hosting=hosting,
            sharing=sharing_of(args),
            wears=args.hololens is not None,
        )
        return live_in_window(plan)
    if no_window:
        print(f"{no_window}: going live without a window", file=sys.stderr)
    return _headless(args)


def _scenario_people(args: argparse.Namespace) -> int:
    """Return how many remote people the scenario has.

    Raises:
        ValueError: it has none, or other flags are missing or say otherwise.
    """
    from sim.headset.scripted import scripts_of
    from sim.scenarios.scenario import load_scenario

    if not (args.scenario and args.headless) or args.clients:
        raise ValueError("--scenario-people goes with --headless and --scenario, not --clients")
    return len(scripts_of(load_scenario(args.scenario)))


def setup_of(args: argparse.Namespace) -> LiveSetup:
    """The devices that the flags ask for.

    Raises:
        ValueError, OSError: an address, a layout or a file is bad.
    """
    from devices.camera.address import parse_address
    from studio.live.setup import LiveSetup, Place, parse_layout, read_setup

    if args.devices is not None:
        return with_hololens(read_setup(args.devices), args)
    # A simulated camera pushes to a port of its own: several sessions can run beside each other.
    address = "rtmp://127.0.0.1:0/live/room" if args.simulated else args.camera or DEFAULT_CAMERA
    setup = LiveSetup(
        parse_address(address), layout=parse_layout(args.layout), place=Place(args.place)
    )
    return with_hololens(setup, args)


def _headless(args: argparse.Namespace) -> int:
    from devices.clock import WallClock
    from devices.hub.entry.tokens import Tokens
    from scenes.memory import share_one_heap
    from scenes.opening import open_scene
    from scenes.render.native import NativeRenderer
    from studio.live.checks import live_checks
    from studio.live.hololens.simulated.attacking import Defects
    from studio.live.live import LiveSession
    from studio.live.locating import RoomLocator
    from studio.live.report import live_rows, write_report
    from studio.live.setup import recording_in
    from studio.session.preflight import run_checks, save_checks

    share_one_heap()
    out = args.out or next_free(DEFAULT_OUT)
    check_free(out, replaces=args.replace)
    scene = open_scene(args.scene)
    out.mkdir(parents=True, exist_ok=True)
    renderer, clock, tokens = NativeRenderer(), WallClock(), Tokens()
    with ExitStack() as stack:
        defects = stack.enter_context(Defects(_say))
        hub = _hub(args, scene, clock=clock, stack=stack, tokens=tokens, say=defects.hear)
        setup = setup_of(args)
        wearing = wearing_of(args, setup, scene=scene, clock=clock, hub=hub, stack=stack, say=_say)
        session = LiveSession(
            args.scene,
            scene,
            setup,
            clock=clock,
            renderer=renderer,
            locate=RoomLocator(scene, renderer),
            record_to=None if args.no_record else recording_in(out),
            people=_shared(args, scene, hub=hub, clock=clock, stack=stack) or hub,
            worn=None if wearing is None else wearing.worn,
        )
        crowd = _crowd(args, session, hub=hub, stack=stack, clock=clock, tokens=tokens)
        rehearsed = _rehearsed(args, session, stack=stack, crowd=crowd, wearing=wearing)
        if rehearsed is None and session.status().listening_at:
            _say(f"enter in the camera: {session.status().listening_at}")
        simulated = None if rehearsed is None else lambda: "it streams"
        checks = run_checks(live_checks(session, recordings=out, simulated=simulated))
        save_checks(checks, out / "preflight.json")
        _print_checks(checks)
        _say_how_to_join(args, hub)
        hololens_flags.let_others_in(args, wearing=wearing, session=session, hub=hub)
        result = _play(session, rehearsed, args, hub=hub)
        rows = live_rows(result)
        if rehearsed is not None:
            rows += rehearsed.rows(result)
        if crowd is not None:
            rows += crowd.rows()
        if wearing is not None:
            rows += wearing.rows(() if rehearsed is None else rehearsed.true_poses())
            rows += wearing.attacked_rows(defects.count)
            hololens_flags.save_worn(args, wearing, scene=scene, out=out, say=_say)
    path = write_report(out, result, rows, scene=args.scene, checks=checks)
    return _print_figures(args, rows, report=path, failure=result.recording_failure)


def _rehearsed(
    args: argparse.Namespace,
    session: LiveSession,
    *,
    stack: ExitStack,
    crowd: Crowd | None,
    wearing: Wearing | None,
) -> RehearsedLive | None:
    """Begin the simulated camera, until the stack is left, and wait for its stream."""
    from studio.live.rehearsed import RehearsedLive, usual_feed

    if not args.simulated:
        return None
    truth = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "truth.jsonl"
    rehearsed = stack.enter_context(
        RehearsedLive(
            session,
            usual_feed(args.scene, args.scenario, args.seed),
            truth=truth,
            seconds=args.seconds,
            apart=lambda: [i for each in (crowd, wearing) if each for i in each.process_ids],
        )
    )
    if wearing is not None:
        wearing.follow(truth)
    rehearsed.wait_for_stream(_say)
    return rehearsed


def _print_figures(
    args: argparse.Namespace, rows: Sequence[Row], *, report: Path, failure: str
) -> int:
    """Print the figures; return the exit code."""
    from studio.console.rows import as_json, as_table, exit_code

    if args.json:
        print(json.dumps(as_json("live", rows, args.seed if args.simulated else None), indent=2))
    else:
        print(as_table(rows))
    _say(f"report: {report}")
    if failure:
        _say(f"nexus live: {failure}")
        return 1
    return exit_code(rows)


def _hub(
    args: argparse.Namespace,
    scene: ScenePackage,
    *,
    clock: Clock,
    stack: ExitStack,
    tokens: Tokens,
    say: Callable[[str], None],
) -> Hub | None:
    """Begin to let people join until the stack is left."""
    from studio.live.people.hosting import hosted

    hosting = hosting_of(args)
    if hosting is None:
        return None
    # What the hub says is in the session's report, and who is here on the status line.
    return stack.enter_context(hosted(hosting, scene, clock=clock, say=say, tokens=tokens))


def _shared(
    args: argparse.Namespace,
    scene: ScenePackage,
    *,
    hub: Hub | None,
    clock: Clock,
    stack: ExitStack,
) -> SharedRoom | None:
    """Share the session until the stack is left."""
    from studio.live.sites.sharing import shared

    sharing = sharing_of(args)
    if sharing is None:
        return None
    return stack.enter_context(
        shared(
            sharing,
            scene,
            scene_name=args.scene,
            inner=hub,
            hub=lambda: hub,
            clock=clock,
            say=_say,
        )
    )


def _crowd(
    args: argparse.Namespace,
    session: LiveSession,
    *,
    hub: Hub | None,
    stack: ExitStack,
    clock: Clock,
    tokens: Tokens,
) -> Crowd | None:
    """Let simulated people join once the session is live."""
    from studio.live.people.crowd import Crowd

    if hub is None or not args.clients:
        return None
    trusted: Path | None = None
    if hub.root_pem is not None:
        trusted = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "root.pem"
        trusted.write_bytes(hub.root_pem)
    crowd = Crowd(
        hub,
        lambda: session.status().live_s,
        clients=args.clients,
        seconds=args.seconds,
        clock=clock,
        tokens=tokens,
        say=_say,
        trusted=trusted,
        scenario=args.scenario if args.scenario_people else None,
    )
    crowd.start()
    stack.callback(crowd.end)
    return crowd


def _say_how_to_join(args: argparse.Namespace, hub: Hub | None) -> None:
    """Make the codes, which are good for two minutes, once the camera is there."""
    from studio.live.people.desk import HELP, listen
    from studio.live.people.hosting import invitations_for, join_line

    hosting = hosting_of(args)
    if hub is not None and hosting is not None:
        _say(join_line(hub, hosting, invitations=invitations_for(hub, hosting)))
        if not args.clients and listen(hub, hosting, say=_say) is not None:
            _say(HELP)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _play(
    session: LiveSession,
    rehearsed: RehearsedLive | None,
    args: argparse.Namespace,
    *,
    hub: Hub | None,
) -> LiveResult:
    """Run it on this thread, with a status line, until its time is over or Ctrl-C."""
    status = Task("status", lambda task: _watch_over(session, args.seconds, task, hub=hub)).start()
    if rehearsed is not None:
        rehearsed.direct()

    def watch(output: SessionOutput) -> None:
        if rehearsed is not None:
            rehearsed.watch(output)

    previous = signal.signal(signal.SIGINT, lambda *_: session.end())
    try:
        return session.run(watch)
    finally:
        signal.signal(signal.SIGINT, previous)
        status.cancel()


def _watch_over(
    session: LiveSession, seconds: float | None, task: Task[None], *, hub: Hub | None
) -> None:
    """Say how it goes and who is here, and end it when it was live for long enough."""
    from studio.live.people.hosting import who_words

    said = ""
    while not task.pause(STATUS_S):
        status = session.status()
        if seconds is not None and status.live_s is not None and status.live_s >= seconds:
            session.end()
            return
        who = "" if hub is None else who_words(hub.people())
        line = "; ".join(filter(None, (f"{status.state}: {status.text}", who)))
        if line != said:
            said = line
            _say(line)


def _print_checks(checks: Sequence[Check]) -> None:
    marks = {"PASS": "✓", "WARN": "!", "FAIL": "✗"}
    for check in checks:
        fix = f": {check.fix}" if check.fix else ""
        print(f"{marks[check.verdict]} {check.name}: {check.what}{fix}", file=sys.stderr)
