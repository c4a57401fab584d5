import os
from datetime import UTC, datetime

import pytest

from studio.app.model.runs.session_folders import SessionFolders, let_go, read_kept, reserved
from studio.session.records.outputs import RECORDING

NOON = datetime(2026, 11, 26, 12, 0, 5, tzinfo=UTC)


@pytest.fixture
def folders(tmp_path):
    return SessionFolders(tmp_path / "sessions", now=lambda: NOON)


def recorded(folders, *words, report=""):
    folder = folders.reserve(None, words)
    (folder / RECORDING).write_text("recording")
    if report:
        (folder / "report.json").write_text(report)
    return folder


def test_names_say_when_and_what_and_none_is_taken_twice(folders):
    first = folders.reserve(None, ("lab", "two chairs/åö", ""))
    second = folders.reserve(None, ("lab", "two chairs/åö", ""))
    assert first.name == "2026-11-26_12-00-05_lab_two-chairs-åö"
    assert second.name == first.name + "-2"
    let_go(first)
    assert not first.exists()


def test_a_folder_with_something_in_it_is_not_let_go(tmp_path):
    folder = reserved(tmp_path / "a")
    (folder / "b").write_text("")
    let_go(folder)
    assert folder.exists()


def test_a_project_has_its_sessions_beside_it(folders, tmp_path):
    project = tmp_path / "mine.nexus"
    folder = folders.reserve(project, ("lab",))
    (folder / RECORDING).write_text("")
    other = recorded(folders, "desk")
    assert folder.parent == tmp_path / "mine-sessions"
    assert {kept.folder for kept in folders.listed(project)} == {folder, other}
    assert [kept.folder for kept in folders.listed(None)] == [other]


@pytest.mark.parametrize(
    ("report", "verdict", "cut_short"),
    [
        ('{"rows": [{"passed": true}, {"passed": null}]}', "all figures keep their limits", ""),
        ('{"rows": [{"passed": false}]}', "a figure misses its limit", ""),
        ('{"rows": [], "cut_short": "stopped"}', "", "stopped"),
        ("{", "", ""),
        ("[1]", "", ""),
    ],
)
def test_what_a_session_came_to_is_read_of_its_report(folders, report, verdict, cut_short):
    kept = read_kept(recorded(folders, "lab", "push", report=report))
    assert (kept.verdict, kept.cut_short, kept.title) == (verdict, cut_short, "lab · push")
    assert kept.begun.strftime("%H:%M:%S") == "12:00:05"


def test_what_is_deleted_comes_back_until_it_is_closed(folders):
    first, second = recorded(folders, "lab"), recorded(folders, "lab")
    folders.delete(first)
    folders.delete(second)
    assert folders.listed(None) == []
    assert folders.undo_delete() == second
    assert (second / RECORDING).read_text() == "recording"
    folders.close()
    assert not first.exists()
    assert [path.name for path in folders.root.iterdir()] == [second.name]
    with pytest.raises(ValueError, match="no session was deleted"):
        folders.undo_delete()


def test_what_comes_back_never_replaces_what_has_its_name_now(folders):
    first = recorded(folders, "lab")
    folders.delete(first)
    (first).mkdir()
    (first / RECORDING).write_text("another")
    assert folders.undo_delete().name == f"{first.name}-2"
    assert (first / RECORDING).read_text() == "another"


def test_only_sessions_are_deleted(folders, tmp_path):
    (tmp_path / "photos").mkdir()
    with pytest.raises(ValueError, match="nothing was deleted"):
        folders.delete(tmp_path / "photos")
    assert (tmp_path / "photos").exists()


def test_what_a_studio_that_crashed_had_deleted_is_there_again(folders):
    folder = recorded(folders, "lab")
    folders.delete(folder)
    trash = next(path for path in folders.root.iterdir() if path.name.startswith(".deleted"))
    trash.rename(trash.with_name(".deleted-999999999"))
    assert str(os.getpid()) in trash.name
    again = SessionFolders(folders.root)
    assert [kept.folder for kept in again.listed(None)] == [folder]
