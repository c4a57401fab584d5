"""`nexus prepare`: from photos or a video to a scene package, with a report."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studio.rows import Row, as_json, as_table, at_most, exit_code

if TYPE_CHECKING:
    from scenes.prepare.pipeline import KnownLength, Prepared

QUALITIES = ("preview", "default", "fine")
REPORT = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "source", type=Path, metavar="INPUT", help="a video, or a folder of photos; only read"
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="SCENE", help="folder of the scene package"
    )
    parser.add_argument(
        "--qr-size",
        type=_sides,
        metavar="M",
        help="printed side of the codes in metres, without the white border; "
        "or CODE=M,CODE=M where they differ. Without it the scale is guessed",
    )
    parser.add_argument(
        "--anchors",
        type=Path,
        metavar="FILE",
        help="anchors.json of a scene whose world this one shall share",
    )
    parser.add_argument(
        "--length",
        type=float,
        metavar="M",
        help="a length measured in the room, where no code is; --end says between what",
    )
    parser.add_argument(
        "--end",
        nargs=4,
        action="append",
        metavar=("WHICH", "PHOTO", "X", "Y"),
        help="pixel of one end of the length (a or b) in a photo; two photos or more for each end",
    )
    parser.add_argument(
        "--quality",
        choices=QUALITIES,
        default="default",
        help="training time: half a minute, two, eight",
    )
    parser.add_argument("--frames", type=int, metavar="N", help="how many a video should give")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="where unfinished stages are kept, to go on there (default: SCENE.prepare)",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Prepare; prints one table or JSON object and says where the report is.

    Raises:
        ValueError, OSError: as `scenes.prepare.pipeline.prepare`.
    """
    from scenes.formats.atomic import write_file
    from scenes.prepare.footage.capture import CaptureOptions
    from scenes.prepare.pipeline import PrepareOptions, prepare
    from scenes.prepare.stages import open_work_folder
    from scenes.render.native import NativeRenderer
    from studio.preparation_report import render_report
    from studio.progress import StageProgress, text_progress

    told = StageProgress(text_progress())
    work = open_work_folder(
        args.work or args.out.with_name(f"{args.out.name}.prepare"),
        seconds=time.monotonic,
        progress=told,
    )
    options = PrepareOptions(
        quality=args.quality,
        sides_m=args.qr_size,
        known_codes=_known_codes(args.anchors),
        known_length=_known_length(args.length, args.end or []),
        capture=CaptureOptions() if args.frames is None else CaptureOptions(frames=args.frames),
        seed=args.seed,
    )
    renderer = NativeRenderer()
    prepared = prepare(args.source, args.out, work=work, options=options, renderer=renderer)
    told.finish()
    rows = rows_of(prepared)
    report = work.path / REPORT
    write_file(report, [render_report(prepared, work, rows, renderer).encode()])
    if args.json:
        print(json.dumps(as_json("prepare", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    for warning in prepared.alignment.warnings:
        print(f"note: {warning}", file=sys.stderr)
    print(f"scene: {args.out}\nreport: {report}", file=sys.stderr)
    print(f"next: nexus studio {args.out}", file=sys.stderr)
    return exit_code(rows)


def rows_of(prepared: Prepared) -> list[Row]:
    """The figures of one preparation."""
    seconds = {stage.name: stage.seconds or 0.0 for stage in prepared.package.stages}
    training, alignment = prepared.training, prepared.alignment
    count = len(prepared.sfm.placed) + len(prepared.sfm.failed)
    rows = [
        at_most("prepare.wall_min", sum(seconds.values()) / 60, "min"),
        at_most("prepare.train_min", seconds.get("training", 0.0) / 60, "min"),
        Row("prepare.placed", len(prepared.sfm.placed) / count, ""),
        Row("prepare.reprojection_px", prepared.sfm.error_px, "px"),
        Row("prepare.psnr_db", training.psnr_db, "dB"),
        Row("prepare.ssim", training.ssim, ""),
        Row("prepare.splats", len(training.cloud), ""),
    ]
    if alignment.anchors:
        middle = prepared.package.footprint_m.mean(axis=0)
        bound = alignment.predicted_error_m([[*middle, 1.0]], bound=0.95)
        rows.append(Row("prepare.alignment_mm.predicted_95", 1000 * float(bound[0]), "mm"))
    return rows


def _sides(text: str) -> float | Mapping[str, float]:
    """`0.2`, or `CODE=0.2,OTHER=0.16`."""
    try:
        if "=" not in text:
            return float(text)
        pairs = [part.rpartition("=") for part in text.split(",")]
        return {payload.strip(): float(side) for payload, _, side in pairs}
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r}: wanted metres such as 0.2, or CODE=0.2,OTHER=0.16"
        ) from None


def _known_length(length_m: float | None, ends: Sequence[Sequence[str]]) -> KnownLength | None:
    """The measured length with its ends in photos.

    Raises:
        ValueError: an end is neither a nor b or has no pixel, or only one of both flags is given.
    """
    from scenes.prepare.pipeline import KnownLength

    if length_m is None and not ends:
        return None
    if length_m is None or not ends:
        raise ValueError("--length and --end belong together: metres, and the pixels of both ends")
    picks: dict[str, dict[str, tuple[float, float]]] = {"a": {}, "b": {}}
    for which, photo, x, y in ends:
        try:
            picks[which.lower()][photo] = (float(x), float(y))
        except (KeyError, ValueError):
            raise ValueError(
                f"--end {which} {photo} {x} {y}: wanted a or b, a photo's name and two numbers"
            ) from None
    return KnownLength(length_m, picks["a"], picks["b"])


def _known_codes(path: Path | None) -> tuple:
    from scenes.package_files import read_items
    from scenes.package_records import code_from_json

    if path is None:
        return ()
    try:
        return tuple(code_from_json(values) for values in read_items(path))
    except KeyError as error:
        raise ValueError(f"{path}: field {error} is missing; give a scene's anchors.json") from None
