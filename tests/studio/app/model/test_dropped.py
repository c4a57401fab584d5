import pytest

from studio.app.model.dropped import what_is


@pytest.mark.parametrize(
    ("name", "action_id"),
    [
        ("a.nexus", "file.open"),
        ("a.mcap", "timeline.open"),
        ("a.TOML", "scenario.open"),
        ("room.ply", "file.open_scene"),
        ("room.MP4", "preparation.add"),
        ("one.jpg", "preparation.add"),
    ],
)
def test_files_are_known_by_their_ending(tmp_path, name, action_id):
    (tmp_path / name).write_bytes(b"")
    assert what_is(tmp_path / name).action_id == action_id


@pytest.mark.parametrize(
    ("holds", "action_id"),
    [
        ("scene.json", "file.open_scene"),
        ("recording.mcap", "timeline.open"),
        ("one.JPG", "preparation.add"),
    ],
)
def test_folders_are_known_by_what_they_hold(tmp_path, holds, action_id):
    (tmp_path / holds).write_bytes(b"")
    assert what_is(tmp_path).action_id == action_id


def test_what_is_foreign_or_missing_is_refused(tmp_path):
    (tmp_path / "letter.docx").write_bytes(b"")
    with pytest.raises(ValueError, match="the studio opens projects"):
        what_is(tmp_path / "letter.docx")
    with pytest.raises(ValueError, match="no such file"):
        what_is(tmp_path / "gone.ply")
    with pytest.raises(ValueError, match="this folder is no"):
        what_is(tmp_path)
