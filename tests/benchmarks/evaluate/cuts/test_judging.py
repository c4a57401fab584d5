"""A capture is judged with any way to cut, and the rows tell how rooms came about."""

from benchmarks.evaluate.cuts.capturing import Notes
from benchmarks.evaluate.cuts.cutting import with_labels
from benchmarks.evaluate.cuts.judging import capture_rows, judged
from studio.console.progress import Progress


def test_another_way_to_cut_is_judged_in_its_place(cubes):
    asked = []

    def left_half(capture, prompted):
        asked.append(len(prompted))
        return with_labels(capture.package, capture.package.room.means[:, 0] < 0)

    quiet = Progress(lambda line, last: None)
    scores = judged(cubes, ways=("click", "two_boxes"), cut=left_half, progress=quiet)
    assert asked == [1, 2, 1, 2]
    assert [(s.object_id, s.way) for s in scores] == [
        ("red", "click"),
        ("red", "two_boxes"),
        ("blue", "click"),
        ("blue", "two_boxes"),
    ]
    assert all(score.missing == 0.0 for score in scores if score.object_id == "red")
    assert all(score.missing == 1.0 for score in scores if score.object_id == "blue")


def test_a_room_without_poses_misses_its_bar():
    fine = Notes("random-1", 0.95, "", 33.0, 4.0)
    failed = Notes("random-2", 0.0, "structure from motion turned 6 of 56 photos", 33.0, 4.0)
    rows = {row.name: row for row in capture_rows([(fine, 0.004), (failed, 0.001)])}
    assert rows["cuts.rooms"].value == 2
    assert rows["cuts.rooms_without_poses"].passed is False
    assert rows["cuts.world_off_mm.max"].value == 4.0
    assert rows["cuts.world_off_mm.max"].passed is True
