import numpy as np
import pytest

from scenes.pose import Pose
from sim.wire.film.film import PictureTruth
from sim.wire.streaming.truth_file import PictureTime, TruthWriter, read_truth
from sim.wire.unit_faults import OutgoingUnit


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "truth.jsonl"
    writer = TruthWriter(file)
    pose = Pose.from_yaw(0.3)
    truth = PictureTruth(0, {"chair": pose}, {"chair": 0.25}, Pose(np.eye(3), np.ones(3)))
    writer.taken(PictureTime(0, 0, 0, 1000), truth)
    writer.sent(OutgoingUnit(0, 0, 0, 0, 0, b"", True, 0, 0.0, False), "rtmp", 1500)
    writer.taken(PictureTime(1, 1, 40, 1040, is_on=False), None)
    writer.close()
    writer.sent(OutgoingUnit(1, 0, 0, 0, 0, b"", True, 0, 0.0, False), "rtmp", 1500)
    return file


def test_rows_come_back(path):
    first, second = read_truth(path)
    assert first.time == PictureTime(0, 0, 0, 1000)
    assert first.sent_ns == {"rtmp": 1500}
    assert first.visible_fraction == {"chair": 0.25}
    assert np.allclose(first.world_from_object["chair"].matrix(), Pose.from_yaw(0.3).matrix())
    assert first.world_from_rig.translation.tolist() == [1, 1, 1]
    assert second.time == PictureTime(1, 1, 40, 1040, is_on=False)
    assert (second.world_from_object, second.world_from_rig, second.sent_ns) == ({}, None, {})


def test_a_line_that_is_still_being_written_is_left_out(path):
    whole = path.read_text()
    path.write_text(whole[:-5])
    assert len(read_truth(path)) == 1


@pytest.mark.parametrize("line", ["nothing", "{}", '{"sent": {"number": 9, "to": "x"}}', "[1]"])
def test_a_line_of_something_else_is_named(path, line):
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(ValueError, match=r"truth\.jsonl:4"):
        read_truth(path)
