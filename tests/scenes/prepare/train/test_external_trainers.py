"""External trainers, played by a script."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from scenes.formats.registry import write_splats
from scenes.prepare.progress import Cancelled, silent
from scenes.prepare.train import external_trainers
from scenes.prepare.train.external_trainers import (
    ExternalJob,
    ExternalProgram,
    ExternalTrainer,
    brush,
    gsplat,
    inria,
    opensplat,
)
from scenes.prepare.train.trainer import TrainingOptions
from tests.scenes.prepare.conftest import painted_ball

OPTIONS = TrainingOptions(iterations=500, held_out_every=8, exposure=False)


def trainer(program):
    return ExternalTrainer(program, OPTIONS, stopwatch=lambda: 0.0)


@pytest.fixture
def program(tmp_path):
    """Makes a program of a few lines of Python that know `data` and `out`."""

    def make(body):
        script = tmp_path / "fake.py"
        script.write_text(
            "import pathlib, shutil, sys, time\n"
            f"data, out = map(pathlib.Path, sys.argv[1:])\n{body}\n"
        )
        return ExternalProgram(
            "Fake",
            lambda job: [sys.executable, str(script), str(job.data), str(job.out)],
            "*.ply",
            "install it",
        )

    return make


@pytest.fixture
def trained(tmp_path):
    path = tmp_path / "ready.ply"
    write_splats(path, painted_ball())
    return path


def test_its_splats_are_taken_and_judged(filmed_ball, program, trained, tmp_path):
    fake = program(
        "names = sorted(p.name for p in (data / 'images').iterdir())\n"
        "assert '07.png' not in names and len(names) == 14, names\n"
        "print('100/500\\r200/500', flush=True); time.sleep(1.2)\n"
        f"shutil.copy({str(trained)!r}, out / 'export_500.ply')"
    )
    seen = []
    result = trainer(fake).train(
        filmed_ball, tmp_path, progress=lambda done, note: seen.append((done, note))
    )
    assert result.psnr_db > 40
    assert [score.view for score in result.held_out] == ["07.png", "15.png"]
    assert (0.4, "Fake: 200/500") in seen
    assert result.trainer == "Fake"


def test_a_missing_program_is_named_with_its_remedy(filmed_ball, tmp_path):
    with pytest.raises(ValueError, match=r"Brush: no-such-brush was not found; install Brush"):
        trainer(brush("no-such-brush")).train(filmed_ball, tmp_path, progress=silent)
    lost = gsplat(tmp_path / "simple_trainer.py", sys.executable)
    with pytest.raises(ValueError, match=r"simple_trainer\.py was not found"):
        trainer(lost).train(filmed_ball, tmp_path, progress=silent)
    assert list(tmp_path.iterdir()) == []


def test_what_a_failing_program_said_is_passed_on(filmed_ball, program, tmp_path):
    fake = program("print('CUDA out of memory'); sys.exit(3)")
    with pytest.raises(ValueError, match=r"code 3: 'CUDA out of memory'.*trainer\.log"):
        trainer(fake).train(filmed_ball, tmp_path, progress=silent)


def test_no_splats_are_no_result(filmed_ball, program, tmp_path):
    with pytest.raises(ValueError, match="left no splats"):
        trainer(program("pass")).train(filmed_ball, tmp_path, progress=silent)


def test_cancelling_ends_the_program(filmed_ball, program, tmp_path):
    fake = program(
        "import os; (out / 'pid').write_text(str(os.getpid()))\nprint('1/500', flush=True)\n"
        "time.sleep(60)"
    )
    pids = []

    def stop(done, note):
        if done > 0:
            pids.append(int((tmp_path / "trained" / "pid").read_text()))
            raise Cancelled

    with pytest.raises(Cancelled):
        trainer(fake).train(filmed_ball, tmp_path, progress=stop)
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)


def test_splats_of_another_frame_are_refused(filmed_ball, program, trained, tmp_path):
    moved = tmp_path / "moved.ply"
    cloud = painted_ball()
    write_splats(moved, replace(cloud, means=3 * cloud.means[:, [1, 2, 0]] + 2))
    fake = program(f"shutil.copy({str(moved)!r}, out / 'x.ply')")
    with pytest.raises(ValueError, match=r"dB, wanted at least 15 dB.*normalize-world-space"):
        trainer(fake).train(filmed_ball, tmp_path, progress=silent)


@pytest.fixture
def installed(tmp_path, trained, monkeypatch):
    """Puts a stand-in of one of the programs on the disk, as its user has it."""
    stand_in = Path(__file__).with_name("stand_in_trainers.py")
    monkeypatch.setenv("STAND_IN_SPLATS", str(trained))
    monkeypatch.setenv("PYTHONPATH", str(stand_in.parents[4]))

    def install(name):
        if name in ("brush", "opensplat"):
            program = tmp_path / name
            program.write_text(f'#!/bin/sh\nexec {sys.executable} {stand_in} {name} "$@"\n')
            program.chmod(0o755)
            return {"brush": brush, "opensplat": opensplat}[name](str(program))
        script = tmp_path / {"gsplat": "simple_trainer.py", "inria": "train.py"}[name]
        words = [sys.executable, str(stand_in), name]
        script.write_text(
            f"import subprocess, sys\nsys.exit(subprocess.call({words!r} + sys.argv[1:]))\n"
        )
        return {"gsplat": gsplat, "inria": inria}[name](script, sys.executable)

    return install


@pytest.mark.parametrize("name", ["gsplat", "brush", "opensplat", "inria"])
def test_each_program_is_told_what_it_documents_and_its_result_is_found(
    name, filmed_ball, installed, tmp_path, monkeypatch
):
    program = installed(name)
    # As after `nexus prepare --out room.gnx`: the work folder is named from where the user is.
    monkeypatch.chdir(tmp_path)
    Path("work").mkdir()
    result = trainer(program).train(filmed_ball, Path("work"), progress=silent)
    assert result.psnr_db > 40
    assert result.trainer == program.name
    assert len(result.held_out) == 2


@pytest.mark.parametrize(
    ("name", "flag"), [("gsplat", "--no-normalize-world-space"), ("opensplat", "--keep-crs")]
)
def test_a_program_that_moves_the_world_is_refused(name, flag, filmed_ball, installed, tmp_path):
    program = installed(name)
    without = replace(
        program, command=lambda job: [word for word in program.command(job) if word != flag]
    )
    with pytest.raises(ValueError, match="dB, wanted at least 15 dB"):
        trainer(without).train(filmed_ball, tmp_path, progress=silent)


def test_a_flag_that_a_version_does_not_know_is_passed_on(filmed_ball, installed, tmp_path):
    program = installed("brush")
    older = replace(program, command=lambda job: [*program.command(job), "--total-steps", "3"])
    with pytest.raises(ValueError, match=r"code 2: .*unrecognized arguments: --total-steps"):
        trainer(older).train(filmed_ball, tmp_path, progress=silent)


def test_command_lines_name_data_result_and_end(tmp_path):
    job = ExternalJob(tmp_path / "in", tmp_path / "out", 700, 5000, 2)
    for program in (
        gsplat(tmp_path / "t.py"),
        brush(),
        opensplat(),
        inria(tmp_path / "train.py"),
    ):
        words = program.command(job)
        assert str(job.data) in words
        assert any(word.startswith(str(job.out)) for word in words)
        assert "700" in words
    assert "--no-normalize-world-space" in gsplat(tmp_path / "t.py").command(job)


@pytest.mark.parametrize(
    ("line", "share"),
    [
        ("  4%|4 | 1200/30000 [00:10<", 0.04),
        ("Step 15000: 0.0312 (50%)", 0.5),
        ("iteration 30001", 1.0),
        ("loading 12 images", 0.0),
        ("", 0.0),
    ],
)
def test_progress_is_read_from_what_they_print(line, share):
    assert external_trainers._share_done(line, 30_000) == pytest.approx(share)
