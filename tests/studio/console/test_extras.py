"""What a light installation lacks is named with the command that brings it."""

from __future__ import annotations

import importlib.util
from typing import Any

import pytest

from studio import cli
from studio.console import extras
from studio.console.display import why_no_window
from studio.console.extras import (
    EXTRAS,
    MissingExtraError,
    explain_missing,
    require_extra,
    why_incomplete,
)


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """No package of an extra is here."""
    optional = {name for packages in EXTRAS.values() for name in packages}
    find = importlib.util.find_spec

    def found(name: str, *rest: Any) -> Any:
        return None if name in optional else find(name, *rest)

    monkeypatch.setattr(extras.importlib.util, "find_spec", found)


@pytest.mark.usefixtures("bare")
def test_verbs_that_cannot_run_say_what_to_install(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["prepare", "photos", "--out", "room.gnx"]) == cli.EXIT_INPUT
    assert capsys.readouterr().err == (
        "nexus: nexus prepare needs Open3D, pycolmap: pip install 'gaussiannexus-studio[prepare]'\n"
    )
    assert cli.main(["studio"]) == cli.EXIT_INPUT
    assert "pip install 'gaussiannexus-studio[studio]'" in capsys.readouterr().err


@pytest.mark.usefixtures("bare")
def test_without_qt_there_is_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")

    reason = why_no_window()

    assert reason is not None
    assert reason.startswith("the window needs Qt, ")


@pytest.mark.usefixtures("bare")
def test_an_extra_that_is_not_whole_is_refused() -> None:
    with pytest.raises(MissingExtraError, match=r"^a sweep needs distributed: pip install"):
        require_extra("cluster", what="a sweep")


def test_everything_is_here() -> None:
    assert [extra for extra in EXTRAS if why_incomplete(extra, what="it")] == []


def test_an_import_that_fails_within_a_verb_is_explained(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(words: list[str]) -> int:
        raise ModuleNotFoundError(f"No module named {words[1]!r}", name=words[1])

    monkeypatch.delenv(cli.TRACEBACK_VARIABLE, raising=False)
    monkeypatch.setattr(cli, "_dispatch", fail)

    assert cli.main(["gallery", "open3d.core"]) == cli.EXIT_INPUT
    assert capsys.readouterr().err == (
        "nexus: nexus gallery needs Open3D: pip install 'gaussiannexus-studio[prepare]'\n"
    )
    assert cli.main(["gallery", "nothing_of_ours"]) == cli.EXIT_FAILED
    assert "a defect of this program: ModuleNotFoundError" in capsys.readouterr().err
    assert explain_missing(ModuleNotFoundError("nameless"), what="it") is None
