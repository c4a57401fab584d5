import pytest

from studio.app.model.documents.dropped import PICTURES, VIDEOS, photos_of, poses_in, what_is


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
    ("name", "head", "action_id"),
    [
        ("chair.obj", b"v 0 0 0", "twin.add_mesh"),
        ("chair.STL", b"solid", "twin.add_mesh"),
        ("chair.ply", b"ply\nformat ascii 1.0\nelement face 12\nend_header\n", "twin.add_mesh"),
        ("room.ply", b"ply\nelement vertex 9\nelement face 0\nend_header\n", "file.open_scene"),
        ("room.ply", b"ply\nend_header\nelement face 12\n", "file.open_scene"),
        ("chair.glb", b"glTF", "twin.add_mesh"),
        ("room.glb", b'glTF {"extensionsUsed":["KHR_gaussian_splatting"]}', "file.open_scene"),
    ],
)
def test_meshes_are_told_from_splats_by_what_is_in_them(tmp_path, name, head, action_id):
    (tmp_path / name).write_bytes(head)
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


def test_what_the_preparation_reads_is_taken():
    from scenes.prepare.footage.capture import PICTURE_SUFFIXES, VIDEO_SUFFIXES

    assert (PICTURES, VIDEOS) == (PICTURE_SUFFIXES, VIDEO_SUFFIXES)


@pytest.mark.parametrize(
    ("file", "poses"),
    [
        ("transforms.json", "transforms.json"),
        ("sparse/0/cameras.bin", "sparse/0"),
        ("sparse/cameras.txt", "sparse"),
        ("cameras.bin", "."),
    ],
)
def test_photos_with_the_poses_of_another_program_are_known(tmp_path, file, poses):
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_bytes(b"")
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "one.tif").write_bytes(b"")
    assert what_is(tmp_path).action_id == "preparation.add"
    assert poses_in(tmp_path) == tmp_path / poses
    assert photos_of(tmp_path) == tmp_path / "images"
    (tmp_path / "two.heic").write_bytes(b"")
    assert photos_of(tmp_path) == tmp_path


def test_what_is_foreign_or_missing_is_refused(tmp_path):
    (tmp_path / "letter.docx").write_bytes(b"")
    with pytest.raises(ValueError, match="the studio opens projects"):
        what_is(tmp_path / "letter.docx")
    with pytest.raises(ValueError, match="no such file"):
        what_is(tmp_path / "gone.ply")
    with pytest.raises(ValueError, match="this folder is no"):
        what_is(tmp_path)
