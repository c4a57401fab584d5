import itertools
import time

import pytest

from sim.wire.streaming.truth_file import TruthWriter, read_truth


class Kept:
    """An output that keeps what it is given."""

    name, url, connections, sent_units = "kept", "kept://", 1, 0

    def __init__(self, setting):
        self._setting = setting
        self.units = []

    def put(self, unit):
        self.units.append((time.monotonic(), unit))
        self._setting.sent(unit, self.name)

    def close(self):
        pass


def played(camera):
    kept = Kept(camera.setting())
    camera.add(kept)
    camera.start()
    camera.join(120)
    assert not camera.is_running
    return kept.units


def test_it_plays_at_its_pace_for_as_long_as_it_is_asked(make_camera):
    units = played(make_camera(seconds=3.0))
    assert [unit.number for _, unit in units] == list(range(75))
    assert units[-1][0] - units[0][0] == pytest.approx(74 / 25, abs=0.3)


def test_faults_are_said_when_they_begin_and_end(make_camera, event_log):
    played(make_camera("delay:at=0.4,for=0.4,size=0.1", "freeze:at=0.6,for=9", seconds=1.2))
    said = [(e.name, e.values["kind"], e.t_ns / 1e9) for e in event_log.events]
    assert said == [
        ("fault_begins", "delay", pytest.approx(0.4)),
        ("fault_begins", "freeze", pytest.approx(0.6)),
        ("fault_ends", "delay", pytest.approx(0.8)),
    ]


def test_the_truth_has_a_row_for_every_picture_even_while_it_is_away(make_camera, tmp_path):
    writer = TruthWriter(tmp_path / "truth.jsonl")
    camera = make_camera("restart:at=0.4,for=0.4", seconds=1.2, truth=writer)
    units = played(camera)
    writer.close()
    rows = read_truth(tmp_path / "truth.jsonl")
    assert [row.time.number for row in rows] == list(range(30))
    assert [row.time.is_on for row in rows].count(False) == 30 - len(units) == 10
    assert all(("kept" in row.sent_ns) == row.time.is_on for row in rows)
    steps = {b.time.wall_ns - a.time.wall_ns for a, b in itertools.pairwise(rows)}
    assert max(steps) < 60_000_000
    assert min(steps) > 20_000_000


def test_before_the_start_no_fault_is_there(make_camera):
    camera = make_camera("restart:at=0,for=1")
    assert camera.setting().current().is_on
