"""`nexus evaluate TABLE`: the tracker against the truth, one table a question.

Pictures are drawn from the physical meshes of the built-in rooms, never from splats.
"""

from __future__ import annotations

import argparse
import importlib
import json
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.evaluate.findings import Findings

DEFAULT_PLOTS = Path("out/evaluation")

MAX_RUNS = 100
"""Runs of one table: some take minutes each."""


@dataclass(frozen=True, slots=True)
class Table:
    """One evaluation.

    Attributes:
        module: in `benchmarks.evaluate.tables`; imported when it is asked for.
        function: in that module; takes an `Asked`, gives `Findings`.
        seeds: how many runs, where `--seeds` does not say.
        published_seeds: how many are behind the figures that are published.
        question: what it answers.
    """

    module: str
    function: str
    seeds: int
    published_seeds: int
    question: str


TABLES: Mapping[str, Table] = {
    "room": Table("paper_tables", "room", 1, 5, "the paper's table 1: a chair in a room"),
    "table": Table("paper_tables", "table", 1, 5, "the paper's table 2: a book on a table"),
    "occlusion": Table("occlusion", "evaluate", 1, 5, "a moving chair, more and more of it hidden"),
    "twins": Table("twins", "evaluate", 3, 10, "two identical chairs that change places"),
    "recover": Table("recover", "evaluate", 2, 5, "ten objects moved between sessions"),
    "sequence": Table("sequence", "evaluate", 1, 5, "motion in steps of one to four frames"),
    "seeds": Table("seeds", "evaluate", 10, 10, "the default rehearsal: in most seeds, the worst"),
    "rest": Table("rest", "evaluate", 1, 5, "how much the poses of still objects shake"),
    "distance": Table("distance", "evaluate", 1, 5, "error against size, beside the bound"),
    "camera": Table("camera", "evaluate", 5, 10, "what is left of the camera pose's error"),
    "surface": Table("surface", "evaluate", 2, 5, "where the corners of live surfaces come out"),
    "model": Table("object_models", "evaluate", 1, 1, "scanned objects against the physical ones"),
    "alone": Table("alone", "evaluate", 1, 5, "one object on one core: a frame, and a cold start"),
    "latency": Table("latency", "evaluate", 1, 3, "30 frames a second in, poses out"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    from benchmarks.evaluate.filmed.conditions import Conditions

    usual = Conditions()
    parser.add_argument(
        "table",
        choices=tuple(TABLES),
        metavar="TABLE",
        help="; ".join(f"{name}: {table.question}" for name, table in TABLES.items()),
    )
    parser.add_argument(
        "--method",
        choices=("own", "paper"),
        default="own",
        help="'paper' runs the paper's method on the same frames and prints it beside ours",
    )
    parser.add_argument(
        "--seeds", metavar="N | A-B",
        help="so many runs, or those of seeds A to B (default: what takes minutes)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument(
        "--plot", type=Path, nargs="?", const=DEFAULT_PLOTS, metavar="DIR",
        help=f"also write figures as PNG and SVG ({DEFAULT_PLOTS})",
    )  # fmt: skip
    parser.add_argument(
        "--lens-px", type=int, default=usual.lens_size_px,
        help=f"side of each lens's picture, even ({usual.lens_size_px}); smaller is quicker",
    )  # fmt: skip
    parser.add_argument(
        "--noise", type=float, default=usual.noise, help="of the simulated sensor's; 0: none"
    )
    parser.add_argument(
        "--drift", type=float, default=usual.drift, help="of its exposure and colour; 0: none"
    )
    parser.add_argument(
        "--bitrate-mbps", type=float, default=usual.bitrate_mbps, help="of the H.264 stream (24)"
    )
    parser.add_argument(
        "--pose-error-deg", type=float, default=usual.pose_error_deg,
        help="of the camera's known pose (0.5)",
    )  # fmt: skip
    parser.add_argument(
        "--pose-error-cm", type=float, default=usual.pose_error_cm, help="likewise, in cm (1.0)"
    )


def run(args: argparse.Namespace) -> int:
    """Evaluate; exit 1 if a figure misses its bar."""
    from benchmarks.evaluate.filmed.asked import Asked
    from benchmarks.evaluate.filmed.conditions import Conditions
    from benchmarks.evaluate.filmed.takes import TakeCache
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, exit_code

    table = TABLES[args.table]
    seeds = seeds_of(args.seeds, table.seeds)
    _check(args)
    conditions = Conditions(
        lens_size_px=args.lens_px,
        noise=args.noise,
        drift=args.drift,
        bitrate_mbps=args.bitrate_mbps,
        pose_error_deg=args.pose_error_deg,
        pose_error_cm=args.pose_error_cm,
    )
    asked = Asked(
        methods=("own",) if args.method == "own" else ("own", "paper"),
        seeds=seeds,
        conditions=conditions,
        cache=TakeCache(),
        progress=text_progress(),
    )
    evaluate = getattr(
        importlib.import_module(f"benchmarks.evaluate.tables.{table.module}"), table.function
    )
    findings: Findings = evaluate(asked)
    runs = "1 seed" if len(seeds) == 1 else f"{len(seeds)} seeds"
    caption = f"nexus evaluate {args.table} · {' and '.join(asked.methods)} · {runs}"
    if args.plot is not None:
        from benchmarks.evaluate.drawings import write_drawings

        for path in write_drawings(findings.drawings, args.plot, caption=caption):
            print(f"figure: {path}", file=sys.stderr)
    if args.json:
        values = as_json(f"evaluate {args.table}", findings.rows)
        print(json.dumps({**values, "seeds": len(seeds), "methods": list(asked.methods)}, indent=2))
    else:
        print(_as_text(findings, caption))
    return exit_code(findings.rows)


def seeds_of(text: str | None, usual: int) -> tuple[int, ...]:
    """The seeds of "N", as many from 0 on, or of "A-B".

    Args:
        text: what was asked for; None for the usual number.
        usual: number of runs.

    Raises:
        ValueError: it is neither, or not from 1 to 100 seeds.
    """
    found = re.fullmatch(r"(?:(\d{1,6})-)?(\d{1,6})", (text or str(usual)).strip())
    if found is None:
        raise ValueError(f"--seeds {text!r}: wanted a number of runs, or A-B such as 100-107")
    first, last = (0, int(found[2]) - 1) if found[1] is None else (int(found[1]), int(found[2]))
    if not 1 <= last - first + 1 <= MAX_RUNS:
        raise ValueError(f"--seeds {last - first + 1}: wanted 1 to {MAX_RUNS} runs")
    return tuple(range(first, last + 1))


def _check(args: argparse.Namespace) -> None:
    limits = {
        "--lens-px": (args.lens_px, 64, 4096),
        "--noise": (args.noise, 0, 20),
        "--drift": (args.drift, 0, 20),
        "--bitrate-mbps": (args.bitrate_mbps, 0.5, 400),
        "--pose-error-deg": (args.pose_error_deg, 0, 10),
        "--pose-error-cm": (args.pose_error_cm, 0, 50),
    }
    for flag, (value, low, high) in limits.items():
        if not low <= value <= high:
            raise ValueError(f"{flag} {value:g}: wanted {low:g} to {high:g}")
    if args.lens_px % 2:
        raise ValueError(f"--lens-px {args.lens_px}: wanted an even number")


def _as_text(findings: Findings, caption: str) -> str:
    from studio.console.rows import as_table

    return "\n\n".join([caption, *findings.text, as_table(findings.rows)])
