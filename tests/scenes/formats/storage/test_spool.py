import pytest

from scenes.formats.storage.spool import contents, spools


def test_what_is_set_aside_comes_back_in_pieces_and_leaves_nothing(tmp_path):
    with spools(tmp_path / "a.glb", 2) as (one, other):
        other.write(b"defg")
        one.write(b"abc")
        assert list(contents(one, 2)) == [b"ab", b"c"]
        assert list(contents(one, 2)) == [b"ab", b"c"]
        assert b"".join(contents(other)) == b"defg"
        assert not [p for p in tmp_path.iterdir() if p.suffix == ".glb"]
    assert not list(tmp_path.iterdir())
    assert one.closed
    assert other.closed


def test_nothing_is_left_of_what_fails(tmp_path):
    with pytest.raises(TypeError), spools(tmp_path / "a", 3) as (one, *_):
        one.write("no bytes")
    assert one.closed
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError), spools(tmp_path / "gone" / "a", 1):
        pass
