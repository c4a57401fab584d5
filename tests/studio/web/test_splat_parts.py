import threading

import pytest

from scenes.formats.registry import read_splats
from studio.session.pipeline import CancelledError
from studio.web.splat_parts import shadow_part, write_shadow_parts, write_splat_parts


def test_a_room_that_is_too_large_is_thinned_to_what_is_allowed(lab, tmp_path):
    parts = write_splat_parts(lab, tmp_path, allowed_bytes=500_000, cancelled=threading.Event())

    room, *objects = parts
    whole = sum(part.path.stat().st_size for part in parts)
    assert 0.85 * 500_000 < whole <= 500_000
    assert room.of_splats == len(lab.room)
    assert 0.2 * len(lab.room) < room.splats < 0.4 * len(lab.room)
    # Objects are what is looked at: they fit as they are.
    assert [part.splats for part in objects] == [len(item.splats) for item in lab.objects]


def test_a_room_that_fits_keeps_every_splat(lab, tmp_path):
    parts = write_splat_parts(lab, tmp_path, allowed_bytes=10_000_000, cancelled=threading.Event())

    assert all(part.splats == part.of_splats for part in parts)
    assert [part.name for part in parts] == ["room", *(f"object-{i}" for i in range(5))]


def test_a_size_at_which_nothing_is_recognised_is_refused(lab, tmp_path):
    with pytest.raises(ValueError, match="allow a larger viewer with --viewer-mb"):
        write_splat_parts(lab, tmp_path, allowed_bytes=9_000, cancelled=threading.Event())


def test_a_cancelled_one_stops(lab, tmp_path):
    cancelled = threading.Event()
    cancelled.set()

    with pytest.raises(CancelledError):
        write_splat_parts(lab, tmp_path, allowed_bytes=500_000, cancelled=cancelled)


def test_every_object_has_a_shadow_of_a_few_dark_splats(lab, tmp_path):
    parts = write_shadow_parts(lab, tmp_path)
    assert [part.name for part in parts] == [shadow_part(k) for k in range(len(lab.objects))]
    for part in parts:
        cloud = read_splats(part.path)
        assert 20 < len(cloud) < 600
        assert cloud.colours().max() < 0.05
        assert part.path.stat().st_size < 20_000
