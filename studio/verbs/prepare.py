"""`nexus prepare`: from photos or a video to a scene package, with a report."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from studio.console.extras import require_extra
from studio.console.rows import Row, as_json, as_table, at_most, exit_code
from studio.evaluate.verdict import OUTCOME, outcome_of, preview_min, verdict_of
from studio.verbs.flags.scale import add_object_flags, add_scale_flags, known_length, known_object

if TYPE_CHECKING:
    from scenes.cameras import Rig
    from scenes.prepare.options import PrepareOptions
    from scenes.prepare.pipeline import Prepared
    from scenes.prepare.stages import WorkFolder
    from scenes.quad import QrCode

QUALITIES = ("preview", "default", "fine")
TRAINERS = ("built-in", "gsplat", "brush", "opensplat", "inria")
MIN_FRAMES = 8
REPORT, ORIGIN = "report.html", "shared-origin.json"

EXAMPLES = """\
more examples:
  photos, a length measured in the room, its ends in two photos each
    nexus prepare photos --length 2.035 --end a 3.jpg 812 400 --end a 7.jpg 640 391 \\
      --end b 3.jpg 820 1210 --end b 7.jpg 655 1188 --out room.gnx
  an object of known size (0.6 m wide, 0.4 deep, 0.75 high), with a box around it in two photos
    nexus prepare photos --known-object 0.6,0.4,0.75 --object-box 3.jpg 410 220 702 580 \\
      --object-box 9.jpg 95 240 333 522 --out room.gnx
  a 360° camera's own video, both lenses side by side
    nexus prepare walk.mp4 --rig rig.json --qr-size 0.2 --out room.gnx
  an Insta360's own file, which carries the calibration of its lenses
    nexus prepare VID_20260101_000000_00_001.insv --qr-size 0.2 --out room.gnx
  poses that COLMAP found, or an app with ARKit, in metres
    nexus prepare photos --poses project/sparse/0 --qr-size 0.2 --out room.gnx
    nexus prepare photos --poses transforms.json --metric-poses --out room.gnx
  splats that were trained elsewhere on those poses
    nexus prepare photos --poses project --splats point_cloud.ply --qr-size 0.2 --out room.gnx
  another trainer, and a headset's mesh to collide with
    nexus prepare room.mp4 --trainer brush --mesh headset.glb --qr-size 0.2 --out room.gnx"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.epilog = f"{parser.epilog or ''}\n\n{EXAMPLES}"
    parser.add_argument(
        "source", type=Path, metavar="INPUT", help="a video, or a folder of photos; only read"
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="SCENE", help="folder of the scene package"
    )
    _pictures(parser.add_argument_group("pictures and where they were taken"))
    _scale(parser.add_argument_group("scale, up and origin"))
    _splats(parser.add_argument_group("splats and mesh"))
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument(
        "--work",
        type=Path,
        metavar="DIR",
        help="where finished stages are kept, to go on there (default: SCENE.prepare)",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    # Contradictory flags are reported like any other wrong command line.
    parser.set_defaults(refuse=parser.error)


def _pictures(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--frames", type=_frames, metavar="N", help="how many a video should give (80)"
    )
    group.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="calibration of the 360° camera that took the video, lenses side by side in it; an "
        "Insta360's .insv carries its own",
    )
    group.add_argument(
        "--poses",
        type=Path,
        metavar="PATH",
        help="take poses from a COLMAP model's folder or a transforms.json of nerfstudio or an "
        "ARKit app, instead of finding them; INPUT is the folder of its photos",
    )
    group.add_argument(
        "--metric-poses", action="store_true", help="those poses are in metres, as ARKit's are"
    )


def _scale(group: argparse._ArgumentGroup) -> None:
    add_scale_flags(group, without="Without it the scale is estimated")
    add_object_flags(group)
    group.add_argument(
        "--per-axis",
        action="store_true",
        help="stretch each axis until the codes' sides have their printed length, as in the paper; "
        "hides an error of the lens or the poses, and says how large it is",
    )
    group.add_argument(
        "--anchors",
        type=Path,
        metavar="FILE",
        help="anchors.json of a scene whose world this one shall share",
    )


def _splats(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--quality",
        choices=QUALITIES,
        default="default",
        help="training steps: 900, 3,000 or 6,000 of larger pictures, which two idle cores take in "
        "half a minute, two and eight; a busy machine takes longer",
    )
    group.add_argument(
        "--steps",
        type=int,
        metavar="N",
        help="end the training after so many steps instead of the quality's own number",
    )
    group.add_argument(
        "--trainer",
        choices=TRAINERS,
        default="built-in",
        help="what trains; the others are programs of their own, under their own licences",
    )
    group.add_argument(
        "--trainer-program",
        type=Path,
        metavar="FILE",
        help="where that program is: gsplat's simple_trainer.py, Inria's train.py, or the binary "
        "if it is not on the PATH",
    )
    group.add_argument(
        "--splats",
        type=Path,
        metavar="FILE",
        help="take splats that were trained on the photos at --poses; refused if they do not draw "
        "the photos",
    )
    group.add_argument(
        "--mesh",
        type=Path,
        metavar="FILE",
        help="collide with a headset's mesh of the room (.glb, .obj, .ply, .stl), laid on the "
        "splats' surface; otherwise that surface",
    )
    group.add_argument(
        "--keep-floaters", action="store_true", help="leave stray splats where they are"
    )
    group.add_argument(
        "--rehearsable",
        action="store_true",
        help="also train what stands for the real room in rehearsals (otherwise done by the first)",
    )


def run(args: argparse.Namespace) -> int:
    """Prepare; prints one table or JSON object and says where the report is.

    Raises:
        ValueError, OSError: as `scenes.prepare.pipeline.prepare`.
    """
    require_extra("prepare", what="nexus prepare")
    from scenes.formats.storage.atomic import write_file
    from scenes.prepare.align.shared_origin import shared_origin_to_json
    from scenes.prepare.pipeline import prepare
    from scenes.prepare.stages import open_work_folder
    from scenes.render.native import NativeRenderer
    from studio.console.progress import StageProgress, text_progress
    from studio.reports.preparation_report import render_report

    options = _options(args)
    stages = StageProgress(text_progress())
    work = open_work_folder(
        args.work or args.out.with_name(f"{args.out.name}.prepare"),
        seconds=time.monotonic,
        progress=stages,
    )
    renderer = NativeRenderer()
    prepared = prepare(args.source, args.out, work=work, options=options, renderer=renderer)
    if args.rehearsable:
        _rehearsable(args.out, work, args.seed)
    stages.finish()
    rows = rows_of(prepared)
    report = work.path / REPORT
    write_file(report, [render_report(prepared, work, rows, renderer).encode()])
    write_file(work.path / OUTCOME, [json.dumps(outcome_of(prepared), indent=2).encode()])
    if prepared.alignment.anchors:
        text = shared_origin_to_json(prepared.alignment)
        write_file(work.path / ORIGIN, [text.encode()])
    if args.json:
        print(json.dumps(as_json("prepare", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    verdict = verdict_of(prepared)
    print(verdict.headline, file=sys.stderr)
    for note in verdict.notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"scene: {args.out}\nreport: {report}", file=sys.stderr)
    print(f"next: nexus studio {args.out}", file=sys.stderr)
    return exit_code(rows)


def _rehearsable(scene: Path, work: WorkFolder, seed: int) -> None:
    """Train what stands for the real room now instead of at the first rehearsal."""
    from scenes.package import load_package, save_package
    from scenes.prepare.reality import with_reality

    package = with_reality(
        load_package(scene), work.path, seed=seed, seconds=work.seconds, progress=work.progress
    )
    save_package(package, scene)


def _options(args: argparse.Namespace) -> PrepareOptions:
    """The options, or the end of the program where the command line contradicts itself.

    Raises:
        ValueError: a file that a flag names is damaged.
    """
    from scenes.prepare.footage.capture import CaptureOptions
    from scenes.prepare.options import PrepareOptions

    codes, rig = _known_codes(args.anchors), _rig(args.rig, args.source)
    for path in (args.poses, args.splats, args.mesh, args.trainer_program):
        if path is not None and not path.exists():
            raise ValueError(f"{path}: there is no such file or folder; check the name")
    try:
        frames = {} if args.frames is None else {"frames": args.frames}
        return PrepareOptions(
            quality=args.quality,
            steps=args.steps,
            poses=args.poses,
            metric_poses=args.metric_poses,
            splats=args.splats,
            trainer=args.trainer,
            program=args.trainer_program,
            headset_mesh=args.mesh,
            sides_m=args.qr_size,
            known_codes=codes,
            known_length=known_length(args.length, args.end or []),
            known_object=known_object(args.known_object, args.object_box),
            per_axis=args.per_axis,
            capture=CaptureOptions(**frames, rig=rig),
            seed=args.seed,
            keep_floaters=args.keep_floaters,
        )
    except ValueError as error:
        refuse: NoReturn = args.refuse(str(error))
        return refuse


def rows_of(prepared: Prepared) -> list[Row]:
    """The figures of one preparation."""
    seconds = {stage.name: stage.seconds or 0.0 for stage in prepared.package.stages}
    training, alignment = prepared.training, prepared.alignment
    count = len(prepared.sfm.placed) + len(prepared.sfm.failed)
    rows = [
        at_most("prepare.wall_min", sum(seconds.values()) / 60, "min"),
        Row("prepare.preview_min", preview_min(prepared), "min"),
        at_most("prepare.train_min", seconds.get("training", 0.0) / 60, "min"),
        Row("prepare.placed", len(prepared.sfm.placed) / count, ""),
        Row("prepare.reprojection_px", prepared.sfm.error_px, "px"),
        Row("prepare.psnr_db", training.psnr_db, "dB"),
        Row("prepare.ssim", training.ssim, ""),
        Row("prepare.splats", len(prepared.package.room), ""),
        Row("prepare.floaters", prepared.floaters, ""),
    ]
    if alignment.anchors:
        middle = prepared.package.footprint_m.mean(axis=0)
        bound = alignment.predicted_error_m([[*middle, 1.0]], bound=0.95)
        rows.append(Row("prepare.alignment_mm.predicted_95", 1000 * float(bound[0]), "mm"))
    if prepared.axis_scale is not None:
        rows.append(Row("prepare.anisotropy", prepared.axis_scale.anisotropy, ""))
    return rows


def _frames(text: str) -> int:
    if not text.isdigit() or int(text) < MIN_FRAMES:
        raise argparse.ArgumentTypeError(f"{text}: wanted {MIN_FRAMES} or more")
    return int(text)


def _known_codes(path: Path | None) -> tuple[QrCode, ...]:
    from scenes.package.files import read_items
    from scenes.package.records import code_from_json

    if path is None:
        return ()
    try:
        return tuple(code_from_json(values) for values in read_items(path))
    except KeyError as error:
        raise ValueError(f"{path}: field {error} is missing; give a scene's anchors.json") from None


def _rig(path: Path | None, source: Path) -> Rig | None:
    """Return the lenses of a 360° camera: as a file says, or as the camera's own video does."""
    from scenes.cameras import rig_from_json

    if path is None:
        if source.suffix.lower() != ".insv":
            return None
        from studio.live.filmed import carried_rig

        return carried_rig(
            source,
            instead="its rig file with --rig, or export a flat video from the camera's own program",
            say=lambda line: print(line, file=sys.stderr, flush=True),
        )
    try:
        return rig_from_json(json.loads(path.read_text(encoding="utf-8-sig")))
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(
            f"{path}: no calibration of a 360° camera ({error}); wanted JSON with lenses and "
            "rig_from_lens, see docs/preparation.md"
        ) from None
