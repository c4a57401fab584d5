import pytest

from studio.app.model.measured_line import MeasuredLine, free_place


def test_the_scale_makes_the_line_as_long_as_it_is():
    assert MeasuredLine("room.ply", 4.0).scale_for(2.0) == 0.5


@pytest.mark.parametrize(
    ("length", "true", "words"),
    [(4.0, 0.0, "more than 0"), (4.0, float("nan"), "more than 0"), (0.0, 2.0, "no length")],
)
def test_no_scale_comes_of_no_length(length, true, words):
    with pytest.raises(ValueError, match=words):
        MeasuredLine("room.ply", length).scale_for(true)


def test_the_new_scene_never_takes_the_place_of_one_that_is_there(tmp_path):
    file, package = tmp_path / "room.ply", tmp_path / "hall.gnx"
    file.touch()
    package.mkdir()
    assert free_place(file) == tmp_path / "room.gnx"
    (tmp_path / "room.gnx").mkdir()
    assert free_place(file) == tmp_path / "room-2.gnx"
    assert free_place(package) == tmp_path / "hall-scaled.gnx"
