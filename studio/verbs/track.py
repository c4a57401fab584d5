"""`nexus track`: recorded footage in, every object's pose in every frame out."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from devices.footage import FilmedBy
    from devices.messages import Frame
    from scenes.package import ScenePackage
    from studio.console.rows import Row
    from tracking.baseline.detect import Detector
    from tracking.baseline.matcher import Matcher
    from tracking.output import TrackingMethod, TrackOutput

RECORDING_SUFFIX = ".mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("scene", help="built-in room or scene package with movable objects")
    parser.add_argument(
        "video",
        type=Path,
        help="mp4 or insv video, folder of pictures with a times.csv, or MCAP recording",
    )
    parser.add_argument(
        "--camera",
        type=Path,
        metavar="CAMERA.json",
        help="lenses and place of the camera; a recording has its own; without it lenses are taken "
        "from an Insta360's .insv and the place is found in the room",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="TRACKS.json", help="poses")
    parser.add_argument(
        "--method", choices=("own", "paper"), default="own", help="tracker (default: own)"
    )
    parser.add_argument(
        "--detector",
        type=Path,
        metavar="FILE.onnx",
        help="with --method paper: your YOLO11-seg network finds the objects (default: what "
        "differs from the empty room)",
    )
    parser.add_argument(
        "--matcher",
        type=Path,
        metavar="FILE.onnx",
        help="with --method paper: your extractor with LightGlue finds corresponding points "
        "(default: SIFT)",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Track; the file of poses appears whole or not at all."""
    from scenes.formats.storage.atomic import write_file
    from scenes.opening import open_scene
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table
    from studio.session.trackers.methods import make_method

    if args.out.is_dir() or not args.out.parent.is_dir():
        raise ValueError(f"{args.out}: wanted a file name in a folder that exists")
    detector, matcher = _networks(args.method, args.detector, args.matcher)
    scene = open_scene(args.scene)
    if not scene.objects:
        raise ValueError(
            f"{args.scene}: no movable object in it; cut one out with 'nexus cut' first"
        )
    frames, span_ns = _frames(args.video, args.camera, scene=scene)
    method = make_method(
        args.method, scene, detector, matcher=matcher, stopwatch=time.perf_counter_ns
    )
    progress = text_progress()
    progress.begin(f"tracking {args.video.name}")

    def done(frame: Frame) -> None:
        progress.advance(frame.t_ns / span_ns if span_ns else 0.0, f"{frame.t_ns / 1e9:.1f} s")

    head = {
        "format": "gaussiannexus tracks",
        "version": 1,
        "units": {"length": "m", "time": "ns", "angle": "rad"},
        "scene": args.scene,
        "video": args.video.name,
    }
    tally = Tally()
    blocks = tracks_as_json(head, args.method, method, frames, done=done, tally=tally)
    write_file(args.out, blocks)
    progress.finish(f"{tally.frames} frames")
    rows = tally.rows()
    print(json.dumps(as_json("track", rows), indent=2) if args.json else as_table(rows))
    for line in tally.camera_lines:
        print(line, file=sys.stderr)
    print(f"poses: {args.out}", file=sys.stderr)
    return 0


@dataclass(slots=True)
class Tally:
    """Counts of tracked footage.

    Attributes:
        frames: how many were tracked.
        step_ms: how long each took.
        states: how often each object was in each state.
        camera_lines: what was said of the camera's pose, each once, in order.
    """

    frames: int = 0
    step_ms: list[float] = field(default_factory=list[float])
    states: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    camera_lines: list[str] = field(default_factory=list[str])

    def add(self, output: TrackOutput, step_ns: int) -> None:
        """Take one frame."""
        self.frames += 1
        self.step_ms.append(step_ns / 1e6)
        if output.camera and output.camera not in self.camera_lines[-1:]:
            self.camera_lines.append(output.camera)
        self.states.update((track.object_id, str(track.state)) for track in output.objects)

    def rows(self) -> list[Row]:
        """Frames, durations, and in which share of them each object was in which state."""
        import numpy as np

        from studio.console.rows import Row

        rows = [Row("track.frames", float(self.frames), "")]
        for percent in (50, 95):
            value = float(np.percentile(self.step_ms, percent))
            rows.append(Row(f"track.step_ms.p{percent}", value, "ms"))
        for (object_id, state), count in self.states.items():
            rows.append(Row(f"track.{object_id}.{state}", count / self.frames, ""))
        return rows


def tracks_as_json(
    head: dict[str, Any],
    name: str,
    method: TrackingMethod[Any],
    frames: Iterator[Frame],
    *,
    done: Callable[[Frame], None],
    tally: Tally,
) -> Iterator[bytes]:
    """A file of tracks, piece by piece, so that an hour of footage needs no more memory.

    Args:
        head: its fields before the tracks.
        name: of the method.
        method: the tracker.
        frames: in order of time.
        done: called with every frame that is tracked.
        tally: counts.

    Raises:
        ValueError: there is no frame, or one cannot be used.
    """
    from devices.recording_codec import track_to_json

    state = method.start()
    yield f'{json.dumps(head)[:-1]}, "methods": {{{json.dumps(name)}: ['.encode()
    for frame in frames:
        started = time.perf_counter_ns()
        state, output = method.step(state, frame, frame.received_ns)
        tally.add(output, time.perf_counter_ns() - started)
        where = output.world_from_rig
        entry = {
            "seq": frame.seq,
            "t_ns": frame.t_ns,
            "world_from_rig": None if where is None else where.matrix().tolist(),
            "objects": [{"t_ns": track.t_ns, **track_to_json(track)} for track in output.objects],
        }
        separator = "\n" if tally.frames == 1 else ",\n"
        yield (separator + json.dumps(entry, allow_nan=False)).encode()
        done(frame)
    if not tally.frames:
        raise ValueError("the footage is without a single picture")
    yield b"\n]}}\n"


def _networks(
    method: str, detector_file: Path | None, matcher_file: Path | None
) -> tuple[Detector | None, Matcher | None]:
    """The user's networks, opened and tried before anything else begins.

    Raises:
        ValueError: a file is missing or is another network, or the method has no use for one.
    """
    if method != "paper" and (detector_file or matcher_file):
        raise ValueError(
            "--detector and --matcher: our own tracker needs no networks; add --method paper"
        )
    detector, matcher = None, None
    if detector_file is not None:
        from tracking.baseline.yolo import YoloSegDetector

        detector = YoloSegDetector(detector_file)
    if matcher_file is not None:
        from tracking.baseline.lightglue import LightGlueMatcher

        matcher = LightGlueMatcher(matcher_file)
    return detector, matcher


def _frames(
    video: Path, camera_file: Path | None, *, scene: ScenePackage
) -> tuple[Iterator[Frame], int]:
    """The footage, and how long it is in nanoseconds (0 where that is not known).

    Raises:
        ValueError: the footage or the camera file is bad, or one is missing.
    """
    from dataclasses import replace

    from devices.footage import duration_ns, read_camera, read_footage
    from devices.replay import ReplayCamera

    if video.suffix.lower() == RECORDING_SUFFIX:
        recorded = ReplayCamera(video).frames()
        if camera_file is None:
            return recorded, 0
        camera = read_camera(camera_file)
        moved = (
            replace(frame, rig=camera.rig, world_from_rig=camera.world_from_rig)
            for frame in recorded
        )
        return moved, 0
    camera = _found_camera(video, scene) if camera_file is None else read_camera(camera_file)
    return read_footage(video, camera), duration_ns(video)


def _found_camera(video: Path, scene: ScenePackage) -> FilmedBy:
    """Return lenses from the footage itself, place from the room.

    Raises:
        ValueError: the footage carries no calibration, or its camera is not found.
    """
    from scenes.render.native import NativeRenderer
    from studio.live.filmed import camera_of_footage
    from studio.live.locating import RoomLocator

    renderer = NativeRenderer()
    return camera_of_footage(
        video,
        scene,
        renderer=renderer,
        locate=RoomLocator(scene, renderer),
        instead="--camera CAMERA.json with lenses, rig_from_lens and world_from_rig",
        say=lambda line: print(line, file=sys.stderr, flush=True),
    )
