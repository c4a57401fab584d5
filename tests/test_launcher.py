"""The launcher's words when something it needs is not there."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A checkout with nothing installed, and a PATH with only the plain tools of a system."""
    shutil.copy(ROOT / "nexus", tmp_path / "nexus")
    shutil.copytree(ROOT / "requirements", tmp_path / "requirements")
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("sh", "find", "dirname", "uname", "grep", "cat", "id", "ls", "sort", "tr", "rm"):
        found = shutil.which(name)
        assert found is not None
        (tools / name).symlink_to(found)
    return tmp_path


def launch(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {"PATH": str(folder / "bin"), "HOME": str(folder)}
    return subprocess.run(
        [folder / "nexus", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_without_python_it_says_which_one_to_install(bare: Path) -> None:
    done = launch(bare, "rehearse")

    assert done.returncode == 1
    assert "install python3.11 or set NEXUS_PYTHON" in done.stderr
    assert not (bare / ".venv").exists()


def test_a_python_that_cannot_make_environments_leaves_nothing_behind(bare: Path) -> None:
    fake = bare / "bin" / "python3.11"
    fake.write_text('#!/bin/sh\n[ "$1" = -c ] && exit 0\nexit 1\n')
    fake.chmod(0o755)

    done = launch(bare, "rehearse")

    assert done.returncode == 1
    assert "python3-venv" in done.stderr
    assert not (bare / ".venv").exists()


def test_help_of_the_test_verb_installs_nothing(bare: Path) -> None:
    done = launch(bare, "test", "--help")

    assert done.returncode == 0
    assert "usage: ./nexus test" in done.stdout
    assert not (bare / ".venv").exists()
