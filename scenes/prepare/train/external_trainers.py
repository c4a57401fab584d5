"""Trainers that are programs of their own, if the user has them: gsplat, Brush, OpenSplat, Inria.

Each is started on a COLMAP folder of the views that are not kept aside, so that all are judged
alike. Their licences are theirs: Inria's code is for research only, OpenSplat is AGPL; nothing
of them is part of this project.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from scenes.prepare.poses.colmap_folder import write_colmap_folder
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.held_out import score_photo
from scenes.prepare.train.trained_import import import_trained
from scenes.prepare.train.trainer import (
    Moment,
    ShowPreview,
    Stopwatch,
    TrainingOptions,
    TrainingResult,
)
from scenes.prepare.train.training_photos import Photos
from scenes.render.native import NativeRenderer
from scenes.render.renderer import RenderOptions
from scenes.render.training import Exposure
from scenes.workers.child_process import ChildProcess

ITERATIONS = 30_000
"""Steps that these programs are made for; used where the options end by time alone."""

POLL_S = 0.5
"""Seconds between two looks at the program."""
PATIENCE_S = 10.0
"""How long a program may take to end once it is asked to."""

LOG = "trainer.log"


@dataclass(frozen=True, slots=True)
class ExternalJob:
    """The arguments of a program.

    Attributes:
        data: COLMAP folder.
        out: folder for what it writes. Both are absolute: Brush takes others relative to the data.
        iterations: steps.
        budget: splats at most.
        sh_degree: of their colour.
    """

    data: Path
    out: Path
    iterations: int
    budget: int
    sh_degree: int


@dataclass(frozen=True, slots=True)
class ExternalProgram:
    """How to call a trainer.

    Attributes:
        name: as people call it.
        command: arguments, the program first.
        result: where the splats are, a pattern below the job's `out`; of several the newest counts.
        remedy: what to do if the program is missing.
    """

    name: str
    command: Callable[[ExternalJob], list[str]]
    result: str
    remedy: str


def gsplat(script: Path, python: str = "python") -> ExternalProgram:
    """The `examples/simple_trainer.py` of gsplat (Apache-2.0, needs CUDA), by MCMC."""

    def command(job: ExternalJob) -> list[str]:
        return [
            python,
            str(script),
            "mcmc",
            *("--data_dir", str(job.data), "--data_factor", "1", "--result_dir", str(job.out)),
            *("--max_steps", str(job.iterations), "--sh_degree", str(job.sh_degree)),
            *("--save_ply", "--ply_steps", str(job.iterations)),
            *("--strategy.cap-max", str(job.budget)),
            # Otherwise the splats are turned and scaled away from the poses.
            "--no-normalize-world-space",
            *("--disable_viewer", "--disable_video", "--test_every", "1000000"),
        ]

    return ExternalProgram(
        "gsplat", command, "ply/*.ply", f"install gsplat, and fetch its examples for {script}"
    )


def brush(program: str = "brush") -> ExternalProgram:
    """Brush (Apache-2.0, any GPU that wgpu knows)."""

    def command(job: ExternalJob) -> list[str]:
        return [
            program,
            str(job.data),
            *("--total-train-iters", str(job.iterations), "--max-splats", str(job.budget)),
            *("--sh-degree", str(job.sh_degree), "--export-every", str(job.iterations)),
            *("--export-path", str(job.out), "--export-name", "export_{iter}.ply"),
            *("--seed", "42"),
        ]

    return ExternalProgram("Brush", command, "*.ply", "install Brush and put it on the PATH")


def opensplat(program: str = "opensplat") -> ExternalProgram:
    """OpenSplat (AGPL-3.0; a GPU, or slowly without)."""

    def command(job: ExternalJob) -> list[str]:
        return [
            program,
            str(job.data),
            *("-o", str(job.out / "splats.ply"), "-n", str(job.iterations)),
            *("--sh-degree", str(job.sh_degree), "--max-gaussians", str(job.budget)),
            # Otherwise the splats are centred and scaled away from the poses.
            "--keep-crs",
        ]

    return ExternalProgram(
        "OpenSplat", command, "splats.ply", "install OpenSplat and put it on the PATH"
    )


def inria(script: Path, python: str = "python") -> ExternalProgram:
    """Inria's `train.py` (research only, needs CUDA); it knows no budget."""

    def command(job: ExternalJob) -> list[str]:
        return [
            python,
            str(script),
            *("-s", str(job.data), "-m", str(job.out)),
            *("--iterations", str(job.iterations), "--sh_degree", str(job.sh_degree)),
            *("--save_iterations", str(job.iterations), "--disable_viewer"),
        ]

    return ExternalProgram(
        "Inria 3DGS",
        command,
        "point_cloud/iteration_*/point_cloud.ply",
        f"fetch the graphdeco-inria/gaussian-splatting code for {script}",
    )


class ExternalTrainer:
    """Runs a program; see `scenes.prepare.train.trainer.Trainer`. It starts anew each time.

    Args:
        program: what to run.
        options: time does not count; `longest_px` only for the scores.
        stopwatch: seconds, for the history.
    """

    def __init__(
        self, program: ExternalProgram, options: TrainingOptions, *, stopwatch: Stopwatch
    ) -> None:
        self._program = program
        self._options = options
        self._stopwatch = stopwatch

    def train(
        self,
        reconstruction: Reconstruction,
        folder: Path,
        *,
        progress: Progress,
        show: ShowPreview | None = None,
    ) -> TrainingResult:
        """See `scenes.prepare.train.trainer.Trainer.train`; there are no previews.

        Raises:
            Cancelled: as raised by `progress`; the program has been ended.
            ValueError: the program is missing, failed, left no splats, or splats that do not draw
                the photos.
        """
        options, program = self._options, self._program
        folder = folder.resolve()
        photos = Photos(
            reconstruction,
            held_out_every=options.held_out_every,
            longest_px=options.longest_px,
        )
        job = ExternalJob(
            data=folder / "colmap",
            out=folder / "trained",
            iterations=options.iterations or ITERATIONS,
            budget=options.budget,
            sh_degree=options.sh_degree,
        )
        command = program.command(job)
        _require(program, command)
        write_colmap_folder(job.data, reconstruction, photos.training)
        shutil.rmtree(job.out, ignore_errors=True)
        job.out.mkdir(parents=True)
        began = self._stopwatch()
        _run(program, command, job, folder / LOG, progress)
        seconds = self._stopwatch() - began
        path = _newest(program, job, folder / LOG)
        renderer = NativeRenderer()
        cloud = import_trained(path, reconstruction, renderer)
        drawing = RenderOptions(background=options.background, threads=options.threads)
        lens = Exposure() if options.exposure else None
        scores = tuple(
            score_photo(renderer, cloud, photos.photo(view), drawing, lens=lens)
            for view in photos.held_out
        )
        history = (Moment(job.iterations, seconds, len(cloud), float("nan"), None),)
        return TrainingResult(cloud, scores, history, program.name)


def _require(program: ExternalProgram, command: list[str]) -> None:
    """Find the program and its script before anything is written."""
    scripts = [word for word in command[1:2] if word.endswith(".py")]
    missing = [word for word in scripts if not Path(word).is_file()]
    if shutil.which(command[0]) is None:
        missing.insert(0, command[0])
    if missing:
        raise ValueError(
            f"{program.name}: {missing[0]} was not found; {program.remedy}, "
            "or use the built-in trainer"
        )


def _run(
    program: ExternalProgram,
    command: list[str],
    job: ExternalJob,
    log: Path,
    progress: Progress,
) -> None:
    """Run to the end; what it prints goes to the log, from which progress is read."""
    progress(0.0, f"{program.name} starts")
    with log.open("wb") as output:
        process = ChildProcess(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            while (code := process.wait(POLL_S)) is None:
                line = _last_line(log)
                progress(_share_done(line, job.iterations), f"{program.name}: {line}")
        finally:
            process.end(PATIENCE_S)
    if code != 0:
        raise ValueError(
            f"{program.name}: ended with code {code}: {_last_line(log)!r}; all it said is in {log}"
        )


def _last_line(log: Path, tail_bytes: int = 4096) -> str:
    """The last line printed; progress bars go over the same line again and again."""
    with log.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - tail_bytes))
        text = file.read().decode(errors="replace")
    said = [line.strip() for line in re.split(r"[\r\n]+", text) if line.strip()]
    return said[-1][:200] if said else ""


def _share_done(line: str, iterations: int) -> float:
    """0..1 from "1200/30000" or "step 1200", as these programs print it; 0 if it says neither."""
    for pattern in (rf"(\d+)\s*/\s*{iterations}\b", r"(?i)\b(?:step|iter(?:ation)?)\D{0,3}(\d+)"):
        found = re.search(pattern, line)
        if found:
            return min(int(found.group(1)) / iterations, 1.0)
    return 0.0


def _newest(program: ExternalProgram, job: ExternalJob, log: Path) -> Path:
    results = sorted(job.out.glob(program.result), key=lambda path: path.stat().st_mtime_ns)
    if not results:
        raise ValueError(
            f"{program.name}: left no splats ({job.out / program.result}); all it said is in {log}"
        )
    return results[-1]
