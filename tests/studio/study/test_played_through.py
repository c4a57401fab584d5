"""Both applications of the paper, done by scripted people over real sockets, and the report."""

from __future__ import annotations

import csv
import re
import threading
import time

import numpy as np
import pytest

from devices.camera.address import parse_address
from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.clock import WallClock
from devices.messages import Event
from devices.recorded.people import RecordedAvatar, RecordedProposal
from devices.recording import read_recording
from studio.live.people.hosting import Hosting
from studio.live.setup import LiveSetup, Place
from studio.session import opening
from studio.study import trial
from studio.study.results.report import write_study_report
from studio.study.results.tables import tables_of, write_tables
from studio.study.trial import BEGUN, ENDED, Director, Stage, play_trial
from tests.pushed_camera import FedPicture, RtmpPush, StreamOptions

FPS = 20


def textured(size=(256, 128)):
    generator = np.random.default_rng(3)
    ground = np.kron(generator.integers(60, 220, (16, 32, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    for number in range(60 * FPS):
        picture = np.roll(ground, 4 * number, axis=1)
        yield FedPicture(round(number * 1e9 / FPS), picture[: size[1], : size[0]].copy())


@pytest.fixture
def stage(rooms, acting, monkeypatch):
    """What a trial is played on: a real camera stream, and a tracker of what was acted."""
    rows = {name: acting.acted(it.room, it.text) for name, it in rooms.items()}
    begun = threading.Event()

    class Seen(Director):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            begun.clear()

        def see(self, state, t_ns):
            super().see(state, t_ns)
            if self.begun_ns is not None:
                begun.set()

    monkeypatch.setattr(trial, "Director", Seen)
    monkeypatch.setattr(
        opening,
        "make_method",
        lambda _name, scene, *_, **__: acting.tracker(rows[scene.name], begun),
    )
    clock = WallClock()

    def films(session, _task, *, target, stack, say):
        deadline = time.monotonic() + 120
        while not session.status().listening_at and time.monotonic() < deadline:
            time.sleep(0.02)
        options = StreamOptions(fps=FPS, bitrate=2_000_000, keyframe_interval=5)
        stream = RtmpPush(session.listening_at, textured(), clock, options=options)
        stack.callback(stream.close)

    return Stage(
        LiveSetup(
            parse_address("rtmp://127.0.0.1:0/live/room"),
            layout=LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0)),
            place=Place.SCAN,
            calibrates=False,
        ),
        Hosting(invitations=0),
        clock,
        is_rehearsed=True,
        films=films,
        opened=lambda name: rooms[name].scene,
        say=lambda _line: None,
    )


def test_both_applications_are_completed_and_reported(folder, rooms, stage):
    first = folder.trials[0].participant
    played = {}
    for _ in range(2):  # both tasks under the first condition
        task = folder.next_trial(first)
        played[task.task] = ended = play_trial(folder, task, stage=stage)
        assert ended is not None
        assert ended.ended_by == "reached"
        assert 1.5 < ended.duration_s < 15.0
    assert played.keys() == {"layout", "tangram"}
    assert folder.has_agreed(first)
    assert folder.has_answered(first, "about", trial="")
    for each in folder.trials_for(first)[:2]:
        assert folder.has_answered(first, "tlx", trial=each.name)
    assert folder.has_answered(first, "sus", trial=folder.trials_for(first)[1].name)

    # What is recorded has nobody's name, and says when the task was done.
    for each in folder.trials_for(first)[:2]:
        values = list(read_recording(folder.folder_of(each) / "live.mcap"))
        names = {v.avatar.name for v in values if isinstance(v, RecordedAvatar)}
        assert names <= {first, "other-1"}
        kinds = [v.kind for v in values if isinstance(v, Event)]
        assert kinds.count(BEGUN) == kinds.count(ENDED) == 1
        proposed = [v.proposal.user_name for v in values if isinstance(v, RecordedProposal)]
        assert set(proposed) == ({first} if each.task == "layout" else set())
        text = b"guide" if each.task == "layout" else b"teacher"
        assert text not in (folder.folder_of(each) / "trial.json").read_bytes()

    tables = tables_of(folder, {name: it.scene.objects for name, it in rooms.items()})
    by_task = {row["task"]: row for row in tables.trials}
    assert by_task["layout"]["moves"] == by_task["tangram"]["moves"] == "2"
    assert by_task["layout"]["corrections"] == "0"
    assert by_task["layout"]["proposals"] == by_task["layout"]["lines"] == "1"
    assert float(by_task["tangram"]["off_cm"]) < 1.0
    assert float(by_task["layout"]["pointing_share"]) > 0.3
    files = write_tables(folder, tables)
    with files[-1].open() as book:
        described = {(row["table"], row["column"]) for row in csv.DictReader(book)}
    assert ("trials", "corrections") in described

    page = write_study_report(folder, tables).read_text()
    assert "2 of 2 trials were done by simulated people" in page
    assert "85 in the paper" in page
    assert len(re.findall("<svg", page)) > 5
