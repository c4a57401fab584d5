"""`nexus simulate camera SCENE|RECORDING|VIDEO`: a 360° camera on real sockets."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from scenes.workers.task import Task
from studio.console.progress import Progress, text_progress

if TYPE_CHECKING:
    from devices.clock import Clock
    from sim.wire.faults import FaultSchedule, WireFault
    from sim.wire.film.film import Film
    from sim.wire.streaming.camera import CameraPlan, FilmCamera
    from sim.wire.streaming.events import CameraEvent
    from sim.wire.streaming.truth_file import TruthWriter

DEFAULT_PUSH = "rtmp://127.0.0.1:1935/live/room"
"""Address that it streams to when none is given: where the studio listens by default."""

STATUS_S = 1.0
"""Seconds between two status lines."""

CONTROL_LEAD_S = 0.1
"""Seconds from a line of standard input to its fault: later than what was already asked about."""

LOCAL = frozenset({"127.0.0.1", "localhost", "::1"})
"""Hosts that are this computer."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "source", nargs="?", default="lab", help="scene, recording (.mcap) or video (default: lab)"
    )
    parser.add_argument("--scenario", metavar="F", help="name or TOML file (default: the scene's)")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    out = parser.add_argument_group("where it streams to")
    out.add_argument("--push", metavar="URL", action="append", help=f"RTMP, e.g. {DEFAULT_PUSH}")
    out.add_argument("--rtsp", type=int, metavar="PORT", help="serve RTSP there; 0: any port")
    out.add_argument("--insta360", type=int, metavar="PORT", help="TCP 6666 of a camera; 0: any")
    out.add_argument("--osc", type=int, metavar="PORT", help="its HTTP interface; 0: any")
    out.add_argument(
        "--network", action="store_true", help="not only this computer: listen to all, push to any"
    )
    film = parser.add_argument_group("what it shows")
    film.add_argument("--fps", type=float, default=30.0, help="pictures a second (default: 30)")
    film.add_argument("--size", default="2880x1440", metavar="WxH", help="default: 2880x1440")
    film.add_argument(
        "--layout",
        choices=("side_by_side", "stacked", "turned", "equirectangular"),
        default="side_by_side",
        help="how the lens pictures lie in it (default: side_by_side)",
    )
    film.add_argument("--bitrate", type=float, default=24.0, metavar="MBIT", help="default: 24")
    film.add_argument("--keyframe-s", type=float, default=1.0, metavar="S", help="default: 1")
    film.add_argument(
        "--film-seconds",
        type=float,
        metavar="S",
        help="draw only so much of the script; it is shown forward and backward",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        metavar="N",
        help="how long (default: a script until Ctrl-C, a recording or video once)",
    )
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="KIND:at=S,for=S,size=V",
        help="delay, jitter, loss, freeze, black_hole, half_open, restart, garbage, clock_drift, "
        "bump or light; repeatable",
    )
    parser.add_argument("--faults", type=Path, metavar="FILE", help="the same as TOML [[fault]]")
    parser.add_argument(
        "--control",
        action="store_true",
        help="take more faults while it streams, one a line of standard input, at= from then",
    )
    parser.add_argument("--truth", type=Path, metavar="FILE", help="write the truth as JSON lines")
    parser.add_argument("--json", action="store_true", help="print events as lines of JSON")


def run(args: argparse.Namespace) -> int:
    """Make or find the film, stream it, and say what happens.

    Raises:
        ValueError, OSError: bad input, a port that is taken, or a full disk.
    """
    from sim.wire.faults import FaultSchedule, read_fault, read_faults_file
    from sim.wire.streaming.camera import CameraPlan
    from sim.wire.streaming.truth_file import TruthWriter

    faults = tuple(read_fault(text) for text in args.fault)
    if args.faults is not None:
        faults += read_faults_file(args.faults)
    _check_hosts(args)
    voice = _Voice(is_json=args.json)
    film = _film(args, faults, voice)
    is_script = bool(film.truth) and not _is_file(args.source)
    seconds = args.seconds
    if seconds is None and not is_script:
        seconds = film.duration_ns / 1e9
    plan = CameraPlan(film, FaultSchedule(faults), seconds, args.seed)
    truth = None if args.truth is None else TruthWriter(args.truth)
    try:
        return _stream(args, plan, truth, voice)
    finally:
        if truth is not None:
            truth.close()


def _stream(
    args: argparse.Namespace, plan: CameraPlan, truth: TruthWriter | None, voice: _Voice
) -> int:
    from devices.clock import WallClock
    from sim.wire.streaming.camera import FilmCamera

    clock = WallClock()
    camera = FilmCamera(plan, clock, wall_ns=time.time_ns, say=voice.event, truth=truth)
    reason = "cancelled"
    try:
        voice.say("started", _outputs(args, plan, camera, clock), _about(plan.film, args))
        camera.start()
        if args.control:
            _take_faults(plan.schedule, camera, voice)
        while camera.is_running and not voice.is_left:
            camera.join(STATUS_S)
            voice.status(camera)
        reason = "left" if voice.is_left else "played"
    except KeyboardInterrupt:
        pass  # the usual way to end it
    finally:
        camera.close()
        totals = {
            o.name: {"connections": o.connections, "sent": o.sent_units} for o in camera.outputs
        }
        voice.say("ended", {"reason": reason, "taken": camera.taken, "outputs": totals})
    return 0


def _take_faults(schedule: FaultSchedule, camera: FilmCamera, voice: _Voice) -> None:
    """Read faults from standard input on a thread of its own, until it ends."""
    from sim.timed_fault import FaultError
    from sim.wire.faults import read_fault

    def read(_task: Task[None]) -> None:
        for line in sys.stdin:
            try:
                fault = read_fault(line)
                now_s = camera.now_ns() / 1e9 + CONTROL_LEAD_S
                schedule.add(replace(fault, at_s=now_s + fault.at_s))
            except FaultError as error:
                voice.say("refused", {"why": str(error)})

    Task("control", read).start()


def _outputs(
    args: argparse.Namespace, plan: CameraPlan, camera: FilmCamera, clock: Clock
) -> dict[str, Any]:
    """Make the outputs that were asked for; where each is."""
    from sim.wire.streaming.insta360_output import Insta360Output, Insta360Ports
    from sim.wire.streaming.rtmp_output import RtmpOutput
    from sim.wire.streaming.rtsp_output import RtspOutput, RtspPlace

    host = "0.0.0.0" if args.network else "127.0.0.1"
    where: dict[str, Any] = {}
    if args.rtsp is not None:
        place = RtspPlace(host, args.rtsp)
        served = RtspOutput(place, plan.film, camera.setting(), wall_ns=time.time_ns)
        camera.add(served)
        where["rtsp"] = served.url
        where["rtsp_port"] = served.port
    if args.insta360 is not None or args.osc is not None:
        ports = Insta360Ports(host, args.insta360 or 0, args.osc)
        output = Insta360Output(ports, clock, camera.setting())
        camera.add(output)
        where["insta360"] = output.url
        where["insta360_port"] = output.ports.preview
        if output.ports.osc is not None:
            where["osc"] = f"http://{host}:{output.ports.osc}"
            where["osc_port"] = output.ports.osc
    pushes = list(args.push or ([] if where else [DEFAULT_PUSH]))
    if pushes:
        where["push"] = pushes
    for url in pushes:
        camera.add(RtmpOutput(url, camera.setting()))
    return where


def _check_hosts(args: argparse.Namespace) -> None:
    for url in args.push or []:
        parts = urlsplit(url)
        if parts.scheme != "rtmp" or not parts.hostname:
            raise ValueError(f"--push {url}: wanted an address such as {DEFAULT_PUSH}")
        if parts.hostname not in LOCAL and not args.network:
            raise ValueError(
                f"--push {url}: another computer; give --network to stream (and to be faulty) there"
            )


def _is_file(source: str) -> bool:
    from devices.footage import VIDEO_SUFFIXES
    from sim.wire.film.found import RECORDING_SUFFIX

    return Path(source).suffix.lower() in (*VIDEO_SUFFIXES, RECORDING_SUFFIX)


def _film(args: argparse.Namespace, faults: tuple[WireFault, ...], voice: _Voice) -> Film:
    """The film that was asked for, from the cache or made now."""
    if not _is_file(args.source):
        return _script_film(args, faults, voice)
    from sim.wire.faults import FILMED
    from sim.wire.film.film_file import cached_film, film_digest
    from sim.wire.film.found import RECORDING_SUFFIX, film_recording, film_video

    drawn = [fault.kind.value for fault in faults if fault.kind in FILMED]
    if drawn:
        raise ValueError(
            f"{args.source}: a finished video, in which no {drawn[0]} can be drawn; "
            "that needs a scene"
        )
    path = Path(args.source)
    found = path.stat()
    digest = film_digest(
        {"file": str(path.resolve()), "size": found.st_size, "time": found.st_mtime_ns}
    )
    fill = film_recording if path.suffix.lower() == RECORDING_SUFFIX else film_video
    return cached_film(films_folder(), digest, lambda folder: fill(folder, path))[0]


def _script_film(args: argparse.Namespace, faults: tuple[WireFault, ...], voice: _Voice) -> Film:
    from sim.wire.faults import film_faults
    from sim.wire.film.drawn import LONGEST_S, FilmOptions, draw_film, filmed_scenario
    from sim.wire.film.film_file import cached_film, film_digest
    from sim.wire.film.layouts import Layout
    from studio.console.machine import program_version
    from studio.session.opening import scene_hash
    from studio.session.staging import staging_of

    options = FilmOptions(
        _size(args.size),
        args.fps,
        LONGEST_S if args.film_seconds is None else args.film_seconds,
        Layout(args.layout),
        round(1e6 * args.bitrate),
        args.keyframe_s,
    )
    staging = staging_of(args.source, args.scenario)
    drawn = film_faults(faults)
    scenario = filmed_scenario(staging.scenario, options, drawn)
    digest = film_digest(
        {
            "scene": scene_hash(staging.scene),
            "scenario": staging.scenario_text,
            "faults": [repr(fault) for fault in drawn],
            "seed": args.seed,
            "options": repr(options),
            "program": program_version(),
        }
    )
    progress = voice.progress()

    def fill(folder: Path) -> None:
        progress.begin(f"drawing {scenario.name}, once")
        draw_film(
            folder,
            staging.room,
            scenario,
            seed=args.seed,
            options=options,
            scanned=staging.scanned,
            progress=progress.advance,
        )
        progress.finish(f"{scenario.frame_count} pictures")

    return cached_film(films_folder(), digest, fill)[0]


def films_folder() -> Path:
    """Return the folder of films: in NEXUS_HOME where that is set, else in the user's cache."""
    import platformdirs

    named = os.environ.get("NEXUS_HOME")
    home = Path(named) if named else Path(platformdirs.user_cache_dir("gaussiannexus-studio"))
    return home / "films"


def _size(text: str) -> tuple[int, int]:
    width, mark, height = text.lower().partition("x")
    if not mark or not width.isdecimal() or not height.isdecimal():
        raise ValueError(f"--size {text}: wanted WIDTHxHEIGHT such as 2880x1440")
    return int(width), int(height)


def _about(film: Film, args: argparse.Namespace) -> dict[str, Any]:
    return {
        "film": film.name,
        "size": [film.form.width_px, film.form.height_px],
        "fps": round(film.form.fps, 3),
        "layout": film.form.layout,
        "round_s": round(film.duration_ns / 1e9, 3),
        "has_truth": bool(film.truth),
        "truth": None if args.truth is None else str(args.truth),
    }


class _Voice:
    """Says what happens: for people, or as lines of JSON."""

    def __init__(self, *, is_json: bool) -> None:
        self._is_json = is_json
        self._lock = threading.Lock()
        self._is_terminal = sys.stdout.isatty()
        self._parent = os.getppid()
        self._is_deaf = False

    @property
    def is_left(self) -> bool:
        """Whether nobody reads the events any more: a child that nobody would end must end."""
        return self._is_deaf or (self._is_json and os.getppid() != self._parent)

    def progress(self) -> Progress:
        """Says how far the drawing is: on the terminal, or as events."""
        if not self._is_json:
            return text_progress()
        return Progress(lambda text, _is_last: self.say("drawing", {"text": text}), every_s=1.0)

    def event(self, event: CameraEvent) -> None:
        """An event of the camera."""
        self.say(event.name, {"t_ns": event.t_ns, **event.values})

    def say(self, name: str, *values: Mapping[str, Any]) -> None:
        """One event."""
        whole = {key: value for each in values for key, value in each.items()}
        with self._lock:
            if self._is_json:
                line = {"event": name, "wall_ns": time.time_ns(), **whole}
                self._print(json.dumps(line))
            else:
                words = ", ".join(f"{key} {value}" for key, value in whole.items() if key != "t_ns")
                self._print(f"{name.replace('_', ' ')}: {words}")

    def _print(self, line: str) -> None:
        try:
            print(line, flush=True)
        except BrokenPipeError:
            # It is not this thread's to end the camera; nothing more can be said, not even at exit.
            self._is_deaf = True
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def status(self, camera: FilmCamera) -> None:
        """How it goes, on a line that is written over."""
        if self._is_json or not self._is_terminal:
            return
        parts = [f"{o.name} {o.sent_units} sent" for o in camera.outputs]
        with self._lock:
            print(f"\r{camera.now_ns() / 1e9:7.1f} s  {', '.join(parts)}  ", end="", flush=True)
