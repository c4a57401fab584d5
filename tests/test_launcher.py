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


@pytest.fixture
def installed(bare: Path) -> Path:
    """A checkout whose environment is made and whose crate is built; its Python notes calls."""
    for name in ("xargs", "sha256sum", "sed", "cut", "touch"):
        found = shutil.which(name)
        assert found is not None
        (bare / "bin" / name).symlink_to(found)
    for folder in (".venv/bin", "scenes", "native/src", "web"):
        (bare / folder).mkdir(parents=True)
    for made in ("scenes/_native.abi3.so", "native/Cargo.toml", "native/Cargo.lock"):
        (bare / made).touch()
    shutil.copy(ROOT / "web" / "package-lock.json", bare / "web")
    python = bare / ".venv" / "bin" / "python"
    python.write_text(
        '#!/bin/sh\nprintf "%s\\n" "$*" >>"${0%/*}/calls"\n[ "$1" != -c ] || exit 1\n'
    )
    python.chmod(0o755)
    for stamp in (".nexus-run", ".nexus-native"):
        (bare / ".venv" / stamp).touch()
    return bare


def test_without_the_viewer_s_libraries_every_command_still_runs(installed: Path) -> None:
    first, second = launch(installed, "doctor"), launch(installed, "doctor")

    calls = (installed / ".venv" / "bin" / "calls").read_text().splitlines()
    assert first.returncode == second.returncode == 0
    assert "nexus share will try again" in first.stderr
    # It is tried once for each version of the lock file, not at every command.
    assert second.stderr == ""
    assert [call for call in calls if call.startswith("-m")] == ["-m studio.cli doctor"] * 2
    assert len([call for call in calls if "web_files" in call]) == 1
