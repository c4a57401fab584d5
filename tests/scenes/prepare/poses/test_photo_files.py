"""Photos by the names that other programs gave them."""

from __future__ import annotations

import pytest

from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.poses.photo_files import check_left_out, find_photo


@pytest.mark.parametrize(
    "name",
    [
        "images/cam1/0 ü.jpg",
        "images\\cam1\\0 ü.jpg",
        "D:\\scan\\images\\cam1\\0 ü.jpg",
        "/home/me/images/cam1/0 ü.jpg",
        "./images/cam1/0 ü",
        "cam1/0 ü.jpg",
    ],
)
def test_a_photo_is_found_by_the_end_of_its_path(tmp_path, name):
    photo = tmp_path / "images" / "cam1" / "0 ü.jpg"
    photo.parent.mkdir(parents=True)
    photo.touch()
    other = tmp_path / "images" / "cam2" / "0 ü.jpg"
    other.parent.mkdir()
    other.touch()
    assert find_photo(name, (tmp_path, tmp_path / "images")) == photo


def test_capitals_count_only_where_two_photos_differ_by_them(tmp_path):
    (tmp_path / "A.JPG").touch()
    assert find_photo("images/a.jpg", (tmp_path,)) == tmp_path / "A.JPG"
    (tmp_path / "a.Jpg").touch()
    assert find_photo("images/a.jpg", (tmp_path,)) is None
    assert find_photo("b.jpg", (tmp_path, tmp_path / "absent")) is None


def test_half_of_the_photos_may_be_missing_and_no_more(tmp_path):
    check_left_out(tmp_path, ["a: gone"] * 6, 12)
    with pytest.raises(CaptureError, match=r"7 of 12 photos cannot be used .* and 2 more\)"):
        check_left_out(tmp_path, ["a: gone"] * 7, 12)
